"""Claims about loads on linear systems and structures."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import spim
from spim import loads

DATA = np.load(Path(__file__).parents[1] / "data" / "loads.npz")
W = 3.0
START = (0.25, -0.5)


def oscillator(load):
    """``2 q'' + 2 W^2 q = f``."""
    return spim.StructuralSystem([[2.0]], [[2.0 * W**2]], load=load)


def run(load, step, steps, **options):
    system = oscillator(load)
    start = system.state(q=[START[0]], v=[START[1]])
    return spim.integrate(system, start, (0.0, step * steps), step, **options)


def free_beam():
    load = (
        loads.Polynomial(DATA["polynomial"])
        + loads.Harmonic(DATA["harmonic"], float(DATA["frequency"]), float(DATA["phase"]))
        + loads.Exponential(DATA["exponential"], float(DATA["rate"]))
    )
    return spim.StructuralSystem(DATA["mass"], DATA["stiffness"], load=load)


@pytest.mark.parametrize(("correction", "most"), [("exact", 1e-13), ("none", 2e-9)])
@pytest.mark.parametrize("case", range(3))
def test_a_free_beam_under_loads_in_closed_form_after_1000_steps(case, correction, most):
    system, step = free_beam(), float(DATA["steps"][case])
    assert np.array_equal(system.A, DATA["A"])
    solution = spim.integrate(
        system, system.state(), (0.0, 1000 * step), step, correction=correction
    )
    for k, state, velocity in zip(
        DATA["counts"], DATA["states"][case], DATA["velocities"][case], strict=True
    ):
        q = state[: system.dof]
        assert np.abs(solution.q[k] - q).max() <= most * np.abs(q).max()
        assert np.abs(solution.v[k] - velocity).max() <= most * np.abs(velocity).max()


@pytest.mark.parametrize("correction", ["none", "exact"])
def test_resonance_grows_as_it_should(correction):
    solution = run(loads.Harmonic([2.0], W), 0.25, 1000, correction=correction)
    t = solution.t
    q = t * np.sin(W * t) / (2 * W) + START[0] * np.cos(W * t) + START[1] / W * np.sin(W * t)
    assert np.abs(solution.q[:, 0] - q).max() <= 2e-13 * np.abs(q).max()


def test_a_product_in_closed_form_is_that_of_its_values():
    product = loads.Exponential([2.0], -0.5) * loads.Harmonic([1.0], 2.0, 0.3)
    product = product * loads.Polynomial([1.0, 0.5])
    t = np.linspace(0.0, 4.0, 9)
    values = 2.0 * np.exp(-0.5 * t) * np.cos(2.0 * t + 0.3) * (1.0 + 0.5 * t)
    assert np.allclose(product(t)[:, 0], values, rtol=1e-14, atol=1e-15)
    exact = run(product, 0.5, 100)
    same = run(loads.Function(lambda t: float(product(t)[0]), degree=7), 0.125, 400)
    assert np.abs(exact.q - same.q[::4]).max() <= 1e-12


def test_sums_differences_and_factors():
    load = 2 * loads.Polynomial([[1.0, 0.0]]) - loads.Harmonic([0.0, 3.0], 1.0) * 0.5
    assert np.allclose(load(0.0), [2.0, -1.5])
    with pytest.raises(ValueError, match="do not add"):
        load + loads.Polynomial([1.0])
    with pytest.raises(TypeError):
        load + 1.0


@pytest.mark.parametrize("hold", ["first", "zero"])
@pytest.mark.parametrize("correction", ["none", "exact"])
@pytest.mark.parametrize("step", [0.05, 0.1, 0.03, 0.09, 0.7])
def test_a_record_is_integrated_exactly_whatever_the_step(hold, correction, step):
    # The reference: an exponential for each piece of the record, one after the other.
    values = np.random.default_rng(0).normal(size=40)
    edges = 0.2 + 0.05 * np.arange(41)
    record = loads.Sampled(values, 0.05, hold=hold, start=0.2)
    last = values if hold == "zero" else np.append(values[1:], np.nan)
    pieces = [(0.0, edges[0], 0.0, 0.0)]
    pieces += list(zip(edges[:-1], edges[1:], values, last, strict=True))
    pieces = pieces[:40] if hold == "first" else pieces
    pieces.append((pieces[-1][1], 3.0, 0.0, 0.0))
    system = oscillator(None)

    def exact(t):
        z = system.state(q=[START[0]], v=[START[1]])
        for begin, end, left, right in pieces:
            upto = min(end, t)
            if upto > begin:
                slope = (right - left) / (end - begin)
                A, B, tau = system.A, np.array([0.0, 1.0]), upto - begin
                _, one, two = spim.phi(A, 2, tau=tau)
                z = spim.expm(tau * A) @ z + tau * one @ B * left + tau**2 * two @ B * slope
        return z

    with pytest.warns(UserWarning, match="leaves the record"):
        solution = run(record, step, int(2.8 / step), correction=correction)
    for t, z in list(zip(solution.t, solution.z, strict=True))[::3]:
        assert np.abs(z - exact(t)).max() <= 1e-12, t


def test_a_record_with_times_of_its_own():
    values, times = [0.0, 2.0, -1.0, 0.5], [0.0, 0.3, 0.35, 2.0]
    dense = np.linspace(0.0, 2.0, 41)
    coarse = run(loads.Sampled(values, times=times), 0.1, 20)
    even = run(loads.Sampled(np.interp(dense, times, values), 0.05), 0.05, 40)
    assert np.abs(coarse.q - even.q[::2]).max() <= 1e-14


def test_a_run_back_under_a_record_returns_to_its_start():
    record = loads.Sampled(np.random.default_rng(1).normal(size=100), 0.05)
    system = oscillator(record)
    there = spim.integrate(system, system.state(q=[1.0]), (0.0, 4.9), 0.07)
    back = spim.integrate(system, there.z[-1], (4.9, 0.0), 0.1)
    assert np.abs(back.z[-1] - there.z[0]).max() <= 1e-13


def test_every_and_dense_output_see_the_load():
    load = loads.Sampled(np.sin(np.arange(60.0)), 0.1) + loads.Harmonic([1.0], 2.0)
    whole, some = run(load, 0.1, 50), run(load, 0.1, 50, every=7)
    assert np.array_equal(whole.z[::7], some.z[:-1])
    assert np.abs(some(1.234) - whole(1.234)).max() <= 1e-14
    assert np.abs(some([0.3, 4.4]) - whole([0.3, 4.4])).max() <= 1e-14


def test_a_function_converges_with_its_degree():
    exact = run(loads.Harmonic([1.0], 2.0), 0.5, 20).q[-1]
    errors = []
    for degree in (1, 3, 5):
        function = loads.Function(lambda t: np.cos(2.0 * t), degree=degree)
        errors.append(abs(run(function, 0.5, 20).q[-1] - exact)[0])
    assert errors[0] > 100 * errors[1] > 1e4 * errors[2]
    assert errors[2] < 1e-10


def test_rk4_sees_the_load_too():
    load = loads.Harmonic([1.0], 2.0) + loads.Sampled(np.arange(30.0), 0.1)
    exact = run(load, 0.1, 25)
    assert np.abs(run(load, 0.001, 2500, method="rk4").q[::100] - exact.q).max() <= 1e-9


def test_ground_motion_gravity_and_unbalance_act_through_the_structure():
    mass, stiffness = np.diag([2.0, 1.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    record = loads.Sampled([0.0, 1.0, 0.0, 0.0], 0.5)
    shaken = loads.GroundMotion(record, [1.0, 1.0]) + loads.Gravity([0.0, 1.0], 10.0)
    system = spim.StructuralSystem(mass, stiffness, load=shaken)
    solution = spim.integrate(system, system.state(), (0.0, 1.5), 0.25)
    assert np.allclose(solution.a[0], [0.0, 10.0])
    residual = solution.a @ mass + solution.q @ stiffness + np.outer(record(solution.t), [2.0, 1.0])
    assert np.allclose(residual, [0.0, 10.0], atol=1e-13)
    rotor = spim.StructuralSystem(np.eye(2), np.eye(2), load=loads.Unbalance(0.5, 2.0, (0, 1)))
    turning = spim.integrate(rotor, rotor.state(), (0.0, 1.0), 0.5)
    force = turning.a + turning.q
    assert np.allclose(force, 2.0 * np.array([np.cos(2 * turning.t), np.sin(2 * turning.t)]).T)


def test_loaded_systems_can_be_pickled():
    system = free_beam()
    copy = pickle.loads(pickle.dumps(system))
    step = float(DATA["steps"][0])
    one, other = (spim.integrate(s, s.state(), (0, 10 * step), step) for s in (system, copy))
    assert np.array_equal(one.z, other.z)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (
            lambda: loads.Sampled([1.0, np.nan, 2.0], 0.1),
            ValueError,
            r"values: entry \(1,\) is nan",
        ),
        (lambda: loads.Sampled([1.0], 0.1), ValueError, "two samples"),
        (lambda: loads.Sampled([1.0, 2.0]), TypeError, "step= or times="),
        (lambda: loads.Sampled([1.0, 2.0], 0.0), ValueError, "step: must be positive"),
        (lambda: loads.Sampled([1.0, 2.0], 0.1, hold="cubic"), ValueError, "hold"),
        (lambda: loads.Sampled([1.0, 2.0], times=[0.0, 0.0]), ValueError, "entry 1"),
        (lambda: loads.Sampled([1.0, 2.0], times=[0.0]), ValueError, "1 times for 2"),
        (lambda: loads.Harmonic(["a"], 1.0), TypeError, "amplitude"),
        (lambda: loads.Harmonic([1.0], np.inf), ValueError, "frequency"),
        (lambda: loads.Polynomial([]), ValueError, "empty"),
        (lambda: loads.Function(1.0), TypeError, "callable"),
        (lambda: loads.Function(np.sin, degree=8), ValueError, "0 to 7"),
        (lambda: loads.GroundMotion([1.0], [1.0]), TypeError, "record"),
        (lambda: oscillator(loads.Polynomial([[1.0, 2.0]])), ValueError, "2 components"),
        (lambda: oscillator(np.sin), TypeError, "spim.loads.Function"),
        (lambda: oscillator(loads.Unbalance(1.0, 1.0, (0, 1))), ValueError, "dofs"),
        (
            lambda: spim.LinearSystem([[0.0]], load=loads.Gravity([1.0])),
            ValueError,
            "needs? a system with masses",
        ),
        (lambda: run(loads.Function(lambda t: np.nan), 0.1, 3), ValueError, "at t ="),
        (lambda: run(loads.Function(lambda t: [1.0, 2.0]), 0.1, 3), ValueError, "shape"),
    ],
)
def test_bad_loads_say_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_an_exception_in_a_load_arrives_with_what_was_computed():
    def load(t):
        if t > 40.0:
            raise RuntimeError("no more")
        return 1.0

    with pytest.raises(RuntimeError, match="no more") as caught:
        run(loads.Function(load), 0.1, 1000)
    partial = caught.value.partial
    assert 250 <= len(partial.t) <= 401
    assert np.isfinite(partial.z).all()


def test_backward_from_where_an_exponential_is_below_doubles():
    """exp(-t/2) is 0 at t = 2000, where the run starts, and 1 at its end."""
    load = spim.loads.Exponential([1.0], -0.5)
    system = spim.StructuralSystem([[1.0]], [[1.0]], load=load)
    # The forced motion alone: q = exp(-t/2) / (1 + 1/4).
    run = spim.integrate(system, [0.0, 0.0], (2000.0, 0.0), 1.0)
    assert run.z[-1] == pytest.approx([0.8, -0.4], rel=1e-12)
