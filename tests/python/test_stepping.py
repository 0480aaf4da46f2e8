"""Ways of stepping a structure: energy coordinates, modes, outputs, the paper's forcing."""

import pickle

import mpmath as mp
import numpy as np
import pytest
from structures import beam, chain

import spim

LOADS = {
    "none": None,
    "closed": spim.loads.Harmonic(np.ones(4), 0.7) + spim.loads.Polynomial([np.arange(4.0)]),
    "held": spim.loads.Sampled(np.sin(np.arange(804.0)).reshape(201, 4), 0.1, hold="zero"),
    "called": spim.loads.Function(lambda t: np.cos(t) * np.ones(4), degree=5),
}


def structure(load=None, damping=0.02):
    M, K = chain(4)
    return spim.StructuralSystem(M, K, damping=damping * K, load=load)


@pytest.mark.parametrize("name", LOADS)
@pytest.mark.parametrize("options", [{"coordinates": "energy"}, {"method": "modal"}])
def test_other_coordinates_move_alike(name, options):
    system = structure(LOADS[name])
    z0 = system.state(q=[1.0, 0.0, -1.0, 0.5], v=[0.0, 0.3, 0.0, 0.0])
    plain = spim.integrate(system, z0, (0.0, 20.0), 0.1)
    other = spim.integrate(system, z0, (0.0, 20.0), 0.1, **options)
    assert np.abs(other.z - plain.z).max() <= 1e-13 * np.abs(plain.z).max()
    assert np.abs(other.last - other.z[-1]).max() == 0.0
    backward = spim.integrate(system, plain.z[-1], (20.0, 0.0), 0.1, **options)
    assert np.abs(backward.z[-1] - z0).max() <= 1e-12
    at = other(np.array([0.05, 3.33]))
    assert np.abs(at - plain(np.array([0.05, 3.33]))).max() <= 1e-13


def exact_energy(system, z):
    """In 60 digits, of the doubles of a state."""
    with mp.workdps(60):
        n = system.dof
        q, p = mp.matrix(z[:n].tolist()), mp.matrix(z[n:].tolist())
        v = mp.lu_solve(mp.matrix(system.mass.tolist()), p)
        return (p.T * v)[0] / 2 + (q.T * mp.matrix(system.stiffness.tolist()) * q)[0] / 2


def test_energy_of_a_fine_cantilever():
    """80 elements, fastest angle 314 a step, 2e4 steps."""
    M, K = beam(80)
    system = spim.StructuralSystem(M, K)
    L = np.linalg.cholesky(M)
    fastest = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(L, np.linalg.solve(L, K).T))[-1])
    z0 = system.state(q=np.linalg.solve(K, np.eye(len(M))[-2]))
    tau = 314.0 / fastest
    bounds = [({}, 1e-9), ({"coordinates": "energy"}, 1e-12), ({"correction": "exact"}, 1e-14)]
    for options, bound in bounds:
        run = spim.integrate(system, z0, (0.0, 20_000 * tau), tau, every=200, **options)
        assert np.abs(run.energy / run.energy[0] - 1.0).max() <= bound, options
    whole = exact_energy(system, run.z[-1])
    assert abs(float(run.energy[-1] / whole - 1)) <= 1e-13


def test_energy_coordinates_need_a_definite_stiffness():
    M, K = beam(2, free=True)
    free = spim.StructuralSystem(M, K)
    with pytest.raises(ValueError, match="positive definite stiffness; the pivot of degree"):
        spim.integrate(free, free.state(), (0.0, 1.0), 0.1, coordinates="energy")
    with pytest.raises(ValueError, match='"raw" or "energy"'):
        spim.integrate(free, free.state(), (0.0, 1.0), 0.1, coordinates="enregy")
    linear = spim.LinearSystem(free.A)
    with pytest.raises(spim.UnsupportedError, match="structure"):
        spim.integrate(linear, free.state(), (0.0, 1.0), 0.1, coordinates="energy")


def test_modal_needs_classical_damping_and_takes_rigid_modes():
    M, K = chain(3)
    C = np.diag([1.0, 0.0, 0.0])
    coupled = spim.StructuralSystem(M, K, damping=C)
    with pytest.raises(spim.UnsupportedError, match="couples modes"):
        spim.integrate(coupled, coupled.state(), (0.0, 1.0), 0.1, method="modal")
    linear = spim.LinearSystem(coupled.A)
    with pytest.raises(spim.UnsupportedError, match="modal"):
        spim.integrate(linear, coupled.state(), (0.0, 1.0), 0.1, method="modal")
    free = spim.StructuralSystem(np.eye(2), [[1.0, -1.0], [-1.0, 1.0]])
    run = spim.integrate(free, free.state(v=[1.0, 1.0]), (0.0, 10.0), 0.5, method="modal")
    assert np.abs(run.q[-1] - 10.0).max() <= 1e-12


def test_outputs_in_place_of_states():
    system = structure(LOADS["closed"])
    z0 = system.state(q=[1.0, 0.0, 0.0, 0.0])
    whole = spim.integrate(system, z0, (0.0, 20.0), 0.1)
    few = spim.integrate(system, z0, (0.0, 20.0), 0.1, outputs=[3, 0])
    assert (few.outputs == whole.z[:, [3, 0]]).all()
    assert (few.last == whole.z[-1]).all()
    mask = np.arange(8) == 3
    assert (
        spim.integrate(system, z0, (0.0, 20.0), 0.1, outputs=mask).outputs[:, 0] == whole.z[:, 3]
    ).all()
    matrix = np.random.default_rng(0).normal(size=(3, 8))
    for options in ({"every": 7}, {"coordinates": "energy"}, {"method": "rk4"}):
        whole = spim.integrate(system, z0, (0.0, 20.0), 0.1, **options)
        few = spim.integrate(system, z0, (0.0, 20.0), 0.1, outputs=matrix, **options)
        assert few.outputs == pytest.approx(whole.z @ matrix.T, abs=1e-12)
        assert (few.t == whole.t).all()
    some = spim.integrate(system, z0, (0.0, 20.0), 0.1, outputs=matrix, t_eval=[0.25, 19.0])
    assert some.outputs == pytest.approx(whole([0.25, 19.0]).T @ matrix.T, abs=1e-3)
    assert pickle.loads(pickle.dumps(few)).outputs.shape == few.outputs.shape
    for name in ("z", "q", "energy"):
        with pytest.raises(AttributeError, match="only outputs were stored"):
            getattr(few, name)
    with pytest.raises(AttributeError, match="none were asked for"):
        _ = whole.outputs
    assert "2 outputs" in repr(spim.integrate(system, z0, (0.0, 1.0), 0.1, outputs=[3, 0]))


@pytest.mark.parametrize(
    "bad", [[], [8], [-1], [0.5], np.ones((2, 7)), [np.nan], np.ones((1, 1, 8))]
)
def test_bad_outputs(bad):
    system = structure()
    with pytest.raises(ValueError, match="outputs"):
        spim.integrate(system, system.state(), (0.0, 1.0), 0.1, outputs=bad)


def test_the_papers_forcing_is_linear_over_a_step():
    held = spim.loads.Sampled(np.sin(np.arange(804.0)).reshape(201, 4), 0.1)
    exact = spim.integrate(structure(held), np.zeros(8), (0.0, 20.0), 0.1)
    paper = spim.integrate(structure(held), np.zeros(8), (0.0, 20.0), 0.1, forcing="inverse")
    assert np.abs(paper.z - exact.z).max() <= 1e-12 * np.abs(exact.z).max()
    assert "eq. 45" in paper.method
    wave = structure(spim.loads.Harmonic(np.ones(4), 0.7))
    errors = []
    for step in (0.2, 0.1):
        exact, paper = (
            spim.integrate(wave, np.zeros(8), (0.0, 20.0), step, forcing=forcing)
            for forcing in ("exact", "inverse")
        )
        errors.append(np.abs(paper.z - exact.z).max())
    assert 3.5 <= errors[0] / errors[1] <= 4.5


def test_the_papers_forcing_refuses_rigid_modes():
    load = spim.loads.Polynomial([[1.0, 0.0]])
    free = spim.StructuralSystem(np.eye(2), [[1.0, -1.0], [-1.0, 1.0]], load=load)
    with pytest.raises(spim.SingularMatrixError, match="singular to rounding"):
        spim.integrate(free, free.state(), (0.0, 1.0), 0.1, forcing="inverse")


def test_two_terms_move_as_the_propagator_does():
    for M, K in (chain(20), beam(6), beam(3, free=True)):
        system = spim.StructuralSystem(M, K)
        z0 = np.random.default_rng(0).normal(size=system.size)
        plain = spim.integrate(system, z0, (0.0, 50.0), 0.1)
        two = spim.integrate(system, z0, (0.0, 50.0), 0.1, method="two_term")
        scale = np.abs(plain.z).max(axis=0)
        assert (np.abs(two.z - plain.z).max(axis=0) <= 1e-8 * scale).all()
        short = spim.integrate(system, z0, (0.0, 0.3), 0.1, method="two_term")
        assert (short.z == two.z[:4]).all()
    damped = structure()
    with pytest.raises(spim.UnsupportedError, match="separable"):
        spim.integrate(damped, damped.state(), (0.0, 1.0), 0.1, method="two_term")


def test_a_map_beyond_doubles_ends_the_run():
    system = spim.StructuralSystem([[1.0]], [[1.0]])
    z0 = system.state(q=[1e200])
    run = spim.integrate(system, z0, (0.0, 9.0), 0.5, outputs=[[1e108, 1e110]], throw=False)
    assert isinstance(run.error, spim.ModelError)
    assert np.isfinite(run.outputs).all()
    assert len(run.t) == len(run.outputs) < 19
