"""Claims about misuse: any input gives a result or a documented exception, and Ctrl-C works."""

import hashlib
import signal
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import spim

DOCUMENTED = (ValueError, TypeError, OverflowError, MemoryError, spim.SpimError)
DTYPES = st.sampled_from(["f8", ">f8", "f4", "f2", "i4", "u1", "?", "c16", "O", "U3", "M8[s]"])


def survives(call):
    """Run a call that may raise what is documented; its result must be finite."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = call()
        except DOCUMENTED:
            return
    assert np.isfinite(result).all()


@given(
    data=st.data(),
    dtype=DTYPES,
    shape=hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5),
    square=st.booleans(),
    method=st.sampled_from(["auto", "exact", "sid", "pade", "pim", "spim"]),
    order=st.sampled_from(["C", "F", "strided"]),
)
def test_expm_of_any_array_is_finite_or_a_documented_exception(
    data, dtype, shape, square, method, order
):
    if square and shape:
        shape = (*shape, shape[-1])
    a = data.draw(hnp.arrays(np.dtype(dtype), shape, fill=st.nothing()))
    if order == "F":
        a = np.asfortranarray(a)
    elif order == "strided" and a.ndim:
        a = np.repeat(a, 2, axis=-1)[..., ::2]
    survives(lambda: spim.expm(a, method=method))
    assert spim._core.caught_panics() == 0


@given(
    a=hnp.arrays(
        np.float64,
        st.integers(1, 9).map(lambda m: (m, m)),
        elements=st.floats(-1e300, 1e300, allow_subnormal=True),
    ),
    tau=st.floats(allow_nan=True),
    correction=st.sampled_from(["auto", "none", "exact"]),
    steps=st.integers(-1, 200),
    every=st.integers(0, 9),
)
def test_propagators_of_any_matrix_step_or_say_why(a, tau, correction, steps, every):
    def run():
        p = spim.Propagator(a, tau, correction=correction)
        return p.trajectory(np.ones(len(a)), steps, every=every)

    survives(run)
    assert spim._core.caught_panics() == 0


ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 10**18),
    st.floats(),
    st.text(max_size=3),
    st.lists(st.floats(), max_size=5),
    hnp.arrays(DTYPES.map(np.dtype), hnp.array_shapes(min_dims=0, max_dims=3, min_side=0)),
)


def mostly(usual):
    """A usual value four times in five, anything at all otherwise."""
    return st.integers(0, 4).flatmap(lambda i: usual if i else ODD)


@given(
    a=mostly(hnp.arrays(np.float64, (2, 2), elements=st.floats(-1e3, 1e3))),
    z0=mostly(st.just([1.0, 0.5])),
    span=mostly(st.tuples(st.floats(-2, 2), st.floats(-2, 2))),
    step=mostly(st.floats(0.01, 3)),
    method=mostly(st.sampled_from([m.name for m in spim.methods()])),
    every=mostly(st.integers(1, 9)),
    when=mostly(st.floats(-3, 3)),
    name=st.sampled_from(["correction", "doublings", "pade", "order", "nonsense"]),
    value=ODD,
    count=st.integers(0, 4),
)
def test_integrate_of_anything_runs_or_says_why(
    a, z0, span, step, method, every, when, name, value, count
):
    options = {name: value} if count == 0 else {}

    def run():
        solution = spim.integrate(
            spim.LinearSystem(a), z0, span, step, method=method, every=every, **options
        )
        with_energy = solution.energy if solution.system.hamiltonian else 0.0
        finite = [solution.t, solution.z, solution.q, with_energy, solution(when)]
        return [np.isfinite(x).all() for x in finite]

    survives(run)
    assert spim._core.caught_panics() == 0


@given(
    data=st.data(),
    what=st.sampled_from(["Oscillators", "Propagator", "step", "energy", "expm"]),
)
def test_any_arguments_are_taken_or_refused(data, what):
    oscillators = spim.models.Oscillators([0.1, 10], [100, 10])
    odd = [data.draw(ODD, label=f"argument {i}") for i in range(3)]
    name = data.draw(st.sampled_from(["method", "correction", "pade", "order", "doublings"]))
    calls = {
        "Oscillators": lambda: spim.models.Oscillators(*odd[:2]).A,
        "Propagator": lambda: spim.Propagator(oscillators, 0.1, **{name: odd[0]}).matrix,
        "step": lambda: spim.Propagator(oscillators, 0.1).step(odd[0]),
        "energy": lambda: oscillators.energy(odd[0]),
        "expm": lambda: spim.expm(oscillators.A, **{name: odd[0]}),
    }
    survives(calls[what])
    assert spim._core.caught_panics() == 0


@given(
    a=hnp.arrays(np.float64, st.integers(1, 7).map(lambda m: (m, m)), elements=st.floats(-2.0, 2.0))
)
def test_the_exponential_times_that_of_the_opposite_is_the_identity(a):
    forward, back = spim.expm(a), spim.expm(-a)
    bound = 4e-16 * len(a) * np.linalg.norm(forward, 1) * np.linalg.norm(back, 1)
    assert np.abs(forward @ back - np.eye(len(a))).max() <= bound


def digest():
    rng = np.random.default_rng(7)
    total = hashlib.sha256()
    for m in (2, 6, 13, 33):
        a = rng.uniform(-1, 1, (m, m))
        for method in ("exact", "sid", "pim"):
            total.update(spim.expm(a, method=method).tobytes())
        for correction in ("none", "exact"):
            p = spim.Propagator(a - m * np.eye(m) / 2, 0.1, correction=correction)
            total.update(p.trajectory(np.ones(m), 200).tobytes())
    osc = spim.models.Oscillators([0.1, 10, 1000], [100, 10, 1])
    for method in ("auto", "spim", "pim", "rk4"):
        sol = spim.integrate(osc, [0, 0, 0, 2, 2, 2], (0, 1), 0.01, method=method)
        total.update(sol.z.tobytes())
    return total.hexdigest()


def test_results_are_the_same_bits_at_every_kernel_level():
    expected = digest()
    try:
        for level in ("portable", "avx2", "avx512"):
            try:
                assert spim.kernel_level(level) == level
            except ValueError:
                continue  # not on this machine
            assert digest() == expected, level
    finally:
        spim.kernel_level("auto")


def test_threads_share_an_object_and_get_the_same_bits():
    p = spim.Propagator([[0.0, 1.0], [-1.0, 0.0]], 0.1, correction="exact")
    expected, found = p.trajectory([1.0, 0.0], 5000), []
    threads = [
        threading.Thread(target=lambda: found.append(p.trajectory([1.0, 0.0], 5000)))
        for _ in range(16)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(x, expected) for x in found)


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT to itself")
@pytest.mark.parametrize(
    "work",
    [
        "spim.Propagator([[0, 1.0], [-1, 0]], 0.1).trajectory([1.0, 0], 10**12, every=10**9)",
        "spim.expm(np.random.default_rng(0).normal(size=(3000, 3000)), method='sid')",
        "spim.integrate(spim.LinearSystem([[0, 1.0], [-1, 0]]), [1.0, 0], (0, 1e11), 0.1,"
        " every=10**9, method='rk4')",
    ],
)
def test_ctrl_c_ends_long_work(work):
    code = f"import numpy as np, spim\nprint('go', flush=True)\n{work}"
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.readline()
    time.sleep(0.7)
    assert process.poll() is None, process.stderr.read()
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20)  # the promise of 0.1 s is measured, not asserted
    assert b"KeyboardInterrupt" in error


def test_an_interrupted_run_keeps_what_it_has():
    def interrupt(fraction, t):
        signal.raise_signal(signal.SIGINT)

    system = spim.LinearSystem([[0, 1.0], [-1, 0]])
    with pytest.raises(KeyboardInterrupt) as caught:
        spim.integrate(system, [1.0, 0], (0, 1e9), 0.1, every=1000, progress=interrupt)
    assert np.isfinite(caught.value.partial.z).all()
