"""Claims about runs that are stepped one call at a time."""

import pickle

import numpy as np
import pytest
from systems import LOADS, every, step_of
from systems import force as spring

import spim

M, K = np.diag([2.0, 1.0, 0.5]), 100.0 * np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
C = spim.damping.rayleigh(M, K, alpha=0.1, beta=0.001)
RECORD = np.random.default_rng(0).normal(size=(600, 3))


@pytest.mark.parametrize(
    "load",
    [
        None,
        spim.loads.Harmonic([1.0, 0.0, 2.0], 3.0, 0.5)
        + spim.loads.Polynomial([[0.0] * 3, [0.1] * 3]),
        spim.loads.Sampled(RECORD, 0.02),
        spim.loads.Sampled(RECORD, 0.013, hold="zero")
        + spim.loads.Exponential([1.0, 1.0, 0.0], -1.0),
        spim.loads.Function(lambda t: [np.sin(t * t), 0.0, 1.0]),
    ],
)
def test_a_run_equals_integrate_to_rounding(load):
    system = spim.StructuralSystem(M, K, damping=C, load=load)
    z0 = system.state(q=[0.1, 0.0, -0.1], v=[0.0, 1.0, 0.0])
    whole = spim.integrate(system, z0, (1.0, 7.0), 0.02)
    run = spim.Run(system, z0, step=0.02, t0=1.0)
    for k in range(1, 301):
        state = run.step()
        assert np.abs(state - whole.z[k]).max() <= 1e-13 * np.abs(whole.z).max(), k
    assert run.t == pytest.approx(7.0)
    assert np.array_equal(run.state, state)


def test_a_force_is_held_over_its_step():
    system = spim.StructuralSystem(M, K, damping=C)
    loaded = spim.StructuralSystem(M, K, damping=C, load=spim.loads.Sampled(RECORD, 0.02, "zero"))
    run = spim.Run(system, system.state(), step=0.02)
    whole = spim.integrate(loaded, loaded.state(), (0.0, 10.0), 0.02)
    for k, force in enumerate(RECORD[:500]):
        state = run.step(force)
        assert np.abs(state - whole.z[k + 1]).max() <= 1e-13 * np.abs(whole.z).max()


def test_steps_can_be_redone_from_a_checkpoint():
    load = spim.loads.Sampled(RECORD, 0.02)
    system = spim.StructuralSystem(M, K, load=load)
    run = spim.Run(system, system.state(q=[1.0, 0.0, 0.0]), step=0.02)
    for _ in range(300):
        run.step()
    saved = run.checkpoint()
    first = [run.step([1.0, 2.0, 3.0]) for _ in range(20)]
    run.restore(saved)
    assert run.t == pytest.approx(6.0)
    again = [run.step([1.0, 2.0, 3.0]) for _ in range(20)]
    assert np.array_equal(first, again)


def test_a_refused_force_leaves_the_run_as_it_was():
    system = spim.StructuralSystem(M, K)
    run = spim.Run(system, system.state(q=[1.0, 0.0, 0.0]), step=0.02)
    before, t = run.state, run.t
    for force, error, words in (
        ([1.0], ValueError, r"force: must have shape \(3,\)"),
        ([1.0, np.nan, 0.0], ValueError, r"force: entry \(1\) is nan"),
        (["a", "b", "c"], TypeError, "force: needs"),
    ):
        with pytest.raises(error, match=words):
            run.step(force)
        assert np.array_equal(run.state, before)
        assert run.t == t


def test_growth_beyond_doubles_is_an_error():
    run = spim.Run(spim.LinearSystem([[500.0]]), [1.0], step=1.0)
    run.step()
    with pytest.raises(OverflowError, match="state overflows"):
        run.step()
    assert np.isfinite(run.state).all()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"system": None, "z0": [1.0], "step": 1.0, "pade": 2}, TypeError, "give method= as well"),
        ({"system": 3, "z0": [1.0], "step": 1.0}, TypeError, "system"),
        ({"system": None, "z0": [1.0, 2.0], "step": 1.0}, ValueError, "z0: must have shape"),
        ({"system": None, "z0": [1.0], "step": 0.0}, ValueError, "step: must be positive"),
        ({"system": None, "z0": [1.0], "step": "1"}, TypeError, "step: must be a number"),
        ({"system": None, "z0": [1.0], "step": 1.0, "t0": np.inf}, ValueError, "t0"),
    ],
)
def test_bad_runs_say_what_is_wrong(arguments, error, words):
    if arguments["system"] is None:
        arguments = {**arguments, "system": spim.LinearSystem([[-1.0]])}
    with pytest.raises(error, match=words):
        spim.Run(arguments.pop("system"), arguments.pop("z0"), **arguments)


def test_a_copy_goes_on_from_where_its_run_is():
    system = spim.StructuralSystem(np.eye(2), [[2.0, -1.0], [-1.0, 1.0]])
    run = spim.Run(system, system.state(q=[1.0, 0.0]), step=0.1, t0=2.0)
    for _ in range(5):
        run.step()
    other = pickle.loads(pickle.dumps(run))
    assert other.t == run.t
    assert (other.step(force=[1.0, 0.0]) == run.step(force=[1.0, 0.0])).all()


FREE = [name for name, (system, _) in every().items() if system.load is None]


@pytest.mark.parametrize("name", FREE)
def test_runs_by_a_method_are_integrate_to_the_last_bit(name):
    system, z0 = every()[name]
    h = step_of(name)
    for method in ("auto", "gauss6", "rk4"):
        whole = spim.integrate(system, z0, (1.0, 1.0 + 80 * h), h, method=method)
        run = spim.Run(system, z0, step=h, t0=1.0, method=method)
        states = [run.step() for _ in range(40)]
        saved, other = run.checkpoint(), pickle.dumps(run) if name == "kepler" else None
        states += [run.step() for _ in range(40)]
        assert np.array_equal(states, whole.z[1:]), method
        assert np.array_equal(run.state, states[-1])
        assert run.t == pytest.approx(1.0 + 80 * h)
        run.restore(saved)
        assert run.t == pytest.approx(1.0 + 40 * h)
        assert np.array_equal([run.step() for _ in range(40)], states[40:])
        if other is not None:
            again = pickle.loads(other)
            assert np.array_equal([again.step() for _ in range(40)], states[40:])


def test_a_state_that_is_set_is_a_new_start_of_a_method():
    system = spim.SeparableSystem(spring, mass=[1.0])
    run = spim.Run(system, [1.0, 0.0], step=0.1)
    for _ in range(10):
        run.step()
    run.state = [0.5, -0.5]
    whole = spim.integrate(system, [0.5, -0.5], (1.0, 2.0), 0.1)
    assert np.abs(np.array([run.step() for _ in range(10)]) - whole.z[1:]).max() <= 1e-15


def test_what_runs_by_a_method_do_not_take():
    system = spim.SeparableSystem(spring, mass=[1.0])
    run = spim.Run(system, [1.0, 0.0], step=0.1, method="verlet")
    with pytest.raises(spim.UnsupportedError, match="force: acts on linear systems"):
        run.step([1.0])
    with pytest.raises(TypeError, match="of a run without a method"):
        run.restore((3, [1.0, 0.0]))
    with pytest.raises(spim.UnsupportedError, match="separable"):
        spim.Run(spim.HamiltonianSystem(1, spring), [1.0, 0.0], step=0.1, method="verlet")
    loaded = spim.StructuralSystem(M, K, load=LOADS["harmonic"])
    with pytest.raises(spim.UnsupportedError, match="under a load is stepped exactly"):
        spim.Run(loaded, loaded.state(), step=0.1, method="newmark")


def test_a_step_that_fails_can_be_taken_again():
    fails = [True]

    def sometimes(t, q):
        if t > 0.45 and fails:
            fails.clear()
            raise ZeroDivisionError("mine")
        return spring(t, q)

    run = spim.Run(spim.SeparableSystem(sometimes, mass=[1.0]), [1.0, 0.0], step=0.1)
    states = [run.step() for _ in range(4)]
    with pytest.raises(ZeroDivisionError, match="mine"):
        run.step()
    assert run.t == pytest.approx(0.4)
    states += [run.step() for _ in range(6)]
    whole = spim.integrate(spim.SeparableSystem(spring, mass=[1.0]), [1.0, 0.0], (0.0, 1.0), 0.1)
    assert np.array_equal(states, whole.z[1:])
