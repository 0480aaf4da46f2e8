"""Claims about functions of users: compiled, vectorised, symbolic, and misbehaving."""

import ctypes
import gc
import math
import os
import pickle
import signal
import sys
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
import pytest
import sympy
from scipy import LowLevelCallable

import spim

POINTER = ctypes.POINTER(ctypes.c_double)
ONE = ctypes.CFUNCTYPE(None, ctypes.c_double, POINTER, POINTER)
WITH_DATA = ctypes.CFUNCTYPE(None, ctypes.c_double, POINTER, POINTER, ctypes.c_void_p)

Z0 = [0.0, 0.1, 0.5, 0.0]
SPAN = (0.0, 10.0)


# Henon and Heiles, in every form; products and sums alone, so that all have the same bits.
def plain(t, z):
    x, y, px, py = z.tolist()
    return [px, py, -x - 2.0 * x * y, -y - (x * x - y * y)]


def array(t, z):
    x, y, px, py = z
    return np.array([px, py, -x - 2.0 * x * y, -y - (x * x - y * y)])


def writing(t, z, out):
    x, y, px, py = z
    out[0], out[1], out[2] = px, py, -x - 2.0 * x * y
    out[3] = -y - (x * x - y * y)


@numba.cfunc(spim.cfunc_signature())
def one(t, z, out):
    z, out = numba.carray(z, 4), numba.carray(out, 4)
    x, y = z[0], z[1]
    out[0], out[1], out[2], out[3] = z[2], z[3], -x - 2.0 * x * y, -y - (x * x - y * y)


@numba.cfunc(spim.cfunc_signature(batch=True))
def eight(t, z, out):
    z, out = numba.carray(z, (4, 8)), numba.carray(out, (4, 8))
    for i in range(8):
        x, y = z[0, i], z[1, i]
        out[0, i], out[1, i] = z[2, i], z[3, i]
        out[2, i], out[3, i] = -x - 2.0 * x * y, -y - (x * x - y * y)


@numba.cfunc(spim.cfunc_signature(user_data=True))
def with_data(t, z, out, data):
    z, out, k = numba.carray(z, 4), numba.carray(out, 4), numba.carray(data, 1, numba.float64)
    x, y = z[0], z[1]
    out[0], out[1], out[2] = z[2], z[3], -x - k[0] * x * y
    out[3] = -y - (x * x - y * y)


@ONE
def of_ctypes(t, z, out):
    out[0], out[1], out[2], out[3] = plain(t, np.array(z[:4]))


TWO = np.array([2.0])
FORMS = {
    "array": (array, {}),
    "writing": (writing, {}),
    "vectorised": (array, {"vectorized": True}),
    "vectorised writing": (writing, {"vectorized": True}),
    "numba": (one, {}),
    "numba, eight": (eight, {}),
    "numba, both": ((one, eight), {}),
    "ctypes": (of_ctypes, {}),
    "numba's ctypes": (one.ctypes, {}),
    "low level": (LowLevelCallable(one.ctypes), {}),
    "low level, eight": (LowLevelCallable(eight.ctypes), {}),
    "user data": (
        LowLevelCallable(with_data.ctypes, TWO.ctypes.data_as(ctypes.c_void_p)),
        {},
    ),
}


def run(function, method="gauss16", step=0.25, **options):
    return spim.integrate(spim.FlowSystem(4, function, **options), Z0, SPAN, step, method=method)


@pytest.mark.parametrize("method", ["gauss8", "gauss12", "gauss24", "rk4"])
@pytest.mark.parametrize("form", FORMS)
def test_functions_in_all_forms_have_the_same_bits(form, method):
    function, options = FORMS[form]
    assert (run(function, method, **options).z == run(plain, method).z).all()


def test_every_system_takes_compiled_and_vectorised_functions():
    def gradient(t, z, out):
        out[0], out[1] = np.sin(z[0]), z[1]

    def energy(t, z):
        return 0.5 * z[1] ** 2 - np.cos(z[0])

    def force(t, q):
        return -np.sin(q)

    def rest(t, z):
        return np.array([0.0 * z[0], z[0] - np.sin(z[0])])

    @numba.cfunc(spim.cfunc_signature())
    def compiled_gradient(t, z, out):
        z, out = numba.carray(z, 2), numba.carray(out, 2)
        out[0], out[1] = math.sin(z[0]), z[1]

    @numba.cfunc(spim.cfunc_signature())
    def compiled_energy(t, z, out):
        z, out = numba.carray(z, 2), numba.carray(out, 1)
        out[0] = 0.5 * z[1] ** 2 - math.cos(z[0])

    @numba.cfunc(spim.cfunc_signature())
    def compiled_force(t, q, out):
        numba.carray(out, 1)[0] = -math.sin(numba.carray(q, 1)[0])

    @numba.cfunc(spim.cfunc_signature())
    def compiled_velocity(t, p, out):
        numba.carray(out, 1)[0] = numba.carray(p, 1)[0]

    @numba.cfunc(spim.cfunc_signature())
    def compiled_potential(t, q, out):
        numba.carray(out, 1)[0] = -math.cos(numba.carray(q, 1)[0])

    @numba.cfunc(spim.cfunc_signature())
    def compiled_rest(t, z, out):
        z, out = numba.carray(z, 2), numba.carray(out, 2)
        out[0], out[1] = 0.0, z[0] - math.sin(z[0])

    A = [[0.0, 1.0], [-1.0, 0.0]]
    systems = [
        spim.HamiltonianSystem(1, gradient, hamiltonian=energy, vectorized=True),
        spim.HamiltonianSystem(1, compiled_gradient, hamiltonian=compiled_energy),
        spim.SeparableSystem(
            force, mass=[1.0], potential=lambda t, q: -np.cos(q[0]), vectorized=True
        ),
        spim.SeparableSystem(force, velocity=lambda p: p, dof=1, vectorized=True),
        spim.SeparableSystem(compiled_force, mass=[1.0], potential=compiled_potential),
        spim.SeparableSystem(compiled_force, velocity=compiled_velocity, dof=1),
        spim.SemilinearSystem(A, rest, potential=lambda t, z: -np.cos(z[0]) - 0.5 * z[0] ** 2),
        spim.SemilinearSystem(A, rest, vectorized=True),
        spim.SemilinearSystem(A, compiled_rest),
    ]
    wanted = spim.integrate(systems[0], [2.0, 0.3], SPAN, 0.1, method="gauss16")
    energies = 0
    for system in systems:
        for method in ("gauss16", "gauss24"):
            made = spim.integrate(system, [2.0, 0.3], SPAN, 0.1, method=method)
            # sin of NumPy and of C, and the order of sums, differ by the last bit.
            assert np.abs(made.z - wanted.z).max() <= 2e-14
        try:
            assert np.abs(made.energy - wanted.energy).max() <= 2e-15
            energies += 1
        except spim.UnsupportedError:
            pass
    assert energies == 5


def test_vectorised_functions_get_the_stages_and_nothing_else():
    sizes = []

    def rate(t, z):
        sizes.append((t.shape, z.shape))
        return array(t, z)

    made = run(rate, "gauss12", vectorized=True)
    # Six stages, no lanes of padding; as often as there are iterations.
    assert set(sizes) == {((6,), (4, 6))}
    assert len(sizes) == made.stats["evaluations"] // 6
    sizes.clear()
    run(rate, "gauss24", vectorized=True)
    assert set(sizes) == {((12,), (4, 12))}
    sizes.clear()
    run(rate, "rk4", vectorized=True)
    assert set(sizes) == {((1,), (4, 1))}


def test_plain_functions_are_called_for_stages_alone():
    count = [0]

    def rate(t, z):
        count[0] += 1
        return plain(t, z)

    made = run(rate, "gauss12")
    assert count[0] == made.stats["evaluations"]


def test_times_of_vectorised_functions_are_those_of_the_stages():
    def force(t, q):
        return -q + np.cos(2.0 * t)

    system = spim.SeparableSystem(force, mass=[1.0], vectorized=True)
    made = spim.integrate(system, [1.0, 0.5], (0.0, 3.0), 0.1, method="gauss16")
    # q'' + q = cos 2t
    exact = (4.0 * np.cos(made.t) - np.cos(2.0 * made.t)) / 3.0 + 0.5 * np.sin(made.t)
    assert np.abs(made.q[:, 0] - exact).max() <= 1e-15


def test_functions_are_given_their_arguments():
    def rate(t, z, k, shift):
        return [z[1], -k * z[0] + shift]

    def writing_rate(t, z, out, k, shift):
        out[0], out[1] = z[1], -k * z[0] + shift

    for function in (rate, writing_rate):
        for vectorized in (False, True):
            if vectorized and function is rate:
                continue
            system = spim.FlowSystem(2, function, args=(4.0, 1.0), vectorized=vectorized)
            made = spim.integrate(system, [0.25, 0.0], (0.0, 5.0), 0.1, method="gauss8")
            assert (made.z == [0.25, 0.0]).all()
    with pytest.raises(TypeError, match="args: must be a tuple"):
        spim.FlowSystem(2, rate, args=[1.0])


@pytest.mark.parametrize(
    ("function", "error", "words"),
    [
        (ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(abs), ValueError, "signature"),
        (ctypes.CFUNCTYPE(None, POINTER, ctypes.c_double, POINTER)(max), ValueError, "got void"),
        (WITH_DATA(max), ValueError, "takes user data, but is given none"),
        (ctypes.CDLL(None).abs, ValueError, "argtypes"),
        (numba.cfunc("float64(float64)")(lambda x: x), ValueError, "got double"),
        (LowLevelCallable(numba.cfunc("float64(float64)")(lambda x: x).ctypes), ValueError, "sig"),
        ((one, one), TypeError, "one state and one of eight"),
        ((one, plain), TypeError, "must be a function"),
        (None, TypeError, "rate"),
    ],
)
def test_pointers_of_other_signatures_are_refused(function, error, words):
    if function is None:
        with pytest.raises(TypeError, match="needs rate"):
            run(function)
        return
    with pytest.raises(error, match=words):
        run(function)


def test_compiled_functions_take_no_arguments_of_python():
    for options in ({"args": (1.0,)}, {"vectorized": True}):
        with pytest.raises(TypeError, match="neither args= nor vectorized="):
            spim.FlowSystem(4, one, **options)


def test_the_signature_of_numba_needs_numba(monkeypatch):
    assert spim.cfunc_signature() == one._sig
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(ImportError, match="needs numba"):
        spim.cfunc_signature()


def test_what_a_compiled_function_does_not_write_is_a_model_error():
    @numba.cfunc(spim.cfunc_signature())
    def rate(t, z, out):
        z, out = numba.carray(z, 2), numba.carray(out, 2)
        out[0] = z[1]
        if t < 5.0:
            out[1] = -z[0]

    @numba.cfunc(spim.cfunc_signature(batch=True))
    def rates(t, z, out):
        t, z, out = numba.carray(t, 8), numba.carray(z, (2, 8)), numba.carray(out, (2, 8))
        for i in range(8):
            out[0, i] = z[1, i]
            if t[i] < 5.0:
                out[1, i] = -z[0, i]

    for function in (rate, rates):
        for method in ("gauss12", "rk4"):
            system = spim.FlowSystem(2, function)
            with pytest.raises(spim.ModelError, match="rate: component 1 is nan at t = 5") as found:
                spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.25, method=method)
            # Steps of a quarter: of rk4 the last stage is at 5 already, of Gauss all are inside.
            assert found.value.step == (20 if method == "gauss12" else 19)
            assert len(found.value.partial.t) == found.value.step + 1
            assert np.isfinite(found.value.partial.z).all()


def test_compiled_functions_live_as_long_as_their_system():
    def made():
        @ONE
        def rate(t, z, out):
            out[0], out[1] = z[1], -z[0]

        return spim.FlowSystem(2, rate), weakref.ref(rate)

    system, rate = made()
    gc.collect()
    spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1)
    assert rate() is not None
    del system
    gc.collect()
    assert rate() is None


def test_an_object_that_holds_a_system_of_its_own_methods_is_collected():
    class Owner:
        def __init__(self):
            self.system = spim.FlowSystem(2, self.rate)
            spim.integrate(self.system, [1.0, 0.0], (0.0, 1.0), 0.1)

        def rate(self, t, z):
            return [z[1], -z[0]]

    owner = weakref.ref(Owner())
    gc.collect()
    assert owner() is None


class Odd(Exception):
    """An exception of the user's."""


class OddBase(BaseException):
    """One that `except Exception` does not see."""


def failing_at(k, failure, form="plain"):
    """A rate whose call number k fails."""
    calls = [0]

    def fails():
        calls[0] += 1
        if calls[0] == k:
            return failure()
        return None

    def returning(t, z):
        found = fails()
        return plain(t, z) if found is None else found

    def vectorised(t, z):
        found = fails()
        return array(t, z) if found is None else found

    def into(t, z, out):
        fails()
        writing(t, z, out)

    return {"plain": returning, "vectorised": vectorised, "writing": into}[form]


@pytest.mark.parametrize("form", ["plain", "vectorised", "writing"])
@pytest.mark.parametrize("kind", [Odd, OddBase, SystemExit, KeyboardInterrupt])
def test_an_exception_at_any_call_reaches_the_caller_as_it_is(kind, form):
    whole = run(plain, "gauss8").z
    for k in range(1, 201):
        error = kind("mine")

        def failure(error=error):
            raise error

        rate = failing_at(k, failure, form)
        with pytest.raises(BaseException, match="mine") as found:
            run(rate, "gauss8", vectorized=form == "vectorised")
        assert found.value is error
        partial = error.partial
        # States up to the failure are those of an undisturbed run.
        assert 1 <= len(partial.t) < len(whole)
        assert (partial.z == whole[: len(partial.t)]).all()
        assert not partial.success


NEEDS = {
    "flow": lambda f: spim.FlowSystem(4, f),
    "semilinear": lambda f: spim.SemilinearSystem(np.zeros((4, 4)), f),
    "split": lambda f: spim.SeparableSystem(lambda t, q: f(t, np.r_[q, q])[2:], mass=[1.0, 1.0]),
}


@pytest.mark.parametrize(
    "record", [r for r in spim.methods() if r.needs in NEEDS], ids=lambda record: record.name
)
def test_an_exception_leaves_the_states_of_any_method_as_they_were(record):
    def walk(rate):
        system = NEEDS[record.needs](rate)
        return spim.integrate(system, Z0, SPAN, 0.25, method=record.name)

    calls = [0]

    def counted(t, z):
        calls[0] += 1
        return plain(t, z)

    try:
        whole = walk(counted).z
    except spim.UnsupportedError:
        pytest.skip("needs more of the system")
    for k in {1, 2, calls[0] // 3, calls[0] // 2, calls[0] - 1, calls[0]}:
        error = Odd("mine")

        def failure(error=error):
            raise error

        with pytest.raises(Odd) as found:
            walk(failing_at(k, failure))
        assert found.value is error
        assert (error.partial.z == whole[: len(error.partial.t)]).all()
        assert len(error.partial.t) < len(whole)


def test_an_exception_is_returned_on_request_but_not_what_ends_a_program():
    def fails():
        raise Odd("mine")

    system = spim.FlowSystem(4, failing_at(100, fails))
    made = spim.integrate(system, Z0, SPAN, 0.25, method="gauss8", throw=False)
    assert not made.success
    assert isinstance(made.error, Odd)
    assert made.message == "mine"
    assert 1 < len(made.t) < 41

    def exits():
        raise SystemExit(3)

    system = spim.FlowSystem(4, failing_at(100, exits))
    with pytest.raises(SystemExit):
        spim.integrate(system, Z0, SPAN, 0.25, method="gauss8", throw=False)


@pytest.mark.parametrize("form", ["plain", "vectorised"])
@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    [
        ([1.0, np.nan, 0.0, 0.0], spim.ModelError, "component 1 is nan at t = "),
        ([1.0, 0.0, -np.inf, 0.0], spim.ModelError, "component 2 is -inf at t = "),
        ([1.0, 2.0, 3.0], ValueError, r"rate: must give \d+ numbers"),
        ([[1.0, 2.0, 3.0, 4.0]], ValueError, r"rate: must give \d+ numbers"),
        (1.0, ValueError, r"rate: must give \d+ numbers"),
        ([1.0, 0.0, 1j, 0.0], TypeError, "rate: must be real"),
        (["a", 0.0, 0.0, 0.0], TypeError, "rate: needs an array of numbers"),
        ([[1.0], 2.0, 3.0, 4.0], ValueError, "rate"),
        ({}, TypeError, "rate: needs an array of numbers"),
        (b"1234", TypeError, "rate: needs an array of numbers"),
    ],
)
def test_a_wrong_result_at_any_call_is_named(wrong, error, words, form):
    if form == "vectorised" and isinstance(wrong, list) and error is spim.ModelError:
        wrong = np.array(wrong)[:, None] * np.ones(4)
    for k in range(1, 201):
        with pytest.raises(error, match=words) as found:
            run(failing_at(k, lambda: wrong, form), "gauss8", vectorized=form == "vectorised")
        assert len(found.value.partial.t) >= 1


def test_none_is_named_with_what_to_do():
    with pytest.raises(TypeError, match="rate: returned None at t = 0.*third argument"):
        spim.integrate(
            spim.FlowSystem(2, lambda t, z: None), [1.0, 0.0], (0.0, 1.0), 0.1, method="rk4"
        )


@pytest.mark.parametrize(
    "result",
    [
        lambda z: (z[1], -z[0]),
        lambda z: [float(z[1]), int(-z[0])],
        lambda z: np.array([z[1], -z[0]], dtype=np.longdouble),
        lambda z: np.array([z[1], 0.0, -z[0], 0.0])[::2],
        lambda z: np.array([z[1], -z[0]]).astype(">f8"),
    ],
)
def test_numbers_may_come_in_any_form(result):
    at = [2.0, 0.0]
    made = spim.integrate(
        spim.FlowSystem(2, lambda t, z: result(np.round(z))), at, (0.0, 1.0), 0.5, method="rk4"
    )
    wanted = spim.integrate(
        spim.FlowSystem(2, lambda t, z: [np.round(z[1]), -np.round(z[0])]),
        at,
        (0.0, 1.0),
        0.5,
        method="rk4",
    )
    assert (made.z == wanted.z).all()


def test_control_c_inside_a_function_ends_the_run():
    for k in (1, 2, 57, 200):
        rate = failing_at(k, lambda: signal.raise_signal(signal.SIGINT))
        with pytest.raises(KeyboardInterrupt) as found:
            run(rate, "gauss8")
        assert 1 <= len(found.value.partial.t) < 41


@pytest.mark.parametrize("function", [array, one])
def test_control_c_from_outside_ends_a_long_run(function):
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    system = spim.FlowSystem(4, function)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt) as found:
            spim.integrate(system, Z0, (0.0, 1e9), 0.25, method="gauss8", every=1_000_000_000)
    finally:
        timer.cancel()
    assert found.value.partial.error is found.value


def misbehaving(keeps, change):
    """A writing rate that keeps its arrays, and changes those it was given before."""

    def rate(t, z, out):
        writing(t, z, out)
        z[:] = 7.0
        keeps.append((z, out[:], memoryview(out)) if len(keeps) % 2 else (z, out))
        change(keeps[-3:-1])

    return rate


def later(kept):
    for z, out, *_ in kept:
        z[:], out[:] = np.nan, np.nan


def test_arrays_that_are_kept_or_changed_do_no_harm():
    wanted = run(plain, "gauss8").z
    keeps = []
    assert (run(misbehaving(keeps, later), "gauss8").z == wanted).all()
    assert len({id(out) for _, out, *_ in keeps}) == len(keeps)
    keeps.clear()
    assert (run(misbehaving(keeps, later), "gauss8", vectorized=True).z == wanted).all()

    def frozen(t, z, out):
        writing(t, z, out)
        z.flags.writeable = out.flags.writeable = False

    def grown(t, z, out):
        writing(t, z, out)
        # Other memory, another size: nobody else may be given this.
        z.resize(1000, refcheck=False)

    for function in (frozen, grown):
        assert (run(function, "gauss8").z == wanted).all()

    def shrunk(t, z, out):
        writing(t, z, out)
        out.resize(2, refcheck=False)

    with pytest.raises(ValueError, match="`out` has another shape"):
        run(shrunk, "gauss8")


@pytest.mark.parametrize("form", ["plain", "vectorised", "writing"])
def test_nothing_leaks_in_failing_runs(form):
    error = Odd("mine")

    def failure():
        raise error

    def fails(k):
        rate = failing_at(k, failure, form)
        system = spim.FlowSystem(4, rate, vectorized=form == "vectorised")
        try:
            spim.integrate(system, z0, SPAN, 0.25, method="gauss8")
        except Odd as found:
            found.partial = None
            found.__traceback__ = None

    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    z0 = np.array(Z0)
    watched = [error, failure, z0, plain, None.__class__, Odd]
    for k in range(2000):
        fails(1 + k % 20)
    gc.collect()
    before = [sys.getrefcount(x) for x in watched]
    memory = resident() if sys.platform == "linux" else 0
    for k in range(10_000):
        fails(1 + k % 20)
    gc.collect()
    after = [sys.getrefcount(x) for x in watched]
    assert after == before
    if sys.platform == "linux":
        # 100 bytes a run would be 1 MB.
        assert resident() - memory <= 1_000_000


@pytest.mark.parametrize("form", FORMS)
def test_ten_threads_have_the_bits_of_one(form):
    function, options = FORMS[form]
    system = spim.FlowSystem(4, function, **options)

    def work(_):
        return spim.integrate(system, Z0, SPAN, 0.25, method="gauss12").z

    wanted = work(0)
    with ThreadPoolExecutor(10) as pool:
        assert all((z == wanted).all() for z in pool.map(work, range(20)))


def test_a_function_may_integrate_itself():
    wanted = run(plain, "gauss8", step=1.0).z
    depth = [0]

    def rate(t, z, out):
        if depth[0] < 1:
            depth[0] += 1
            inner = spim.integrate(system, Z0, (0.0, 2.0), 1.0, method="gauss8").z
            depth[0] -= 1
            assert (inner == wanted[:3]).all()
        writing(t, z, out)

    system = spim.FlowSystem(4, rate)
    assert (spim.integrate(system, Z0, (0.0, 3.0), 1.0, method="gauss8").z == wanted[:4]).all()


def stiff(**given):
    """A pendulum of stiff spring: fixed-point iterations do not converge at this step."""

    def gradient(t, z):
        x, a, px, pa = z
        return [1e4 * x - a * a, np.sin(a) - 2.0 * a * x, px, pa]

    return spim.HamiltonianSystem(2, gradient, **given)


def stiff_hessian(t, z):
    x, a, _, _ = z
    H = np.diag([1e4, np.cos(a) - 2.0 * x, 1.0, 1.0])
    H[0, 1] = H[1, 0] = -2.0 * a
    return H


def test_a_given_hessian_spares_differences():
    calls = [0]

    def hessian(t, z):
        calls[0] += 1
        return stiff_hessian(t, z)

    z0 = [1e-4, 0.5, 0.0, 0.0]
    without = spim.integrate(stiff(), z0, (0.0, 5.0), 0.05, method="gauss8")
    given = spim.integrate(stiff(hessian=hessian), z0, (0.0, 5.0), 0.05, method="gauss8")
    assert calls[0] >= 99
    # Differences are 5 rates a step.
    assert given.stats["evaluations"] <= without.stats["evaluations"] - 4 * 99
    assert np.abs(given.z - without.z).max() <= 1e-12
    assert np.abs(spim.linearize(stiff(hessian=hessian), z0)[2:, :2]).max() == 1e4


def test_a_named_linear_part_spares_iterations_and_changes_nothing():
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 0] = A[3, 1] = -1.0
    with_part = run(array, linear=A)
    without = run(array)
    assert with_part.stats["evaluations"] <= 0.8 * without.stats["evaluations"]
    assert np.abs(with_part.z - without.z).max() <= 1e-14


def test_linearisation_is_that_of_the_formulas():
    z = np.array([0.3, -0.2, 0.1, 0.4])
    x, y = z[:2]
    exact = np.zeros((4, 4))
    exact[0, 2] = exact[1, 3] = 1.0
    exact[2:, :2] = [[-1.0 - 2.0 * y, -2.0 * x], [-2.0 * x, -1.0 + 2.0 * y]]
    for system in (spim.models.HenonHeiles(), spim.FlowSystem(4, plain), spim.FlowSystem(4, one)):
        assert np.abs(spim.linearize(system, z) - exact).max() <= 1e-13
    given = spim.FlowSystem(4, plain, jacobian=lambda t, z: exact)
    assert (spim.linearize(given, z) == exact).all()
    assert (spim.linearize(spim.LinearSystem(exact), z) == exact).all()
    A = np.diag([1.0, 2.0, 3.0, 4.0])
    semilinear = spim.SemilinearSystem(A, plain, jacobian=lambda t, z: exact)
    assert (spim.linearize(semilinear, z) == A + exact).all()
    timed = spim.FlowSystem(1, lambda t, z: [np.exp(z[0]) * t])
    assert abs(spim.linearize(timed, [1.0], t=2.0)[0, 0] - 2.0 * math.e) <= 1e-12
    kepler = spim.models.Kepler()
    A = spim.linearize(kepler, [1.0, 0.0, 0.0, 1.2])
    assert np.abs(A[2:, :2] - [[2.0, 0.0], [0.0, -1.0]]).max() <= 1e-11
    with pytest.raises(ValueError, match="z: must have shape"):
        spim.linearize(kepler, [1.0])
    with pytest.raises(spim.ModelError, match="not finite"):
        spim.linearize(spim.models.Kepler(), [0.0, 0.0, 0.0, 0.0])


def test_the_linearisation_of_a_beam_has_its_frequencies():
    section = spim.models.DistributedSection(1.2, 2.8e7, 1.4e4)
    beam = spim.models.RotatingBeam(length=8.0, section=section, elements=3, hub_inertia=100.0)
    A = spim.linearize(beam, np.zeros(beam.size))
    found = np.sort(np.linalg.eigvals(A).imag)
    wanted = np.sort(beam.modal(hub="free").frequencies)
    found = found[len(found) // 2 :]
    assert np.abs(found[1:] / wanted[1:] - 1.0).max() <= 1e-9


def test_a_system_split_about_a_state_is_the_same_motion():
    double = spim.models.DoublePendulum()
    z0 = [0.4, -0.3, 0.1, 0.2]
    split = spim.SemilinearSystem.about(double, [0.0] * 4)
    wanted = spim.integrate(double, z0, (0.0, 2.0), 0.01, method="gauss16")
    made = spim.integrate(split, z0, (0.0, 2.0), 0.01, method="lawson_gauss8")
    assert np.abs(made.z - wanted.z).max() <= 1e-11
    assert np.abs(made.energy / wanted.energy[0] - 1.0).max() <= 1e-11
    auto = spim.integrate(split, z0, (0.0, 2.0), 0.01)
    assert auto.method.startswith("lawson_gauss")
    # About a state that is no equilibrium, and of functions.
    split = spim.SemilinearSystem.about(spim.FlowSystem(4, plain), Z0)
    made = spim.integrate(split, Z0, SPAN, 0.05, method="lawson_gauss8")
    assert np.abs(made.z[-1] - run(plain, step=0.05).z[-1]).max() <= 1e-11
    assert split.linear.shape == (4, 4)
    again = pickle.loads(pickle.dumps(spim.SemilinearSystem.about(double, [0.0] * 4)))
    assert (again.linear == spim.linearize(double, [0.0] * 4)).all()
    with pytest.raises(spim.UnsupportedError, match="no energy"):
        _ = made.energy


x, y, px, py, k, time = sympy.symbols("x y p_x p_y k t")
HENON_HEILES = (px**2 + py**2 + x**2 + k * y**2) / 2 + x**2 * y - y**3 / 3


@pytest.mark.parametrize("compiled", [True, False])
def test_symbols_make_a_separable_system_with_its_linear_part(compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    system = spim.from_sympy(HENON_HEILES, [x, y], [px, py], {k: 1.0})
    assert isinstance(system, spim.SeparableSystem)
    assert (system.linear == [[0, 0, 1, 0], [0, 0, 0, 1], [-1, 0, 0, 0], [0, -1, 0, 0]]).all()
    native = spim.models.HenonHeiles()
    for method in ("gauss16", "gauss24", "yoshida8", "lawson_gauss8", "rk4"):
        made = spim.integrate(system, Z0, SPAN, 0.1, method=method)
        wanted = spim.integrate(native, Z0, SPAN, 0.1, method=method)
        assert np.abs(made.z - wanted.z).max() <= 2e-14, method
        assert np.abs(made.energy - wanted.energy).max() <= 1e-15
    assert np.abs(spim.linearize(system, Z0) - spim.linearize(native, Z0)).max() <= 1e-13
    again = pickle.loads(pickle.dumps(system))
    assert (spim.integrate(again, Z0, SPAN, 0.1).z == spim.integrate(system, Z0, SPAN, 0.1).z).all()


@pytest.mark.parametrize("compiled", [True, False])
def test_symbols_that_mix_coordinates_and_momenta_make_a_semilinear_system(compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    m, length = sympy.symbols("m l")
    H = px**2 / (2 * m * length**2 * (1 + sympy.sin(y) ** 2)) + py**2 / 2 - m * sympy.cos(x) + y**2
    system = spim.from_sympy(H, [x, y], [px, py], {m: 0.1, length: 1 / 3})
    assert isinstance(system, spim.SemilinearSystem)
    # Parameters keep all their digits: a third has 17.
    assert system.linear[0, 2] == pytest.approx(1.0 / (0.1 * (1 / 3) ** 2), rel=1e-15)
    z0 = [0.6, 0.2, 0.001, 0.1]
    runs = [
        spim.integrate(system, z0, (0.0, 2.0), 0.01, method=method)
        for method in ("gauss16", "lawson_gauss8")
    ]
    assert np.abs(runs[0].z - runs[1].z).max() <= 1e-11
    assert np.abs(runs[0].energy / runs[0].energy[0] - 1.0).max() <= 1e-14
    plain_system = spim.FlowSystem(4, lambda t, z: system.rate(z, t))
    difference = spim.linearize(system, z0) - spim.linearize(plain_system, z0)
    assert np.abs(difference).max() <= 1e-9


def test_symbols_without_an_equilibrium_make_a_hamiltonian_system():
    H = (px**2 + py**2) / 2 - 1 / sympy.sqrt(x**2 + y**2) + px * y / 10
    system = spim.from_sympy(H, [x, y], [px, py])
    assert isinstance(system, spim.HamiltonianSystem)
    made = spim.integrate(system, [1.0, 0.0, 0.0, 1.2], SPAN, 0.02, method="gauss16")
    assert np.abs(made.energy / made.energy[0] - 1.0).max() <= 1e-14


@pytest.mark.parametrize("compiled", [True, False])
def test_symbols_may_have_kinks(compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    H = px**2 / 2 + abs(x) * x**2 / 3 + sympy.sqrt(x**2)
    system = spim.from_sympy(H, [x], [px], equilibrium=None)
    assert (system.rate([-2.0, 0.5]) == [0.5, 5.0]).all()
    assert (system.rate([2.0, 0.5]) == [0.5, -5.0]).all()
    assert system.energy([-2.0, 0.5]) == pytest.approx(0.125 + 8.0 / 3.0 + 2.0, abs=1e-15)


def test_symbols_may_hold_time_and_another_equilibrium():
    H = px**2 / 2 - sympy.cos(x) + x**2 * sympy.cos(time) / 10
    system = spim.from_sympy(H, x, px, t=time)
    function = spim.HamiltonianSystem(
        1, lambda t, z: [math.sin(z[0]) + z[0] * math.cos(t) / 5, z[1]]
    )
    made = spim.integrate(system, [1.0, 0.0], SPAN, 0.1, method="gauss16")
    wanted = spim.integrate(function, [1.0, 0.0], SPAN, 0.1, method="gauss16")
    assert np.abs(made.z - wanted.z).max() <= 1e-13
    upright = spim.from_sympy(px**2 / 2 + sympy.cos(x), [x], [px], equilibrium=[math.pi, 0.0])
    assert np.abs(upright.linear - [[0.0, 1.0], [-1.0, 0.0]]).max() <= 1e-15
    exact = spim.integrate(upright, [3.0, 0.0], SPAN, 0.1, method="gauss16").z
    made = spim.integrate(upright, [3.0, 0.0], SPAN, 0.1, method="lawson_gauss8").z
    assert np.abs(made - exact).max() <= 1e-11


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: spim.from_sympy(HENON_HEILES, [x, y], [px, py]), "parameters: no number for k"),
        (lambda: spim.from_sympy(x**2, [x, y], [px]), "q, p: must be as many"),
        (lambda: spim.from_sympy(x + px**2, [x], [px], equilibrium=[0, 0]), "equilibrium"),
        (lambda: spim.from_sympy(x**2, [x], [px], equilibrium=[0]), "equilibrium: must have"),
        (lambda: spim.from_sympy(sympy.Function("f")(x), [x], [px]), "H: no code"),
        (lambda: spim.from_sympy(sympy.airyai(x), [x], [px]), "H: no code"),
        (lambda: spim.from_sympy(k * x**2, [x], [px], {k: math.nan}), "parameters: must be finite"),
    ],
)
def test_symbols_that_make_no_system_are_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_symbols_need_sympy(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(ImportError, match="needs sympy"):
        spim.from_sympy(x, [x], [px])
