"""Claims about checkpoints and runs that go on from them."""

import pickle

import numpy as np
import pytest
from systems import LOADS, A, C, K, M, cases, force, gradient

import spim

CASES = list(cases())
NAMES = [f"{name}-{method}" for name, method, *_ in CASES]


def test_every_method_of_the_records_is_tried():
    assert {method for _, method, *_ in CASES} == {method.name for method in spim.methods()}


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_a_resumed_run_is_the_uninterrupted_one_to_the_last_bit(case):
    _, _, system, z0, h, given = case
    steps = 100
    t = [1.0 + k * h for k in range(steps + 1)]
    whole = spim.integrate(system, z0, (1.0, t[steps]), h, **given)
    for stop in (1, 67):
        first = spim.integrate(system, z0, (1.0, t[stop]), h, **given)
        state = pickle.loads(pickle.dumps(first.state))
        rest = spim.integrate(system, None, (t[stop], t[steps]), h, resume=state, **given)
        assert np.array_equal(rest.z, whole.z[stop:]), stop
        assert np.array_equal(rest.last, whole.last)
        assert rest.t[-1] == t[steps]
        # Again, where the second run has ended amid a block; without naming anything.
        second = spim.integrate(system, None, (t[stop], t[stop + 5]), resume=state)
        third = spim.integrate(system, None, (t[stop + 5], t[steps]), resume=second)
        assert np.array_equal(third.z, whole.z[stop + 5 :]), stop
        assert third.t == pytest.approx(whole.t[stop + 5 :], rel=1e-14)


@pytest.mark.parametrize("options", [{}, {"correction": "exact"}, {"forcing": "inverse"}])
@pytest.mark.parametrize("load", ["function", "uneven"])
def test_no_block_remembers_the_end_of_the_run_it_was_made_in(load, options):
    system = spim.StructuralSystem(M, K, damping=C, load=LOADS[load])
    if load == "uneven":
        system = system.with_load(spim.loads.Sampled(np.ones((500, 3)), 0.13, hold="zero"))
    z0, steps = system.state(q=[0.1, 0.0, 0.0]), 700
    whole = spim.integrate(system, z0, (0.0, steps * 0.05), 0.05, **options)
    for stops in ((255, 256, 257, 300), (511, 520, 690, 699)):
        run = spim.integrate(system, z0, (0.0, stops[0] * 0.05), 0.05, **options)
        for now, then in zip(stops, (*stops[1:], steps), strict=True):
            run = spim.integrate(system, None, (now * 0.05, then * 0.05), resume=run)
            assert np.array_equal(run.z, whole.z[now : then + 1]), (now, then)


def test_energy_coordinates_are_carried_as_they_are():
    system = spim.StructuralSystem(M, K)
    z0 = system.state(q=[0.1, 0.0, 0.0])
    for correction in ("polish", "exact"):
        options = {"coordinates": "energy", "correction": correction}
        whole = spim.integrate(system, z0, (0.0, 5.0), 0.05, **options)
        first = spim.integrate(system, z0, (0.0, 2.0), 0.05, **options)
        rest = spim.integrate(system, None, (2.0, 5.0), resume=first)
        assert np.array_equal(rest.z, whole.z[40:])


@pytest.mark.parametrize("every", [1, 7])
def test_what_is_stored_begins_where_the_run_does(every):
    system = spim.HamiltonianSystem(1, gradient)
    whole = spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.1)
    first = spim.integrate(system, [1.0, 0.0], (0.0, 4.0), 0.1, every=every)
    rest = spim.integrate(system, None, (4.0, 10.0), 0.1, resume=first, every=every)
    assert np.array_equal(rest.z[:-1], whole.z[40:-1:every])
    assert np.array_equal(rest.z[-1], whole.z[-1])
    assert rest.stats["steps"] == 60
    some = spim.integrate(system, None, (4.0, 10.0), resume=first, t_eval=[4.0, 5.0, 7.25])
    assert np.array_equal(some.z[:2], whole.z[[40, 50]])
    assert np.array_equal(some.z[2], whole(7.25))


def chain(n):
    return 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


GROUND = spim.loads.Sampled(np.sin(np.arange(300.0)), 0.05)


@pytest.mark.parametrize("load", [None, spim.loads.GroundMotion(GROUND, np.ones(80))])
def test_runs_of_outputs_alone_go_on_with_these(load):
    system = spim.StructuralSystem(np.eye(80), chain(80), load=load)
    z0 = system.state(v=np.ones(80))
    whole = spim.integrate(system, z0, (0.0, 10.0), 0.05, outputs=[2])
    assert "outputs alone" in whole.method
    first = spim.integrate(system, z0, (0.0, 4.35), 0.05, outputs=[2])
    rest = spim.integrate(system, None, (4.35, 10.0), outputs=[2], resume=first)
    assert np.array_equal(rest.outputs, whole.outputs[87:])
    with pytest.raises(ValueError, match="outputs alone; give the same outputs"):
        spim.integrate(system, None, (4.35, 10.0), resume=first)


def test_runs_that_failed_or_were_stopped_go_on_too():
    calls = [0]

    def sometimes(t, z):
        calls[0] += 1
        if calls[0] == 700:
            raise ZeroDivisionError("mine")
        return gradient(t, z)

    system = spim.HamiltonianSystem(1, gradient)
    whole = spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.1, method="gauss6")
    with pytest.raises(ZeroDivisionError) as caught:
        spim.integrate(
            spim.HamiltonianSystem(1, sometimes), [1.0, 0.0], (0.0, 10.0), 0.1, method="gauss6"
        )
    partial = caught.value.partial
    assert 1 < len(partial.t) < 100
    t = partial.state.t
    rest = spim.integrate(system, None, (t, 10.0), resume=partial)
    assert np.array_equal(rest.z, whole.z[len(partial.t) - 1 :])

    linear = spim.LinearSystem(A)
    whole = spim.integrate(linear, [1.0, 0, 0, 0], (0.0, 10.0), 0.1)
    stopped = spim.integrate(
        linear, [1.0, 0, 0, 0], (0.0, 10.0), 0.1, callback=lambda t, z: t < 3.65
    )
    assert np.array_equal(stopped.z, whole.z[:38])
    rest = spim.integrate(linear, None, (stopped.t[-1], 10.0), resume=stopped)
    assert np.array_equal(rest.z, whole.z[37:])


def test_backward_runs_go_on_backward():
    system = spim.SeparableSystem(force, mass=[1.0])
    whole = spim.integrate(system, [1.0, 0.0], (2.0, -2.0), 0.1)
    first = spim.integrate(system, [1.0, 0.0], (2.0, 0.5), 0.1)
    rest = spim.integrate(system, None, (0.5, -2.0), 0.1, resume=first)
    assert np.array_equal(rest.z, whole.z[15:])


def test_a_run_that_has_not_moved_is_a_start():
    system = spim.SeparableSystem(force, mass=[1.0])
    none = spim.integrate(system, [1.0, 0.0], (0.0, 0.0), 0.1)
    whole = spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1)
    rest = spim.integrate(system, None, (0.0, 1.0), 0.1, resume=none)
    assert np.array_equal(rest.z, whole.z)


def test_others_than_the_run_can_go_on_are_refused():
    system = spim.HamiltonianSystem(1, gradient)
    state = spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, method="gauss6").state
    for change, error, words in (
        ({"method": "gauss8"}, ValueError, "method 'gauss6', not 'gauss8'"),
        ({"step": 0.05}, ValueError, "steps of 0.1, not 0.05"),
        ({"roundoff": "tolerance"}, ValueError, "options"),
        ({"t_span": (2.0, 3.0)}, ValueError, "must begin where the state is, at 1"),
        ({"t_span": (1.0, 2.05)}, ValueError, "2.1 is the next end"),
        ({"t_span": (1.0, 0.0)}, ValueError, "its end cannot be 0"),
        ({"z0": [1.0, 0.0]}, ValueError, "z0: must be None with resume="),
        ({"system": spim.HamiltonianSystem(2, gradient)}, ValueError, "size 2, not 4"),
        ({"system": spim.LinearSystem(A)}, ValueError, "HamiltonianSystem, not LinearSystem"),
        ({"resume": 3}, TypeError, "resume: must be a solution or its state"),
    ):
        given = {"system": system, "z0": None, "t_span": (1.0, 2.0), "step": 0.1, "resume": state}
        given |= change
        with pytest.raises(error, match=words):
            spim.integrate(**given)
    linear = spim.integrate(spim.LinearSystem(A), [1.0, 0, 0, 0], (0.0, 1.0), 0.1)
    with pytest.raises(ValueError, match="a system of other parameters"):
        spim.integrate(spim.LinearSystem(-A), None, (1.0, 2.0), resume=linear)
    for given, words in (({}, "z0: is needed"), ({"z0": [1.0, 0.0]}, "step: is needed")):
        with pytest.raises(TypeError, match=words):
            spim.integrate(system, **({"z0": None} | given), t_span=(0.0, 1.0))


def test_a_checkpoint_is_small_and_says_where_it_is():
    system = spim.HamiltonianSystem(1, gradient)
    state = spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, method="gauss6").state
    assert repr(state) == "Checkpoint(t = 1, 2 components, gauss6, step 0.1)"
    assert len(pickle.dumps(state)) <= 2000
    structure = spim.StructuralSystem(M, K, damping=C)
    cases = spim.ensemble(structure, np.ones((3, 6)), (0.0, 1.0), 0.1)
    with pytest.raises(spim.UnsupportedError, match="side by side"):
        _ = cases[0].state
