"""Claims about the public API: results, bits, and what bad input raises."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import spim

DATA = Path(__file__).parents[1] / "data"
Z0 = [0, 0, 0, 2, 2, 2]


@pytest.fixture
def oscillators():
    return spim.models.Oscillators([0.1, 10, 1000], [100, 10, 1])


def reference_cases():
    data = np.load(DATA / "expm.npz")
    for name, label in zip(data["names"], data["labels"], strict=True):
        yield str(name), str(label), *data[str(name)]


def test_exact_is_within_0_51_ulp_of_the_largest_entry():
    for name, label, a, hi, lo in reference_cases():
        if "1e20" in label:
            continue
        error = np.abs((spim.expm(a, method="exact") - hi) - lo).max(initial=0.0)
        assert error <= 0.51 * np.spacing(np.abs(hi).max()), name


def test_exact_rounds_every_entry_correctly_up_to_16_rows():
    # But for sin(pi), 1.2e-16 of the largest entry: its last bit needs more than 106 bits.
    for name, label, a, hi, _ in reference_cases():
        if len(a) <= 16 and "1e20" not in label and name != "rotation: 3.14159":
            assert np.array_equal(spim.expm(a, method="exact"), hi), name


@pytest.mark.parametrize("run", ["oscillators", "beam", "hyperbolic"])
def test_exact_stepping_keeps_the_state_correctly_rounded_for_a_million_steps(run):
    # The beam: 3 elements, tau w = 4000. The hyperbolic run grows by 1e200, so that the bounds its
    # propagator is cut for are drawn anew every few thousand steps.
    data = np.load(DATA / "oscillators.npz")
    system, tau, z0, k, hi, lo = (data[f"{run}_{x}"] for x in ("H", "tau", "z0", "k", "hi", "lo"))
    states = spim.Propagator(system, float(tau), correction="exact").trajectory(z0, int(k.max()))
    error = np.abs((states[k] - hi) - lo)
    assert (error <= 0.51 * np.spacing(np.abs(hi))).all()


@pytest.mark.parametrize(("correction", "most"), [("polish", 2e-10), ("exact", 4e-16)])
def test_energy_stays_over_all_of_a_million_steps(oscillators, correction, most):
    p = spim.Propagator(oscillators, 1.0, correction=correction)
    energy = oscillators.energy(p.trajectory(Z0, 10**6))
    assert np.abs(energy / energy[0] - 1).max() <= most


def test_every_only_chooses_what_is_stored(oscillators):
    for correction in ("none", "polish", "exact"):
        p = spim.Propagator(oscillators, 0.3, correction=correction)
        assert np.array_equal(p.trajectory(Z0, 1000, every=7), p.trajectory(Z0, 1000)[::7])


def test_a_batch_is_its_trajectories(oscillators):
    p = spim.Propagator(oscillators, 0.3)
    batch = np.array([Z0, [1, 0, 0, 0, 0, 0], [0, 1, 2, 0, 0, 0]], dtype=float)
    together = p.trajectory(batch, 100)
    assert together.shape == (101, 3, 6)
    for i, z0 in enumerate(batch):
        assert np.array_equal(together[:, i], p.trajectory(z0, 100))


def test_time_runs_backward(oscillators):
    forward = spim.integrate(oscillators, Z0, (0, 3), 0.1, correction="exact")
    back = spim.integrate(oscillators, forward.z[-1], (3, 0), 0.1, correction="exact")
    assert np.abs(back.z[-1] - Z0).max() <= 1e-13
    assert back.t[-1] == 0.0
    assert back.step == -0.1


def test_states_between_steps_are_exact(oscillators):
    sol = spim.integrate(oscillators, Z0, (0, 2), 0.1, every=5)
    direct = spim.integrate(oscillators, Z0, (0, 1.234), 1.234)
    assert np.abs(sol(1.234) - direct.z[-1]).max() <= 1e-14
    assert sol([0.1, 0.2]).shape == (6, 2)


def test_an_uneven_span_is_divided_equally_with_a_warning(oscillators):
    with pytest.warns(UserWarning, match="no multiple"):
        sol = spim.integrate(oscillators, Z0, (0, 1), 0.3)
    assert len(sol.t) == 5
    assert sol.step == 0.25
    assert spim.integrate(oscillators, Z0, (0, 2.1), 0.7).step == 0.7


def test_off_diagonal_ratios_are_not_symplectic(oscillators):
    even = spim.Propagator(oscillators, 0.05, method="pade", pade=(2, 2), doublings=0)
    odd = spim.Propagator(
        oscillators, 0.05, method="pade", pade=(3, 2), doublings=0, correction="none"
    )
    assert even.symplectic_defect <= 1e-15
    assert odd.symplectic_defect >= 1e-6


def test_complex_input_gives_the_complex_exponential():
    x = spim.expm(np.array([[1j * np.pi / 2]]))
    assert x.dtype == complex
    assert abs(x[0, 0] - 1j) <= 1e-16


def test_empty_stacks_stay_empty():
    for shape in ((0, 0), (0, 3, 3), (2, 0, 0)):
        assert spim.expm(np.zeros(shape)).shape == shape


def test_layout_and_type_of_the_array_do_not_matter():
    a = np.arange(9.0).reshape(3, 3) / 4
    expected = spim.expm(a)
    frozen = a.copy()
    frozen.flags.writeable = False
    wide = np.zeros((6, 6))
    wide[::2, ::2] = a
    for same in (np.asfortranarray(a), wide[::2, ::2], frozen, a.astype(">f8"), a.tolist()):
        assert np.array_equal(spim.expm(same), expected)
    assert spim.expm(np.eye(2, dtype=int)).dtype == np.float64


@pytest.mark.parametrize(
    ("a", "error", "message"),
    [
        (np.zeros((2, 3)), ValueError, "square"),
        (np.zeros(3), ValueError, "square"),
        (1.0, ValueError, "square"),
        ([[np.nan]], ValueError, r"entry \(0, 0\) is nan"),
        ([[1.0, np.inf], [0, 0]], ValueError, r"entry \(0, 1\) is inf"),
        (np.array([[object()]]), TypeError, "dtype object"),
        ([["a"]], TypeError, "dtype"),
        ([[1000.0]], OverflowError, "overflows"),
    ],
)
def test_unusable_matrices_raise(a, error, message):
    with pytest.raises(error, match=message):
        spim.expm(a)


def test_unusable_arguments_raise(oscillators):
    p = spim.Propagator(oscillators, 0.1)
    for tau in (0.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="tau"):
            spim.Propagator(oscillators, tau)
    for steps, error in ((-1, ValueError), (1.5, TypeError), (10**15, MemoryError)):
        with pytest.raises(error):
            p.trajectory(Z0, steps)
    with pytest.raises(ValueError, match="z0"):
        p.trajectory([1.0], 3)
    with pytest.raises(ValueError, match="nan"):
        p.trajectory([np.nan] * 6, 3)
    with pytest.raises(ValueError, match="polish"):
        spim.Propagator([[1.0, 2.0], [3.0, 4.0]], 1.0, correction="polish")
    with pytest.raises(TypeError, match="did you mean 'correction'"):
        spim.integrate(oscillators, Z0, (0, 1), 0.1, corection="exact")
    with pytest.raises(ValueError, match="unknown method 'exact'"):
        # Above 32 states "auto" is not exact, so it does not go by that name.
        spim.integrate(oscillators, Z0, (0, 1), 0.1, method="exact")
    with pytest.raises(ValueError, match="did you mean 'spim'"):
        spim.integrate(oscillators, Z0, (0, 1), 0.1, method="spin")
    for step in (0.0, -0.1, np.nan):
        with pytest.raises(ValueError, match="step"):
            spim.integrate(oscillators, Z0, (0, 1), step)


def test_a_failed_run_keeps_what_it_has(oscillators):
    with pytest.raises(spim.ModelError) as caught:
        spim.integrate(oscillators, Z0, (0, 1000), 1.0, method="rk4")
    partial = caught.value.partial
    assert len(partial.t) > 1
    assert np.isfinite(partial.z).all()
    assert not partial.success
    sol = spim.integrate(oscillators, Z0, (0, 1000), 1.0, method="rk4", throw=False)
    assert np.array_equal(sol.z, partial.z)


def test_progress_exceptions_reach_the_caller(oscillators):
    class Stop(Exception):
        pass

    def progress(fraction, t):
        raise Stop

    with pytest.raises(Stop):
        spim.integrate(oscillators, Z0, (0, 1e7), 1.0, every=10**6, progress=progress)


def test_propagators_and_errors_pickle(oscillators):
    p = spim.Propagator(oscillators, 0.1, method="spim", pade=3)
    assert np.array_equal(pickle.loads(pickle.dumps(p)).matrix, p.matrix)
    assert isinstance(pickle.loads(pickle.dumps(spim.ModelError("x"))), spim.ModelError)


def test_nothing_has_panicked():
    assert spim._core.caught_panics() == 0


def test_an_energy_that_is_no_number_is_an_error(oscillators):
    states = np.ones((3, 6))
    states[1] *= 1e200
    with pytest.raises(OverflowError, match="exceeds 1.8e308 for state 1"):
        oscillators.energy(states)
    states[1, 2] = np.nan
    with pytest.raises(ValueError, match=r"z: entry \(1, 2\) is nan"):
        oscillators.energy(states)


@pytest.mark.parametrize("rates", [(-0.1, -5.0), (0.0, -10.0), (1.0, -20.0), (10.0, -10.0)])
def test_exact_stepping_knows_components_that_decay_beside_others_to_some_units(rates):
    mpmath = pytest.importorskip("mpmath")
    propagator = spim.Propagator(np.diag(rates), 1.0, correction="exact")
    states = propagator.trajectory([1.0, 1.0], 60)
    for k in (1, 2, 7, 8, 30, 31, 59, 60):
        for found, rate in zip(states[k], rates, strict=True):
            with mpmath.workdps(60):
                exact = float(mpmath.exp(mpmath.mpf(rate) * k))
            # One product after the other of the block rounds a component far below its bound.
            most = 0.51 if rate == max(rates) else 4.0
            assert abs(found - exact) <= most * np.spacing(exact), (k, rate)


@pytest.mark.parametrize(
    ("matrix", "step", "steps"),
    [
        ([[-1.0]], 1.0, 700),
        ([[1.0]], 0.5, 1200),
        ([[0.0, 1.0], [-1.0, -0.02]], 0.3, 6000),
        ([[0.0, 1.0], [-1.0, -0.1]], 0.3, 6000),
    ],
)
def test_exact_stepping_rounds_motion_that_decays_or_grows_as_a_whole(matrix, step, steps):
    mpmath = pytest.importorskip("mpmath")
    propagator = spim.Propagator(matrix, step, correction="exact")
    start = np.ones(len(matrix))
    states = propagator.trajectory(start, steps)
    with mpmath.workdps(60):
        scaled = mpmath.matrix(matrix) * mpmath.mpf(step)
        stride = mpmath.expm(scaled * 37)
        exact = mpmath.matrix(list(start))
        for k in range(0, steps, 37):
            for found, best in zip(states[k], exact, strict=True):
                assert abs(float(best - mpmath.mpf(float(found)))) <= 0.51 * np.spacing(abs(found))
            exact = stride * exact


def test_a_small_member_of_a_batch_is_as_exact_as_alone(oscillators):
    propagator = spim.Propagator(oscillators, 0.3, correction="exact")
    small = 1e-12 * np.array(Z0, float)
    together = propagator.trajectory([Z0, small], 20_000)[:, 1]
    alone = propagator.trajectory(small, 20_000)
    # At its zeros a component has no more digits than its amplitude leaves it.
    least = 1e-20 * np.abs(alone).max(axis=0)
    assert (np.abs(together - alone) <= np.maximum(np.spacing(np.abs(alone)), least)).all()
    assert np.mean(together != alone) < 1e-3


def test_a_long_span_that_is_no_multiple_is_seen(oscillators):
    with pytest.warns(UserWarning, match="no multiple"):
        solution = spim.integrate(oscillators, Z0, (0.0, 1e5 + 9e-5), 0.1, every=10**7)
    exact = spim.integrate(oscillators, Z0, (0.0, 1e5 + 9e-5), 1e5 + 9e-5, correction="exact")
    assert np.abs(solution.z[-1] / exact.z[-1] - 1.0).max() <= 1e-6


def test_dense_output_is_exact_next_to_grid_points(oscillators):
    solution = spim.integrate(oscillators, Z0, (0.0, 2.0), 0.05, correction="exact")
    for t in (0.5 + 4e-11, 0.55 - 4e-11, 0.5123):
        alone = spim.integrate(oscillators, Z0, (0.0, t), t, correction="exact")
        assert np.abs(solution(t) - alone.z[-1]).max() <= 1e-14


def test_states_that_exact_does_not_reach_say_so():
    propagator = spim.Propagator([[0.0, 1.0], [-1.0, 0.0]], 0.1, correction="exact")
    with pytest.raises(spim.ModelError, match="reaches to states of 1e270"):
        propagator.trajectory([1e271, 0.0], 3)
    with pytest.raises(OverflowError, match="symplectic_defect"):
        _ = spim.Propagator(np.diag([700.0, 700.0]), 1.0).symplectic_defect


def test_a_polish_goes_on_to_rounding_and_says_where_it_cannot_help(oscillators):
    polished = spim.Propagator(oscillators, 1.0, method="pim", order=1, doublings=22)
    assert polished.correction == "polish"
    assert polished.symplectic_defect <= 1e-15
    low = spim.Propagator(oscillators, 1.0, method="pim", order=1, doublings=2)
    assert low.correction == "none"
    with pytest.raises(ValueError, match="far from symplectic"):
        spim.Propagator(oscillators, 1.0, method="pim", order=1, doublings=2, correction="polish")
    solution = spim.integrate(
        oscillators, Z0, (0.0, 5.0), 1.0, method="spim", pade=(2, 3), doublings=0
    )
    assert "polish" not in solution.method


def test_integrate_warns_where_no_digit_can_be_relied_on():
    system = spim.LinearSystem([[0.0, 1e16], [-1e16, 0.0]])
    with pytest.warns(spim.PrecisionWarning, match="1-norm"):
        spim.integrate(system, [1.0, 0.0], (0.0, 3.0), 1.0)


def test_copies_are_as_read_only_as_what_they_are_copies_of(oscillators):
    copy = pickle.loads(pickle.dumps(oscillators))
    for system in (oscillators, copy):
        for array in (system.A, system.mass, system.stiffness):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1.0


def test_progress_arrives_at_one_only_where_the_run_does(oscillators):
    seen = []
    spim.integrate(oscillators, Z0, (0.0, 1.0), 0.5, progress=lambda *x: seen.append(x))
    assert seen[-1] == (1.0, 1.0)
    seen.clear()
    with pytest.raises(spim.ModelError):
        spim.integrate(
            spim.LinearSystem([[1.0]]), [1.0], (0, 1e4), 1.0, progress=lambda *x: seen.append(x)
        )
    assert all(fraction < 1.0 for fraction, _ in seen)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda o: spim.Propagator(o, 0.1, method=3), TypeError, "method: must be a string"),
        (lambda o: spim.Propagator(o, 0.1, correction=3), TypeError, "correction: must be a"),
        (lambda o: spim.Propagator(o, "0.1"), TypeError, "tau: must be a real number, got str"),
        (lambda o: spim.phi(o.A, 1, tau="x"), TypeError, "tau: must be a real number"),
        (lambda o: spim.expm([[1, 2], [3]]), ValueError, "A: .*inhomogeneous"),
        (lambda o: spim.expm(o), TypeError, r"use \.A"),
        (lambda o: spim.models.Oscillators([1j], [1.0]), TypeError, "mass: needs real"),
        (lambda o: spim.models.Oscillators([1e-310], [1.0]), ValueError, "mass: must be pos"),
        (lambda o: spim.integrate(o, Z0, (0, 1), 0.1, correction=1), ValueError, "a word, got 1"),
        (lambda o: spim.integrate(o, Z0, (0, 1), 0.1)("0.5"), TypeError, "t: needs real"),
    ],
)
def test_messages_name_the_argument(oscillators, call, error, words):
    with pytest.raises(error, match=words):
        call(oscillators)


def test_every_may_be_larger_than_any_count(oscillators):
    states = spim.Propagator(oscillators, 0.1).trajectory(Z0, 5, every=10**30)
    assert states.shape == (1, 6)


def test_t_eval_gives_the_states_at_its_times(oscillators):
    whole = spim.integrate(oscillators, Z0, (0.0, 2.0), 0.1, correction="exact")
    times = [0.0, 0.3, 0.35, 1.2345, 2.0]
    some = spim.integrate(oscillators, Z0, (0.0, 2.0), 0.1, correction="exact", t_eval=times)
    assert np.array_equal(some.t, times)
    assert np.array_equal(some.z[[0, 1, 4]], whole.z[[0, 3, 20]])
    alone = spim.integrate(oscillators, Z0, (0.0, 1.2345), 1.2345, correction="exact")
    # The rounding of the time 1.2, 1.1e-16 s, times rates of 60 kg m/s^2.
    assert np.abs(some.z[3] - alone.z[-1]).max() <= 1e-14
    assert np.abs(some(0.7) - whole(0.7)).max() <= 1e-14
    back = spim.integrate(oscillators, Z0, (2.0, 0.0), 0.1, t_eval=[1.5, 0.25])
    assert back.t.tolist() == [1.5, 0.25]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"t_eval": [0.0, 3.0]}, "within the span"),
        ({"t_eval": [1.0, 0.5]}, "from the start"),
        ({"t_eval": []}, "shape"),
        ({"t_eval": [np.nan]}, "entry"),
        ({"t_eval": [1.0], "every": 2}, "every"),
    ],
)
def test_bad_t_eval_says_what_is_wrong(oscillators, options, words):
    with pytest.raises(ValueError, match=words):
        spim.integrate(oscillators, Z0, (0.0, 2.0), 0.1, **options)
