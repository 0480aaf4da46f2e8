"""Claims about events, callbacks and states between grid points."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems import FREE, A, C, K, M, cases, cubic, every, force, gradient, step_of

import spim
from spim import models

CASES = list(cases())


def event(g, terminal=None, direction=None):
    """A function with SciPy's attributes."""

    def function(t, z):
        return g(t, z)

    if terminal is not None:
        function.terminal = terminal
    if direction is not None:
        function.direction = direction
    return function


def pendulum():
    return spim.HamiltonianSystem(1, lambda t, z: [np.sin(z[0]), z[1]])


def test_zeros_of_a_cosine_are_found_to_rounding():
    system = spim.LinearSystem([[0.0, 1.0], [-1.0, 0.0]])
    for backward in (False, True):
        span = (0.0, -30.0) if backward else (0.0, 30.0)
        run = spim.integrate(system, [1.0, 0.0], span, 0.1, events=lambda t, z: z[0])
        exact = (np.arange(10) + 0.5) * np.pi
        # 2 units in the last place of the time.
        assert np.abs(np.abs(run.t_events[0]) - exact).max() <= 2 * np.spacing(32.0)
        assert np.abs(run.y_events[0][:, 0]).max() <= 1e-14
        assert run.y_events[0].shape == (10, 2)
        assert (run.status, run.success) == (0, True)


@pytest.mark.parametrize("direction", [None, 0, 1, -1, 0.5])
@pytest.mark.parametrize("terminal", [None, False, True, 1, 3])
def test_they_are_those_of_scipy(direction, terminal):
    functions = [
        event(lambda t, z: z[1], terminal, direction),
        event(lambda t, z: z[0] - 1.0),
        event(lambda t, z: z[0] - 5.0),
    ]
    theirs = solve_ivp(
        lambda t, y: [y[1], -np.sin(y[0])],
        (0.0, 40.0),
        [2.0, 0.0],
        events=functions,
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    )
    ours = spim.integrate(
        pendulum(), [2.0, 0.0], (0.0, 40.0), 0.1, events=functions, method="gauss12"
    )
    assert (ours.status, ours.success) == (theirs.status, theirs.success)
    for t, want, z, states in zip(
        ours.t_events, theirs.t_events, ours.y_events, theirs.y_events, strict=True
    ):
        assert t.shape == want.shape
        assert z.shape == (len(t), 2)
        if len(t):
            assert np.abs(t - want).max() <= 1e-10
            assert np.abs(z - states).max() <= 1e-10
    if terminal and ours.status:
        assert ours.t[-1] == ours.t_events[0][-1]
        assert np.array_equal(ours.z[-1], ours.y_events[0][-1])
        assert "event 0 ended the run at t = " in ours.message


@pytest.mark.parametrize("case", CASES, ids=[f"{name}-{method}" for name, method, *_ in CASES])
def test_every_method_ends_at_an_event_between_its_steps(case):
    _, _, system, z0, h, given = case
    begin, end = 1.0, 1.0 + 40 * h
    # A component that crosses the middle of its range, amid a step.
    plain = spim.integrate(system, z0, (begin, end), h, **given)
    at = int(np.argmax(np.ptp(plain.z, axis=0)))
    level = plain.z[17:19, at].mean()
    run = spim.integrate(
        system,
        z0,
        (begin, end),
        h,
        events=event(lambda t, z: z[at] - level, terminal=True),
        **given,
    )
    assert run.status == 1
    k = len(run.t) - 1
    assert np.array_equal(run.z[:k], plain.z[:k])
    assert plain.t[k - 1] < run.t[k] <= plain.t[k]
    size = np.ptp(plain.z[:, at])
    assert abs(run.z[-1, at] - level) <= 1e-11 * max(size, abs(level))
    assert np.array_equal(run.last[: system.size], run.z[-1])
    # What a step of that length gives.
    assert np.abs(plain(run.t[-1]) - run.z[-1]).max() <= 1e-12 * np.abs(plain.z).max()
    # Whoever goes on from there does not find it again.
    rest = spim.integrate(
        system, None, (run.t[-1], run.t[-1] + h), resume=run, events=lambda t, z: z[at] - level
    )
    assert np.abs(rest.z[0] - run.z[-1]).max() <= 1e-15 * np.abs(run.z[-1]).max()
    assert not (np.abs(rest.t_events[0] - run.t[-1]) <= 1e-6 * h).any()


def test_refinement_is_by_steps_of_the_method_with_its_order():
    # Steps so large that interpolation between them would show.
    found = {}
    for h, method in ((0.05, "gauss16"), (1.0, "gauss8"), (0.5, "gauss8")):
        run = spim.integrate(
            pendulum(), [2.0, 0.0], (0.0, 10.0), h, method=method, events=lambda t, z: z[0]
        )
        found[h] = run.t_events[0]
    errors = [np.abs(found[h] - found[0.05]).max() for h in (1.0, 0.5)]
    assert np.log2(errors[0] / errors[1]) >= 7.0


def test_a_zero_on_the_grid_counts_once_and_one_at_the_start_as_scipy_has_it():
    still = spim.LinearSystem([[0.0, 1.0], [0.0, 0.0]])
    run = spim.integrate(still, [-1.0, 1.0], (0.0, 2.0), 0.25, events=lambda t, z: z[0])
    assert np.array_equal(run.t_events[0], [1.0])
    run = spim.integrate(still, [0.0, 1.0], (0.0, 2.0), 0.25, events=lambda t, z: z[0])
    assert np.array_equal(run.t_events[0], [0.0])
    fall = event(lambda t, z: z[0], True, -1)
    run = spim.integrate(still, [0.0, 1.0], (0.0, 2.0), 0.25, events=fall)
    assert (run.t_events[0].size, run.status) == (0, 0)
    first = spim.integrate(
        still, [-1.0, 1.0], (0.0, 2.0), 0.25, events=event(lambda t, z: z[0], True)
    )
    assert np.array_equal(first.t, [0.0, 0.25, 0.5, 0.75, 1.0])
    assert first.state.t == 1.0
    at_once = spim.integrate(
        still, [0.0, 1.0], (0.0, 2.0), 0.25, events=event(lambda t, z: z[0], True)
    )
    assert np.array_equal(at_once.t, [0.0])


def test_two_crossings_in_a_step_are_missed():
    system = spim.LinearSystem([[0.0, 1.0], [-1.0, 0.0]])
    run = spim.integrate(system, [1.0, 0.0], (0.0, 6.0), 6.0, events=lambda t, z: z[0])
    assert run.t_events[0].size == 0


def test_the_first_terminal_event_of_a_step_hides_what_comes_later():
    line = spim.LinearSystem([[0.0, 1.0], [0.0, 0.0]])
    events = [
        event(lambda t, z: z[0] - 0.75),
        event(lambda t, z: z[0] - 0.5, True),
        event(lambda t, z: z[0] - 0.25),
    ]
    run = spim.integrate(line, [0.0, 1.0], (0.0, 4.0), 1.0, events=events)
    assert [len(t) for t in run.t_events] == [0, 1, 1]
    assert run.t == pytest.approx([0.0, 0.5])


def test_a_bouncing_ball_takes_as_many_runs_as_it_bounces():
    ball = spim.SeparableSystem(lambda t, q: [-10.0], mass=[1.0])
    ground = event(lambda t, z: z[0], True, -1)
    z, t, times = [1.0, 0.0], 0.0, []
    for _ in range(5):
        with pytest.warns(UserWarning, match="no multiple") if t else np.errstate():
            run = spim.integrate(ball, z, (t, 10.0), 0.1, events=ground, method="verlet")
        t, z = run.t[-1], [run.z[-1, 0], -run.z[-1, 1]]
        times.append(t)
    period = 2.0 * np.sqrt(0.2)
    assert times == pytest.approx(np.sqrt(0.2) + period * np.arange(5), rel=1e-12)


def test_rows_that_are_stored_end_at_the_event_whatever_is_stored():
    stop = event(lambda t, z: z[1], 2)
    whole = spim.integrate(pendulum(), [2.0, 0.1], (0.0, 20.0), 0.1, events=stop)
    some = spim.integrate(pendulum(), [2.0, 0.1], (0.0, 20.0), 0.1, events=stop, every=9)
    assert np.array_equal(some.z[:-1], whole.z[:-1:9])
    assert np.array_equal(some.z[-1], whole.z[-1])
    assert some.t[-1] == whole.t[-1] == whole.t_events[0][1]
    picked = spim.integrate(pendulum(), [2.0, 0.1], (0.0, 20.0), 0.1, events=stop, outputs=[1])
    assert np.array_equal(picked.outputs[:, 0], whole.z[:, 1])
    given = [0.0, 1.01, 3.0, 19.0]
    times = spim.integrate(pendulum(), [2.0, 0.1], (0.0, 20.0), 0.1, events=stop, t_eval=given)
    assert np.array_equal(times.t, given[:3])
    assert np.array_equal(whole(times.t).T, times.z)


def test_energy_balance_ends_at_the_event_as_well():
    system = spim.StructuralSystem(M, K, damping=C, load=spim.loads.Harmonic([1.0, 0, 0], 2.0))
    stop = event(lambda t, z: z[0] + 0.05, True)
    run = spim.integrate(system, system.state(q=[0.1, 0, 0]), (0.0, 20.0), 0.05, events=stop)
    assert run.status == 1
    assert run.t[-1] % 0.05 > 1e-6
    assert np.abs(run.balance_error).max() <= 1e-13


@pytest.mark.parametrize("name", every())
def test_a_callback_sees_every_step_and_may_stop(name):
    system, z0 = every()[name]
    h = step_of(name)
    plain = spim.integrate(system, z0, (1.0, 1.0 + 20 * h), h)
    seen = []

    def note(t, z):
        seen.append((t, z.copy()))
        z[:] = np.nan  # a copy of its own
        return None if len(seen) < 13 else np.bool_(False)

    run = spim.integrate(system, z0, (1.0, 1.0 + 20 * h), h, every=5, callback=note)
    assert (run.status, run.success) == (1, True)
    assert run.message == f"the callback stopped the run at t = {run.t[-1]:g}"
    assert np.array_equal([t for t, _ in seen], plain.t[1:14])
    assert np.array_equal([z for _, z in seen], plain.z[1:14])
    assert np.array_equal(run.z, plain.z[[0, 5, 10, 13]])
    assert run.state.t == run.t[-1]


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("place", ["callback", "events"])
def test_exceptions_of_who_looks_on_pass_as_they_are(error, place):
    mine = error("mine")

    def fail(t, z):
        if t > 2.0:
            raise mine
        return 1.0

    with pytest.raises(error) as caught:
        spim.integrate(pendulum(), [2.0, 0.0], (0.0, 20.0), 0.1, **{place: fail})
    assert caught.value is mine
    assert caught.value.partial.status == -1
    assert len(caught.value.partial.t) == 22
    assert caught.value.partial.state.t == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"events": 3}, TypeError, "events: must be a function"),
        ({"events": [3]}, TypeError, r"events\[0\]: must be a function"),
        ({"events": lambda t, z: np.nan}, ValueError, r"events\[0\]: is nan at t = 0"),
        ({"events": lambda t, z: z}, TypeError, r"events\[0\]: must give a real number"),
        ({"events": lambda t, z: None}, TypeError, r"events\[0\]: must give a real number"),
        ({"events": event(len, terminal=-1)}, ValueError, r"terminal: must be True, False"),
        ({"events": event(len, terminal="yes")}, ValueError, r"terminal: must be True, False"),
        ({"events": event(len, direction="up")}, TypeError, "direction: must be a number"),
        ({"callback": 3}, TypeError, "callback: must be a function"),
    ],
)
def test_what_cannot_look_on_is_refused(given, error, words):
    with pytest.raises(error, match=words):
        spim.integrate(pendulum(), [2.0, 0.0], (0.0, 1.0), 0.1, **given)


FORMS = {
    "gauss6": (lambda: spim.HamiltonianSystem(1, gradient), [1.0, 0.3], 6),
    "yoshida4": (lambda: spim.SeparableSystem(force, mass=[1.0]), [1.0, 0.3], 4),
    "verlet": (lambda: models.HenonHeiles(), [0.1, 0.2, 0.3, 0.1], 2),
    "lawson_gauss4": (lambda: spim.SemilinearSystem(FREE, cubic), [1.0, -0.5, 0.3, 0.2], 4),
    "rk4": (lambda: models.Kepler(), [0.7, 0.0, 0.0, 1.3], 4),
    "gauss4": (lambda: models.Kepler(), [0.7, 0.0, 0.0, 1.3], 4),
}


@pytest.mark.parametrize("method", FORMS)
def test_states_off_the_grid_have_the_order_of_the_method(method):
    make, z0, order = FORMS[method]
    system = make()
    times = np.array([0.123, 0.777, 1.501, 2.9999, 3.96])
    fine = spim.integrate(system, z0, (0.0, 4.0), 0.01, method="gauss16").__call__(times)
    errors = []
    for h in (0.1, 0.05, 0.025):
        run = spim.integrate(system, z0, (0.0, 4.0), h, method=method)
        states = run(times)
        assert states.shape == (len(z0), 5)
        assert np.array_equal(states[:, 1], run(times[1]))
        errors.append(np.abs(states - fine).max())
        listed = spim.integrate(system, z0, (0.0, 4.0), h, method=method, t_eval=times)
        assert np.array_equal(listed.z.T, states)
        sparse = spim.integrate(system, z0, (0.0, 4.0), h, method=method, every=8)
        assert np.abs(sparse(times) - fine).max() <= 2.0 * errors[-1]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.abs(slopes - order).min() <= 0.35, slopes


def test_linear_states_off_the_grid_are_exact():
    run = spim.integrate(spim.LinearSystem(A), [1.0, 0.5, -0.2, 0.1], (0.0, 4.0), 0.5)
    for t in (0.123, 2.718, 3.99):
        want = spim.expm(t * A) @ [1.0, 0.5, -0.2, 0.1]
        assert np.abs(run(t) - want).max() <= 1e-14
