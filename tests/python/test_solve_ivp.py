"""Claims about the classes for `scipy.integrate.solve_ivp`."""

import ctypes
import subprocess
import sys

import numpy as np
import pytest
from scipy import LowLevelCallable
from scipy.integrate import solve_ivp

import spim

GAUSS = {"Gauss2": 2, "Gauss4": 4, "Gauss6": 6, "Gauss8": 8, "Gauss16": 16}
SPLIT = {"Verlet": 2, "Yoshida4": 4, "Yoshida6": 6, "Yoshida8": 8}
ORDERS = GAUSS | SPLIT


def pendulum(t, y):
    return [y[1], -np.sin(y[0])]


def reference(span, **options):
    return solve_ivp(pendulum, span, [2.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13, **options)


def solve(name, span=(0.0, 10.0), step=0.1, fun=pendulum, y0=(2.0, 0.0), **options):
    return solve_ivp(fun, span, y0, method=getattr(spim, name), step=step, **options)


@pytest.mark.parametrize("name", ORDERS)
def test_they_are_the_methods_of_integrate(name):
    if name in SPLIT:
        system = spim.SeparableSystem(lambda t, q: -np.sin(q), velocity=lambda p: p, dof=1)
    else:
        system = spim.HamiltonianSystem(1, lambda t, z: [np.sin(z[0]), z[1]])
    theirs = solve(name)
    ours = spim.integrate(system, [2.0, 0.0], (0.0, 10.0), 0.1, method=name.lower())
    # The history of extrapolated stages goes on from step to step: the same bits.
    assert np.array_equal(theirs.y, ours.y)
    assert np.array_equal(theirs.t, ours.t)
    assert (theirs.status, theirs.success) == (0, True)
    assert theirs.nfev > 100


@pytest.mark.parametrize("name", ORDERS)
@pytest.mark.parametrize("backward", [False, True])
def test_orders_hold_on_the_grid_and_off_it(name, backward):
    span = (4.0, 0.0) if backward else (0.0, 4.0)
    times = np.array([0.33, 1.001, 2.5, 3.97])[:: -1 if backward else 1]
    want = reference(span, t_eval=times).y
    errors, steps = [], (0.5, 0.25) if name != "Gauss16" else (1.0, 0.5)
    for h in steps:
        found = solve(name, span, h, t_eval=times, dense_output=True)
        assert np.array_equal(found.t, times)
        assert np.abs(found.sol(times) - found.y).max() <= 1e-14
        assert found.sol(0.77).shape == (2,)
        assert found.t.dtype == float
        errors.append(np.abs(found.y - want).max())
    if errors[1] > 1e-12:
        # Four times from few points: a bound, not a slope.
        assert errors[1] <= errors[0] * 0.5 ** (ORDERS[name] - 1.0)
    else:
        assert name in ("Gauss8", "Gauss16")


@pytest.mark.parametrize("name", ORDERS)
def test_the_span_is_divided_into_equal_steps_and_ends_exactly(name):
    found = solve(name, (0.1, 1.0), 0.4)
    assert len(found.t) == 4
    assert found.t[-1] == 1.0
    assert np.diff(found.t) == pytest.approx(0.3)
    # Rows are arrays of their own.
    assert len(np.unique(found.y[0])) == 4
    # As SciPy's own methods have it.
    assert np.array_equal(solve(name, (1.0, 1.0), 0.4).t, reference((1.0, 1.0)).t)
    # 2.1 / 0.7 is 3.
    assert len(solve(name, (0.0, 2.1), 0.7).t) == 4


@pytest.mark.parametrize("name", ["Gauss8", "Gauss16", "Yoshida8"])
def test_events_are_found_by_real_steps(name):
    def down(t, y):
        return y[0]

    def turn(t, y):
        return y[1]

    down.terminal, down.direction = 2, -1
    found = solve(name, (0.0, 40.0), events=[down, turn])
    want = reference((0.0, 40.0), events=[down, turn])
    assert found.status == 1
    for ours, theirs in zip(found.t_events, want.t_events, strict=True):
        assert np.abs(ours - theirs).max() <= 1e-10
    assert found.t[-1] == found.t_events[0][1]
    assert np.abs(found.y[0, -1]) <= 1e-12


def test_args_and_vectorized_functions_arrive():
    want = solve("Gauss6")
    found = solve("Gauss6", fun=lambda t, y, g, l: [y[1], -g / l * np.sin(y[0])], args=(2.0, 2.0))
    assert np.array_equal(found.y, want.y)
    shapes = set()

    def many(t, y):
        shapes.add(y.ndim)
        return np.array([y[1], -np.sin(y[0])])

    found = solve("Gauss6", fun=many, vectorized=True)
    assert np.array_equal(found.y, want.y)
    assert shapes == {2}


@pytest.mark.parametrize("data", [False, True])
def test_compiled_functions_arrive_untouched(data):
    double, pointer = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
    calls = []

    def body(t, y, out, *rest):
        calls.append(t)
        out[0], out[1] = y[1], -(ctypes.cast(rest[0], pointer)[0] if rest else 1.0) * y[0]

    arguments = [double, pointer, pointer] + [ctypes.c_void_p] * data
    compiled = ctypes.CFUNCTYPE(None, *arguments)(body)
    given = [compiled]
    if data:
        value = double(1.0)
        given.append(ctypes.cast(ctypes.pointer(value), ctypes.c_void_p))
    for name in ("Gauss8", "Yoshida6"):
        found = solve(name, fun=LowLevelCallable(*given), y0=[1.0, 0.0])
        assert np.abs(found.y[0] - np.cos(found.t)).max() <= 1e-7
    assert len(calls) > 100
    wrong = ctypes.CFUNCTYPE(double, double)(lambda t: t)
    with pytest.raises(ValueError, match="fun: must have the signature"):
        solve("Gauss8", fun=LowLevelCallable(wrong))


@pytest.mark.parametrize("name", ORDERS)
@pytest.mark.parametrize("error", [ZeroDivisionError, ValueError, SystemExit, KeyboardInterrupt])
def test_exceptions_of_the_function_pass_as_they_are(name, error):
    mine = error("mine")

    def fail(t, y):
        if t > 0.55:
            raise mine
        return pendulum(t, y)

    with pytest.raises(error) as caught:
        solve(name, fun=fail)
    assert caught.value is mine


@pytest.mark.parametrize("name", ORDERS)
def test_what_is_no_number_ends_a_run_and_keeps_the_rest(name):
    def turns(t, y):
        return [y[1], np.nan if t > 0.53 else -np.sin(y[0])]

    found = solve(name, fun=turns)
    assert (found.status, found.success) == (-1, False)
    assert "nan" in found.message or "not finite" in found.message
    # Some methods look ahead of their steps.
    assert 5 <= len(found.t) <= 6
    assert np.array_equal(found.y, solve(name).y[:, : len(found.t)])


def test_steps_that_are_not_solved_end_a_run():
    found = solve("Gauss4", fun=lambda t, y: [1e3 * np.sign(np.sin(1e3 * y[0])), 0.0], step=1.0)
    assert found.status == -1
    assert "reduce the step" in found.message


def test_splitting_wants_what_it_splits():
    damped = lambda t, y: [y[1], -np.sin(y[0]) - 0.1 * y[1]]  # noqa: E731
    for fun, words in (
        (damped, "v' changes with v"),
        (lambda t, y: [y[1] + 0.1 * y[0], -y[0]], "q' changes with q"),
        (lambda t, y: [y[1] * np.cos(t), -y[0]], "q' changes with t"),
    ):
        found = solve("Yoshida4", fun=fun)
        assert found.status == -1
        assert words in found.message
        assert "spim.Gauss6" in found.message
        assert np.array_equal(found.t, [0.0])
    with pytest.raises(ValueError, match="got 3 components"):
        solve("Verlet", fun=lambda t, y: y, y0=[1.0, 2.0, 3.0])
    # Forces may depend on time.
    found = solve("Yoshida8", fun=lambda t, y: [y[1], np.cos(2.0 * t) - y[0]], y0=[0.0, 0.0])
    want = (np.cos(found.t) - np.cos(2.0 * found.t)) / 3.0
    assert np.abs(found.y[0] - want).max() <= 1e-6


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"stepp": 0.1, "step": 0.1}, TypeError, "no option 'stepp'; did you mean 'step'"),
        ({"roundof": "minimal"}, TypeError, "did you mean 'roundoff'"),
        ({"step": None}, TypeError, "step: is needed"),
        ({"step": -0.1}, ValueError, "step: must be positive"),
        ({"step": "1"}, TypeError, "step: must be a number"),
        ({"roundoff": "none"}, ValueError, "roundoff"),
        ({"fun": lambda t, y: [1.0]}, ValueError, r"fun: must have shape \(2,\), got \(1,\)"),
        ({"y0": [1.0 + 1j, 0.0]}, ValueError, "omplex"),
        ({"span": (0.0, np.inf)}, ValueError, "t_span: must be finite"),
    ],
)
def test_what_is_wrong_is_named(options, error, words):
    with pytest.raises(error, match=words):
        solve("Gauss6", **options)


@pytest.mark.parametrize("name", ["rtol", "atol", "first_step", "max_step"])
def test_tolerances_only_warn(name):
    with pytest.warns(UserWarning, match=f"{name}: has no effect on spim.Gauss6"):
        found = solve("Gauss6", **{name: 1e-3})
    assert np.array_equal(found.y, solve("Gauss6").y)


def test_options_of_the_method_reach_it():
    free, tight = solve("Gauss6", roundoff="tolerance"), solve("Gauss6")
    assert free.nfev < tight.nfev


def test_scipy_is_asked_for_late():
    code = (
        "import sys, spim; assert 'scipy' not in sys.modules; assert 'Gauss6' in dir(spim); "
        "spim.Gauss6; assert 'scipy.integrate' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    with pytest.raises(AttributeError, match="no attribute 'Gauss7'"):
        _ = spim.Gauss7
