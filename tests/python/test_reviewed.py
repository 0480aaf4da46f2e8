"""Claims that a reader has once shown to be false."""

import pickle

import numpy as np
import pytest
import scipy.linalg
from structures import beam

import spim
from spim import loads as L


def oscillator(load=None, damping=0.3):
    return spim.StructuralSystem([[1.0]], [[100.0]], [[damping]], load=load)


@pytest.mark.parametrize("elements", [50, 200])
def test_soft_modes_are_found_beside_stiff_ones(elements):
    M, K = beam(elements)
    found = spim.StructuralSystem(M, K).modal(3).frequencies
    assert np.abs(found / [3.51601527, 22.03449156, 61.69721441] - 1.0).max() <= 1e-6


def test_rigid_modes_stay_rigid_beside_soft_ones():
    K = scipy.linalg.block_diag(1e15, 1.0, [[4.0, -4.0], [-4.0, 4.0]])
    modes = spim.StructuralSystem(np.eye(4), K).modal()
    assert modes.frequencies[0] == 0.0
    assert np.abs(modes.frequencies[1:3] - [1.0, np.sqrt(8.0)]).max() <= 1e-14


def test_modal_runs_keep_soft_modes():
    system = spim.StructuralSystem(np.eye(2), np.diag([1.0, 1e15]), np.diag([0.1, 0.0]))
    z0 = system.state(q=[1.0, 0.0])
    auto, modal = (
        spim.integrate(system, z0, (0.0, 6.0), 0.1, method=m).q[-1, 0] for m in ("auto", "modal")
    )
    assert abs(auto - modal) <= 1e-12


def test_balance_counts_from_the_start_whatever_is_stored():
    run = spim.integrate(oscillator(), [1.0, 0.0], (0.0, 2.0), 0.1, t_eval=[1.0, 2.0])
    assert np.abs(run.balance_error).max() <= 1e-12 * 50.0


def test_a_short_piece_does_not_move_the_others():
    t, v = 0.05 * np.arange(2001), np.arange(2001.0)
    once = L.Sampled(v, times=t, hold="zero")
    more = np.insert(t, 41, t[40] + 1e-6)
    twice = L.Sampled(np.insert(v, 41, v[40]), times=more, hold="zero")
    asked = 0.15 * np.arange(1, 600)
    assert (once(asked) == twice(asked)).all()


def test_functions_of_a_run_are_not_asked_ahead():
    force = [0.0]
    load = L.Function(lambda t: [force[0]], degree=0)
    run = spim.Run(spim.StructuralSystem([[1.0]], [[0.0]], load=load), [0.0, 0.0], step=0.01)
    run.step()
    force[0] = 1.0
    for _ in range(100):
        run.step()
    assert abs(run.state[1] - 1.0) <= 1e-12


def test_products_keep_the_degree_of_their_functions_and_can_be_pickled():
    load = L.Function(np.sin, degree=7) * L.Polynomial([1.0, 2.0])
    assert load._degree() == 7
    again = pickle.loads(pickle.dumps(load))
    assert again(0.3) == load(0.3)


@pytest.mark.parametrize("start", [100.0, 1e5])
def test_phases_far_from_zero_are_right_to_rounding(start):
    """The phase by hand in long doubles, against the run's start phase."""
    w = 12.3456
    here = oscillator(L.Harmonic([1.0], w))
    turn = 2 * np.longdouble("3.14159265358979323846264338327950288")
    phase = np.fmod(np.longdouble(w) * np.longdouble(start), turn)
    turned = oscillator(L.Harmonic([1.0], w, float(phase)))
    if np.finfo(np.longdouble).eps > 1e-18:
        pytest.skip("long doubles are doubles here")
    far = spim.integrate(here, [0.0, 0.0], (start, start + 8.0), 0.125, correction="exact")
    near = spim.integrate(turned, [0.0, 0.0], (0.0, 8.0), 0.125, correction="exact")
    off = np.abs(far.q - near.q).max() / np.abs(near.q).max()
    # What long doubles lose of the phase.
    assert off <= max(1e-14, 1e-19 * w * start)
    assert np.abs(far.balance_error).max() <= 1e-13 * far.energy.max()


@pytest.mark.parametrize("start", [1e6, 1.7e9])
def test_records_with_clock_times_on_the_grid_of_the_run(start):
    record = np.random.default_rng(0).normal(size=401)
    runs = [
        spim.integrate(
            oscillator(L.Sampled(record, 0.01, start=t)), [0.0, 0.0], (t, t + 4.0), 0.01
        ).q
        for t in (0.0, start)
    ]
    assert np.abs(runs[0] - runs[1]).max() <= 1e-12 * np.abs(runs[0]).max()


def test_matrices_of_a_system_cannot_be_exchanged():
    with pytest.raises(AttributeError):
        oscillator().stiffness = np.eye(1)


def test_a_function_that_fails_late_leaves_the_steps_before():
    def force(t):
        if t > 0.5:
            raise ZeroDivisionError("no more")
        return [1.0]

    system = oscillator(L.Function(force, degree=1))
    run = spim.integrate(system, [0.0, 0.0], (0.0, 1.0), 0.1, throw=False)
    assert isinstance(run.error, ZeroDivisionError)
    assert len(run.t) == 6
    with pytest.raises(ZeroDivisionError, match="no more") as caught:
        spim.integrate(system, [0.0, 0.0], (0.0, 1.0), 0.1)
    assert (caught.value.partial.z == run.z).all()


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: L.Gravity([1.0]) * L.Harmonic([1.0], 2.0), ValueError, "ground motion or grav"),
        (lambda: L.GroundMotion(L.Gravity([1.0]), [1.0]), TypeError, "record: must be an accel"),
        (lambda: L.Sampled([], 0.1), ValueError, "two samples or more"),
        (lambda: L.Sampled([1.0, 2.0], 1e-20, start=1.0), ValueError, "step: .* lost"),
        (lambda: L.Sampled([1.0, 2.0], times=[0.0, 1.0], start=5.0), TypeError, "start"),
        (lambda: L.Unbalance(1.0, 1.0, (0.7, 1.9)), TypeError, "dofs"),
        (lambda: spim.damping.rayleigh(np.eye(2), np.eye(2), alpha=np.nan), ValueError, "alpha"),
        (lambda: spim.damping.rayleigh(np.eye(2), np.eye(3), alpha=1.0), ValueError, "stiffness"),
        (lambda: spim.damping.modal(np.eye(2), -np.eye(2), 0.1), ValueError, "negative mode"),
        (
            lambda: spim.ensemble(oscillator(), np.zeros((2, 2)), (0.0, 1.0), 0.1, every=0),
            ValueError,
            "every",
        ),
        (
            lambda: spim.integrate(
                oscillator(), [0.0, 0.0], (0.0, 1.0), 0.1, outputs=[[1.0, 2.0], [3.0]]
            ),
            ValueError,
            "outputs",
        ),
        (lambda: oscillator().velocity([1j, 0.0]), TypeError, "z: needs real"),
        (
            lambda: spim.StructuralSystem(np.eye(1), np.eye(1)).frequency_response(
                [np.nextafter(1.0, 2.0)]
            ),
            np.linalg.LinAlgError,
            "resonance",
        ),
    ],
)
def test_messages_name_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_loads_add_up_and_divide():
    total = sum([L.Harmonic([1.0], 2.0), L.Polynomial([1.0])]) / 2.0
    assert total(0.0) == [1.0]
    assert (np.float64(3.0) * total)(0.0) == [3.0]
