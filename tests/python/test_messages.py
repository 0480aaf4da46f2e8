"""Claims about what is said of input that cannot be used: each names what is wrong."""

import warnings

import numpy as np
import pytest
import scipy.sparse

import spim
from spim import loads

SYSTEM = spim.StructuralSystem([[2.0, 0.0], [0.0, 1.0]], [[20.0, -5.0], [-5.0, 10.0]])


def run(load):
    return spim.integrate(SYSTEM.with_load(load), SYSTEM.state(), (0.0, 1.0), 0.1)


def stepper():
    return spim.Run(SYSTEM, SYSTEM.state(), step=0.1)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: run(loads.Exponential([1.0, 1.0], 1e4)), OverflowError, "load: an exp"),
        (lambda: run(loads.Function(lambda t: [1j, 0.0])), TypeError, "load: the function"),
        (lambda: run(loads.Function(lambda t: "a")), TypeError, "load: the function"),
        (lambda: spim.StructuralSystem([[1e-305]], [[1.0]]), ValueError, "mass: cannot be inv"),
        (
            lambda: spim.StructuralSystem([[1.0]], [[4.0]]).frequency_response([1.0, 2.0]),
            np.linalg.LinAlgError,
            "2 rad/s is a resonance",
        ),
        (lambda: SYSTEM.frequency_response([1.0], outputs=[2]), ValueError, "outputs: .* 0 to 1"),
        (lambda: SYSTEM.frequency_response([1.0], outputs=[-1]), ValueError, "outputs: .* 0 to 1"),
        (lambda: SYSTEM.energy([1.0, 2.0]), ValueError, r"z: must have shape \(\.\.\., 4\)"),
        (lambda: SYSTEM.velocity(np.ones((3, 2))), ValueError, "z: must have shape"),
        (lambda: stepper().restore(3), TypeError, "checkpoint"),
        (lambda: stepper().restore((1, [0.0])), ValueError, "state: must have shape"),
        (
            lambda: spim.ensemble(SYSTEM, SYSTEM.state(), (0.0, 1.0), 0.1, throw=True),
            TypeError,
            "throw",
        ),
    ],
)
def test_errors_name_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_a_failed_restore_leaves_the_run_where_it_is():
    run = stepper()
    run.step([1.0, 0.0])
    before = run.checkpoint()
    with pytest.raises(ValueError, match="state"):
        run.restore((0, [np.nan] * 4))
    after = run.checkpoint()
    assert after[0] == before[0]
    assert (after[1] == before[1]).all()


def test_a_sweep_says_what_build_must_return():
    (case,) = spim.sweep(lambda parameter: None, [1])
    assert "build: must return" in case.message


def test_outputs_may_be_sparse():
    matrix = [[1.0, 0.0, 0.0, 0.0]]
    z0 = SYSTEM.state(v=[1.0, 0.0])
    found = [
        spim.integrate(SYSTEM, z0, (0.0, 1.0), 0.1, outputs=given).outputs
        for given in (matrix, scipy.sparse.csr_array(matrix))
    ]
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_units_that_lose_no_digit_raise_no_warning(unit):
    """Displacements in other units: the matrix is as good, its norm is not."""
    system = spim.StructuralSystem(np.diag([1.0, unit**2]), np.diag([4.0, 9.0 * unit**2]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = spim.integrate(system, system.state(v=[1.0, 1.0]), (0.0, 1.0), 0.1)
    exact = [np.sin(2.0) / 2.0, np.sin(3.0) / 3.0]
    assert np.abs(run.q[-1] / exact - 1.0).max() <= 1e-14
