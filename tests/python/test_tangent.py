"""Claims about tangent maps of runs."""

import numpy as np
import pytest
from beams import kane
from systems import A, C, K, M, gradient

import spim
from spim import models


def symplectic_defect(J):
    n = len(J) // 2
    form = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(n))
    return np.abs(J.T @ form @ J - form).max()


def test_linear_systems_have_their_exponential():
    for options in ({}, {"correction": "exact"}):
        run = spim.integrate(spim.LinearSystem(A), np.ones(4), (1.0, 6.0), 0.05, **options)
        for t in (1.0, 6.0, 3.0, 3.017):
            want = spim.expm((t - 1.0) * A)
            assert np.abs(run.jacobian(t) - want).max() <= 1e-13 * np.abs(want).max()
    loaded = spim.StructuralSystem(M, K, damping=C, load=spim.loads.Harmonic([1.0, 0, 0], 2.0))
    run = spim.integrate(loaded, loaded.state(), (0.0, 5.0), 0.05)
    assert np.abs(run.jacobian() - spim.expm(5.0 * loaded.A)).max() <= 1e-13
    # Of the method, not of the motion.
    run = spim.integrate(loaded, loaded.state(), (0.0, 5.0), 0.05, method="gauss4")
    off = np.abs(run.jacobian() - spim.expm(5.0 * loaded.A)).max()
    assert 1e-9 <= off <= 1e-5


def kepler(e=0.3):
    return models.Kepler(), [1.0 - e, 0.0, 0.0, np.sqrt((1.0 + e) / (1.0 - e))]


@pytest.mark.parametrize(
    "method",
    ["verlet", "yoshida4", "yoshida6", "yoshida8", "midpoint", "srk2", "gauss6", "gauss16"],
)
def test_tangents_of_symplectic_methods_are_symplectic(method):
    system, z0 = kepler()
    run = spim.integrate(system, z0, (0.0, 20.0), 0.05, method=method)
    J = run.jacobian()
    # 1e-14 to 1e-13 of a step, 400 steps, growth by 130.
    assert np.abs(J).max() <= 200.0
    assert symplectic_defect(J) <= 1e-9
    lost = spim.integrate(system, z0, (0.0, 20.0), 0.05, method="rk4").jacobian()
    assert symplectic_defect(lost) >= 1e-5


def test_multipliers_of_kepler_orbits_are_one():
    system, z0 = kepler()
    period = 2.0 * np.pi
    J = spim.integrate(system, z0, (0.0, period), period / 128, method="gauss16").jacobian()
    # (J - 1)^2 = 0: the roots of what rounding leaves are at its square root.
    assert np.abs((J - np.eye(4)) @ (J - np.eye(4))).max() <= 1e-9
    assert np.abs(np.linalg.eigvals(J) - 1.0).max() <= 1e-4
    # d z / d z0 along the orbit is the orbit's rate.
    rate = system.rate(np.array(z0))
    assert np.abs(J @ rate - rate).max() <= 1e-10


def test_mathieu_multipliers_tell_stable_from_unstable():
    # q'' + (a + 2 b cos 2t) q = 0: by parametric resonance near a = 1 unstable.
    for a, stable in ((1.0, False), (2.0, True)):
        system = spim.SeparableSystem(
            lambda t, q, a=a: -(a + 0.4 * np.cos(2.0 * t)) * q, mass=[1.0]
        )
        run = spim.integrate(system, [0.3, 0.2], (0.0, np.pi), np.pi / 200, method="yoshida8")
        J = run.jacobian()
        # A linear map: the runs from unit states are its columns.
        for column, unit in zip(J.T, np.eye(2), strict=True):
            z = spim.integrate(system, unit, (0.0, np.pi), np.pi / 200, method="yoshida8").z[-1]
            assert np.abs(column - z).max() <= 1e-11
        assert (np.abs(np.linalg.eigvals(J)).max() < 1.0 + 1e-9) == stable


def test_tangents_are_differences_of_runs_wherever_they_end():
    system = models.HenonHeiles()
    z0 = np.array([0.1, 0.2, 0.3, 0.1])
    options = {"method": "gauss8", "step": 0.1}
    run = spim.integrate(system, z0, (1.0, 11.0), **options)
    sparse = spim.integrate(system, z0, (1.0, 11.0), every=7, **options)
    stop = spim.integrate(system, z0, (1.0, 11.0), callback=lambda t, z: t < 4.95, **options)
    for t in (5.0, 5.04):
        columns = []
        for j in range(4):
            d = 1e-4 * np.eye(4)[j]
            ends = [
                spim.integrate(system, z0 + s * d, (1.0, 11.0), t_eval=[t], **options).z[-1]
                for s in (-2, -1, 1, 2)
            ]
            columns.append((ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / 12e-4)
        J = run.jacobian(t)
        assert np.abs(J - np.array(columns).T).max() <= 1e-9
        assert np.abs(sparse.jacobian(t) - J).max() <= 1e-12
    assert np.array_equal(stop.jacobian(), run.jacobian(stop.t[-1]))
    assert np.array_equal(run.jacobian(1.0), np.eye(4))


def test_backward_runs_undo_the_map():
    system = spim.HamiltonianSystem(1, gradient)
    there = spim.integrate(system, [1.0, 0.3], (0.0, 5.0), 0.1, method="gauss8")
    back = spim.integrate(system, there.z[-1], (5.0, 0.0), 0.1, method="gauss8")
    assert np.abs(back.jacobian() @ there.jacobian() - np.eye(2)).max() <= 1e-10


def test_beams_have_one_as_well():
    beam = kane(elements=2, damping=(0.1, 1e-4))
    run = spim.integrate(beam, beam.state(v=lambda x: 1e-4 * x**2), (0.0, 0.05), 1e-3)
    J = run.jacobian()
    assert J.shape == (12, 12)
    scale = np.array([1e-6, 1e-3, 1e-3] * 2 + [1e-2] * 6)
    z0, d = run.z[0], 1e-3 * scale
    moved = spim.integrate(beam, z0 + d, (0.0, 0.05), 1e-3).z[-1]
    other = spim.integrate(beam, z0 - d, (0.0, 0.05), 1e-3).z[-1]
    assert np.abs((moved - other) / 2.0 - J @ d).max() <= 1e-6 * np.abs(J @ d).max()


def test_what_has_none_says_so():
    system, z0 = kepler()
    run = spim.integrate(system, z0, (0.0, 1.0), 0.1)
    with pytest.raises(ValueError, match="t: 1.5 is outside the run"):
        run.jacobian(1.5)
    rows = spim.integrate(system, z0, (0.0, 1.0), 0.1, outputs=[0])
    with pytest.raises(AttributeError, match="only outputs were stored"):
        rows.jacobian()
