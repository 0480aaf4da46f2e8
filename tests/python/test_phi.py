"""Claims about phi-functions and what a sampler sees of a linear system."""

from pathlib import Path

import numpy as np
import pytest

import spim

DATA = np.load(Path(__file__).parents[1] / "data" / "phi.npz")


@pytest.mark.parametrize("name", DATA["names"])
def test_phi_is_within_0_51_ulp_of_the_largest_entry(name):
    a, *expected = DATA[name]
    for found, exact in zip(spim.phi(a, 4), expected, strict=True):
        assert np.abs(found - exact).max() <= 0.51 * np.spacing(np.abs(exact).max())


def test_phi_above_32_rows_works_in_doubles():
    for name in ("decaying", "random"):
        a, *expected = DATA[name]
        copies = 36 // len(a)
        ours = spim.phi(np.kron(np.eye(copies), a), 4)
        for found, exact in zip(ours, expected, strict=True):
            error = np.abs(found - np.kron(np.eye(copies), exact)).max()
            assert error <= 1e-13 * np.abs(exact).max()


def test_phi_of_a_product_is_that_of_the_exact_product():
    a = np.array([[0.0, 1.0], [-3.0, 0.0]])
    for ours, expected in zip(spim.phi(a, 3, tau=0.25), spim.phi(0.25 * a, 3), strict=True):
        assert np.array_equal(ours, expected)


def test_phi_of_stacks_and_zero_order():
    stack = np.random.default_rng(0).normal(size=(2, 3, 4, 4))
    found = spim.phi(stack, 2)
    assert [phi.shape for phi in found] == [(2, 3, 4, 4)] * 3
    assert np.array_equal(found[2][1, 2], spim.phi(stack[1, 2], 2)[2])
    (only,) = spim.phi(stack, 0)
    assert np.array_equal(only, spim.expm(stack, method="exact"))
    assert [phi.shape for phi in spim.phi(np.zeros((0, 0)), 1)] == [(0, 0)] * 2


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((np.ones((2, 3)), 1), ValueError, "must be square"),
        (([[np.inf]], 1), ValueError, "entry"),
        (([[1.0]], 9), ValueError, "0 to 8"),
        (([[1.0]], -1), ValueError, "negative"),
        (([[1.0]], 1.5), TypeError, "integer"),
        (([[1j]], 1), TypeError, "real"),
        (([[800.0]], 1), OverflowError, "1.8e308"),
    ],
)
def test_phi_refuses(arguments, error, words):
    with pytest.raises(error, match=words):
        spim.phi(*arguments)


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_discretize_steps_exactly_through_held_inputs(hold):
    # x'' = u: a singular A, whose motion is a polynomial.
    found = spim.discretize([[0, 1], [0, 0]], [[0], [1]], 0.5, hold=hold)
    exact = {"zero": [[[0.125], [0.5]]], "first": [[[1 / 12], [0.25]], [[1 / 24], [0.25]]]}[hold]
    assert np.array_equal(found[0], [[1, 0.5], [0, 1]])
    for ours, expected in zip(found[1:], exact, strict=True):
        assert np.allclose(ours, expected, rtol=2e-16, atol=0)


def test_discretize_noise_of_an_oscillator_and_of_stiff_decay():
    # White acceleration: Qd = [[t^3/3, t^2/2], [t^2/2, t]].
    _, covariance = spim.discretize_noise([[0, 1], [0, 0]], [[0, 0], [0, 1]], 0.5)
    assert np.allclose(covariance, [[1 / 24, 1 / 8], [1 / 8, 1 / 2]], rtol=4e-16)
    # x' = -a x + w: (1 - exp(-2 a t)) / 2 a, however large a t.
    step, covariance = spim.discretize_noise([[-1e4]], [[2.0]], 1.0)
    assert step[0, 0] == 0.0
    assert abs(covariance[0, 0] * 1e4 - 1.0) < 4e-15
    # However large the noise is.
    _, covariance = spim.discretize_noise([[-1.0]], [[1e307]], 1.0)
    assert covariance[0, 0] == pytest.approx(1e307 * 0.5 * -np.expm1(-2.0), rel=4e-15)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: spim.discretize(np.eye(2), np.ones(2), 0.1), ValueError, r"B: must have shape"),
        (lambda: spim.discretize(np.eye(2), np.ones((3, 1)), 0.1), ValueError, "B: must have"),
        (lambda: spim.discretize(np.eye(2), np.ones((2, 1)), 0.0), ValueError, "tau: must be"),
        (lambda: spim.discretize(np.eye(2), np.ones((2, 1)), 1, "x"), ValueError, "hold"),
        (lambda: spim.discretize(np.eye(2), [["a"], ["b"]], 1), TypeError, "B: needs"),
        (lambda: spim.discretize_noise(np.eye(2), [[0, 1], [0, 0]], 1), ValueError, "symmetric"),
        (lambda: spim.discretize_noise(np.eye(2), [[np.nan]], 1), ValueError, "Q: entry"),
        (lambda: spim.discretize_noise(np.eye(2), [[1]], 1), ValueError, "Q: must have"),
        (lambda: spim.discretize_noise(np.eye(2), -np.eye(2), 1), ValueError, "semidefinite"),
        (lambda: spim.discretize(np.eye(1), [[1e308]], 5.0), OverflowError, "Bd: an entry"),
        (lambda: spim.discretize_noise(np.eye(1) * 400, [[1.0]], 1.0), OverflowError, "Qd|1.8e308"),
        (lambda: spim.discretize_noise(np.eye(1) * 1e300, [[1]], 1e300), OverflowError, "tau"),
        (lambda: spim.discretize([[1.0]], [[1.0]], "1"), TypeError, "tau"),
    ],
)
def test_discretize_refuses(call, error, words):
    with pytest.raises(error, match=words):
        call()
