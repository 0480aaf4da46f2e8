"""Claims about Newmark's family: the textbook's order, stability and elongation of periods."""

import numpy as np
import pytest

import spim

BASELINES = ("newmark", "generalized_alpha", "central_difference")
M, K = np.diag([2.0, 1.0]), np.array([[300.0, -100.0], [-100.0, 100.0]])
G = np.array([[0.0, 2.0], [-2.0, 0.0]])


def oscillator(w):
    return spim.StructuralSystem([[1.0]], [[w * w]])


@pytest.mark.parametrize("method", BASELINES)
@pytest.mark.parametrize(
    "load",
    [
        spim.loads.Harmonic([1.0, -2.0], 5.0),
        spim.loads.Sampled(np.sin(np.arange(41.0))[:, None] * [1.0, 0.5], 0.05),
        spim.loads.Function(lambda t: [t * t, np.cos(t)], degree=7),
    ],
)
def test_order_two_with_damping_gyroscopic_terms_and_loads(method, load):
    C = spim.damping.rayleigh(M, K, alpha=0.1, beta=0.01)
    system = spim.StructuralSystem(M, K, damping=C, gyroscopic=G, load=load)
    z0 = system.state(q=[0.1, -0.1], v=[0.0, 1.0])
    exact = spim.integrate(system, z0, (0.0, 2.0), 0.05)
    errors = []
    for step in (0.05 / 8, 0.05 / 16, 0.05 / 32):
        found = spim.integrate(system, z0, (0.0, 2.0), step, method=method)
        each = round(0.05 / step)
        errors.append(np.abs(found.z[::each] - exact.z).max())
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.abs(slopes - 2.0).max() <= 0.1, errors


def phase(method, h_w, **options):
    """Angle a step of an oscillator really takes."""
    system = oscillator(h_w)
    z = spim.integrate(system, system.state(q=[1.0]), (0.0, 2.0), 1.0, method=method, **options).q
    return np.arccos((z[2, 0] + z[0, 0]) / (2.0 * z[1, 0]))


@pytest.mark.parametrize("h_w", [0.1, 0.5, 1.0])
def test_periods_are_elongated_as_the_textbook_says(h_w):
    # Average acceleration: tan(phase / 2) = h w / 2; central difference: sin(phase / 2) = h w / 2.
    assert phase("newmark", h_w) == pytest.approx(2.0 * np.arctan(0.5 * h_w), rel=1e-12)
    shortened = phase("central_difference", h_w)
    assert shortened == pytest.approx(2.0 * np.arcsin(0.5 * h_w), rel=1e-12)
    # Fox & Goodwin, beta = 1/12, is of order 4 in the phase.
    assert phase("newmark", h_w, beta=1 / 12) == pytest.approx(h_w, rel=h_w**4 / 400)


def test_the_central_difference_is_stable_to_two():
    for h_w, bounded in ((1.99, True), (2.01, False)):
        system = oscillator(h_w)
        run = spim.integrate(
            system, system.state(q=[1.0]), (0, 300.0), 1.0, method="central_difference"
        )
        assert (np.abs(run.q).max() < 100.0) == bounded
    system = oscillator(10.0)
    with pytest.raises(spim.ModelError, match="h w_max < 2") as caught:
        spim.integrate(system, [1.0, 0.0], (0, 1e4), 1.0, method="central_difference")
    assert np.isfinite(caught.value.partial.z).all()


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 1.0])
def test_generalized_alpha_leaves_rho_of_the_highest_modes(rho):
    system = oscillator(1e6)
    run = spim.integrate(
        system, system.state(q=[1.0]), (0, 60.0), 1.0, method="generalized_alpha", rho_inf=rho
    )
    size = np.abs(run.q[:, 0])
    if rho == 0.0:
        assert size[5] < 1e-6
    else:
        # A triple root: k^2 rho^k at first.
        assert (size[60] / size[59]) == pytest.approx(rho, rel=0.06)


def test_average_acceleration_keeps_the_energy():
    system = spim.StructuralSystem(M, K)
    run = spim.integrate(
        system, system.state(q=[1.0, 0.0]), (0.0, 1000.0), 0.1, method="newmark", every=100
    )
    assert np.abs(run.energy / run.energy[0] - 1.0).max() <= 1e-11


@pytest.mark.parametrize(
    ("system", "options", "error", "words"),
    [
        (spim.LinearSystem(np.eye(2)), {"method": "newmark"}, spim.UnsupportedError, "mass"),
        (oscillator(1.0), {"method": "newmark", "beta": 2.0}, ValueError, "beta: must be 0 to 1"),
        (oscillator(1.0), {"method": "newmark", "beta": "x"}, ValueError, "beta: must be a number"),
        (
            oscillator(1.0),
            {"method": "generalized_alpha", "rho_inf": -1},
            ValueError,
            "rho_inf: must be 0 to 1",
        ),
        (
            oscillator(1.0),
            {"method": "central_difference", "beta": 0.1},
            TypeError,
            "unknown option",
        ),
    ],
)
def test_bad_options_say_what_is_wrong(system, options, error, words):
    with pytest.raises(error, match=words):
        spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, **options)
