"""Claims about systems given as Python functions."""

import pickle

import numpy as np
import pytest

import spim

N = 3
K = 2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)


def pendulum(**changes):
    given = {"hamiltonian": lambda t, z: 0.5 * z[1] ** 2 - np.cos(z[0])}
    return spim.HamiltonianSystem(1, lambda t, z: [np.sin(z[0]), z[1]], **(given | changes))


def chain_force(t, q):
    """Cubic springs; of a module, so that it can be pickled."""
    return -(K @ q) - 0.1 * q**3


def chain_potential(t, q):
    return 0.5 * q @ K @ q + 0.025 * np.sum(q**4)


def chain(**changes):
    given = {"mass": [1.0, 2.0, 1.5], "potential": chain_potential}
    return spim.SeparableSystem(chain_force, **(given | changes))


Z0 = np.array([1.0, -0.5, 0.3, 0.2, 0.0, -0.4])


def test_all_three_ways_of_giving_a_system_are_one_motion():
    inverse = np.diag(1.0 / np.array([1.0, 2.0, 1.5]))
    A = np.block([[np.zeros((N, N)), inverse], [-K, np.zeros((N, N))]])
    forms = {
        "gauss16": spim.HamiltonianSystem(
            N,
            lambda t, z: np.concatenate([-chain_force(t, z[:N]), inverse @ z[N:]]),
            hamiltonian=lambda t, z: 0.5 * z[N:] @ inverse @ z[N:] + chain_potential(t, z[:N]),
        ),
        "yoshida8": chain(),
        "lawson_gauss8": spim.SemilinearSystem(
            A,
            lambda t, z: np.concatenate([np.zeros(N), -0.1 * z[:N] ** 3]),
            potential=lambda t, z: 0.025 * np.sum(z[:N] ** 4),
        ),
    }
    runs = {
        method: spim.integrate(system, Z0, (0.0, 5.0), 0.05, method=method)
        for method, system in forms.items()
    }
    wanted = runs["gauss16"]
    for run in runs.values():
        assert np.abs(run.z[-1] - wanted.z[-1]).max() <= 1e-10
        assert np.abs(run.energy / wanted.energy[0] - 1.0).max() <= 1e-9
    velocity = spim.SeparableSystem(chain_force, velocity=lambda p: inverse @ p, dof=N)
    again = spim.integrate(velocity, Z0, (0.0, 5.0), 0.05, method="yoshida8")
    assert np.abs(again.z - runs["yoshida8"].z).max() <= 1e-13
    with pytest.raises(spim.UnsupportedError, match="no energy"):
        _ = again.energy


@pytest.mark.parametrize(("method", "order"), [("verlet", 2), ("yoshida4", 4), ("yoshida6", 6)])
def test_compositions_have_their_orders_on_a_nonlinear_system(method, order):
    exact = spim.integrate(chain(), Z0, (0.0, 4.0), 0.01, method="yoshida8").z[-1]
    errors = [
        np.abs(spim.integrate(chain(), Z0, (0.0, 4.0), h, method=method).z[-1] - exact).max()
        for h in (0.1, 0.05)
    ]
    assert abs(np.log2(errors[0] / errors[1]) - order) <= 0.15


def test_functions_may_write_their_result_and_depend_on_time():
    def force(t, q, out):
        out[:] = -q + np.cos(2.0 * t)

    system = spim.SeparableSystem(force, mass=[1.0])
    run = spim.integrate(system, [0.0, 0.0], (0.0, 3.0), 0.05, method="yoshida8")
    # q'' + q = cos 2t
    assert np.abs(run.q[:, 0] - (np.cos(run.t) - np.cos(2.0 * run.t)) / 3.0).max() <= 1e-9


def test_events_of_a_run_are_those_of_the_caller():
    calls = [0]

    def gradient(t, z):
        calls[0] += 1
        if calls[0] == 100:
            raise ZeroDivisionError("mine")
        return [np.sin(z[0]), z[1]]

    system = spim.HamiltonianSystem(1, gradient)
    with pytest.raises(ZeroDivisionError, match="mine") as caught:
        spim.integrate(system, [1.0, 0.0], (0.0, 100.0), 0.1, method="rk4")
    assert len(caught.value.partial.t) == 25
    stopped = spim.HamiltonianSystem(1, lambda t, z: exec("raise SystemExit(3)"))
    with pytest.raises(SystemExit):
        spim.integrate(stopped, [1.0, 0.0], (0.0, 1.0), 0.1)


@pytest.mark.parametrize(
    ("result", "error", "words"),
    [
        ([1.0], ValueError, "gradient: must give 2 numbers"),
        ([np.nan, 1.0], spim.ModelError, "gradient: component 0 is nan at t = 0"),
        (["a", "b"], TypeError, "gradient: needs an array of numbers"),
        (None, TypeError, "gradient"),
        ([1j, 0.0], TypeError, "gradient"),
    ],
)
def test_wrong_answers_are_refused(result, error, words):
    system = spim.HamiltonianSystem(1, lambda t, z: result)
    with pytest.raises(error, match=words):
        spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, method="rk4")


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: spim.HamiltonianSystem(0, lambda t, z: z), ValueError, "dof"),
        (lambda: spim.HamiltonianSystem(1, 3), TypeError, "gradient"),
        (lambda: spim.SeparableSystem(chain_force), TypeError, "mass= or velocity="),
        (lambda: spim.SeparableSystem(chain_force, mass=[-1.0]), ValueError, "mass"),
        (lambda: spim.SeparableSystem(chain_force, velocity=len), ValueError, "dof"),
        (
            lambda: spim.SemilinearSystem([[1.0]], lambda t, z: z, potential=lambda t, z: 0.0),
            ValueError,
            "potential",
        ),
        (
            lambda: spim.integrate(pendulum(), [1.0, 0.0], (0.0, 1.0), 0.1, method="verlet"),
            spim.UnsupportedError,
            "separable",
        ),
        (
            lambda: spim.integrate(pendulum(), [1.0, 0.0, 0.0], (0.0, 1.0), 0.1),
            ValueError,
            "z0: must have shape",
        ),
    ],
)
def test_bad_systems_are_refused_by_name(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_systems_of_functions_of_a_module_can_be_pickled():
    system = chain()
    run = spim.integrate(system, Z0, (0.0, 1.0), 0.1)
    again = pickle.loads(pickle.dumps(system))
    assert (spim.integrate(again, Z0, (0.0, 1.0), 0.1).z == run.z).all()


def test_energy_stays_over_many_steps():
    run = spim.integrate(pendulum(), [2.0, 0.0], (0.0, 1000.0), 0.2, method="gauss8")
    error = run.energy / run.energy[0] - 1.0
    halves = [half.mean() for half in np.array_split(error, 2)]
    assert np.abs(error).max() <= 1e-6
    assert abs(halves[0] - halves[1]) <= 1e-9
