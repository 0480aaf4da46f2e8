"""Methods as classes for ``scipy.integrate.solve_ivp``."""

import ctypes
import difflib
import warnings

import numpy as np

from spim import _core
from spim._functions import FlowSystem, SeparableSystem
from spim._integrate import _number
from spim._methods import methods

try:
    from scipy import LowLevelCallable
    from scipy.integrate import DenseOutput, OdeSolver
except ImportError as error:
    raise ImportError(
        "classes for scipy.integrate.solve_ivp need SciPy; spim.integrate does not"
    ) from error

# What solve_ivp's users give to methods that choose their steps.
OF_TOLERANCE = ("rtol", "atol", "first_step", "max_step")

# Of a compiled function, without names and blanks; with user data.
SIGNATURES = ("void(double,double*,double*)", "void(double,double*,double*,void*)")


class FixedStep(OdeSolver):
    """A method of spim for ``solve_ivp(fun, t_span, y0, method=..., step=...)``.

    Parameters
    ----------
    fun : callable or scipy.LowLevelCallable
        ``fun(t, y) -> (n,)``; compiled: ``void (double t, double *y, double *out)``, with a ``void
        *user_data`` after these if it has some. Other compiled functions SciPy wraps, so that
        they must come as one: a numba cfunc ``f`` as ``scipy.LowLevelCallable(f.ctypes)``. y is
        (n,), in units of its own.
    step : float
        Positive. The span is divided into equal steps of this size or, where it is no multiple,
        ``ceil(span / step)`` smaller ones; they end at its end exactly.
    **options
        Of the method; see ``spim.methods()``. `rtol`, `atol`, `first_step` and `max_step` are
        warned of, others are a TypeError.

    States between steps, for `t_eval`, `dense_output` and `events`, are steps of the method itself
    from the one before: of its order, and calls of `fun`. An exception of `fun` passes as it is; a
    state that is not finite or a step that is not solved ends the run with status -1, a message
    and what there is by then.

    Raises
    ------
    TypeError
        No `step`; an option the method does not have, with the nearest one.
    ValueError
        A step that is not positive, a compiled function of another signature.
    """

    _method = ""

    def __init__(self, fun, t0, y0, t_bound, vectorized=False, *, step=None, **options):
        self._check(step, options)
        compiled = isinstance(fun, LowLevelCallable)
        super().__init__(_called(fun) if compiled else fun, t0, y0, t_bound, vectorized)
        self._h, self._count, _ = _core.grid(t0, t_bound, _number("step", step))
        self._options, self._begin, self._k = options, t0, 0
        self._raised = self._walker = self._made = None
        self._compiled = fun if compiled else None

    def _check(self, step, options):
        """Options by their names."""
        name = type(self).__name__
        for given in OF_TOLERANCE:
            if given in options:
                del options[given]
                warnings.warn(
                    f"{given}: has no effect on spim.{name}, whose step is fixed", stacklevel=4
                )
        record = next(m for m in methods() if self._method in (m.name, *m.aliases))
        known = ["step", *record.options]
        for given in options:
            if given not in known:
                nearest = difflib.get_close_matches(given, known, 1, 0.0)[0]
                raise TypeError(f"spim.{name}: no option '{given}'; did you mean '{nearest}'?")
        if step is None:
            raise TypeError(f"step: is needed: solve_ivp(..., method=spim.{name}, step=0.01)")

    def _rate(self, t, y):
        """What `fun` gives; an exception of its own is kept, to be told from others."""
        try:
            rate = np.asarray(self.fun(t, y))
            if rate.shape != (self.n,):
                raise ValueError(f"fun: must have shape ({self.n},), got {rate.shape}")
        except BaseException as error:
            self._raised = error
            raise
        return rate

    def _system(self):
        """The system as the core holds it."""
        # A compiled function is called without the interpreter.
        return FlowSystem(self.n, self._compiled or self._rate)._core

    def _walk(self, t, y, h):
        if self._made is None:
            self._made = self._system()
        return _core.Walker(self._made, None, None, y, t, h, self._method, self._options)

    def _refuse(self):
        """Why the method cannot treat the system, if so."""

    def _guard(self, call):
        """What `call` gives, and a sentence where it fails; exceptions of `fun` pass."""
        self._raised = None
        try:
            return call(), None
        except Exception as error:
            if error is self._raised:
                raise
            return None, str(error)

    def _step_impl(self):
        if self._walker is None:
            refused = self._refuse()
            if refused is not None:
                return False, refused
            self._walker = self._walk(self.t, self.y, self._h)
        y, failure = self._guard(self._walker.step)
        if failure is not None:
            return False, failure
        self._k += 1
        self.nfev = max(self.nfev, self._walker.evaluations)
        self._y_old, self.y = self.y, y
        last = self._k == self._count
        self.t = self.t_bound if last else self._begin + self._k * self._h
        return True, None

    def _dense_output_impl(self):
        return Within(self.t_old, self.t, self._y_old, self.y, self._walk)


class Within(DenseOutput):
    """States within a step: steps of the method of their own."""

    def __init__(self, t_old, t, y_old, y, walk):
        super().__init__(t_old, t)
        self._y_old, self._y, self._walk = y_old, y, walk

    def _call_impl(self, t):
        if t.ndim == 0:
            return self._at(float(t))
        return np.array([self._at(float(x)) for x in t]).reshape(-1, len(self._y)).T

    def _at(self, t):
        if t == self.t:
            return self._y.copy()
        if t == self.t_old:
            return self._y_old.copy()
        return self._walk(self.t_old, self._y_old, t - self.t_old).step()


class Split(FixedStep):
    """Explicit methods, for ``y = [q; v]`` and ``fun = [g(v), h(t, q)]``.

    Whether q' changes with q or t, or v' with v, is tried at the first step.
    """

    def __init__(self, fun, t0, y0, t_bound, vectorized=False, *, step=None, **options):
        super().__init__(fun, t0, y0, t_bound, vectorized, step=step, **options)
        self._half, odd = divmod(self.n, 2)
        if odd:
            raise ValueError(
                f"y0: spim.{type(self).__name__} needs y = [q; v], got {self.n} components; "
                "spim.Gauss6 takes any"
            )

    def _system(self):
        n, y = self._half, self.y

        def force(t, q):
            return self._rate(t, np.concatenate([q, y[n:]]))[n:]

        def velocity(v):
            return self._rate(self._begin, np.concatenate([y[:n], v]))[:n]

        return SeparableSystem(force, velocity=velocity, dof=n)._core

    def _refuse(self):
        n, t, y = self._half, self.t, self.y
        # Beside the start, where something may be at rest.
        aside = 1e-3 * (1.0 + np.abs(y)) * np.cos(1.0 + np.arange(2.0 * n))
        near, far = y + aside, y - aside
        here = self._rate(t, near.copy())
        by_q = self._rate(t, np.concatenate([far[:n], near[n:]]))
        by_v = self._rate(t, np.concatenate([near[:n], far[n:]]))
        by_t = self._rate(t + 0.37 * self._h, near)
        name = type(self).__name__
        for what, changed in (
            ("q' changes with q", by_q[:n] != here[:n]),
            ("v' changes with v", by_v[n:] != here[n:]),
            ("q' changes with t", by_t[:n] != here[:n]),
        ):
            if changed.any():
                return (
                    f"spim.{name} needs y = [q; v], fun = [g(v), h(t, q)], but {what} "
                    f"(component {int(np.argmax(changed))}); spim.Gauss6 takes any"
                )
        return None


def _called(compiled):
    """A compiled function as one of Python's."""
    signature = compiled.signature
    plain = "".join(signature.replace("const", "").split())
    if plain not in SIGNATURES:
        raise ValueError(
            "fun: must have the signature 'void (double, double *, double *)', with 'void *' after "
            f"these for user data, got '{signature}'"
        )
    api = ctypes.pythonapi
    pointer, context = api.PyCapsule_GetPointer, api.PyCapsule_GetContext
    pointer.argtypes, pointer.restype = [ctypes.py_object, ctypes.c_char_p], ctypes.c_void_p
    context.argtypes, context.restype = [ctypes.py_object], ctypes.c_void_p
    capsule = tuple.__getitem__(compiled, 0)
    arguments = [ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
    data = []
    if plain == SIGNATURES[1]:
        arguments.append(ctypes.c_void_p)
        data.append(context(capsule))
    call = ctypes.CFUNCTYPE(None, *arguments)(pointer(capsule, signature.encode()))

    def fun(t, y):
        y = np.ascontiguousarray(y)
        out = np.full(len(y), np.nan)
        call(t, y.ctypes.data, out.ctypes.data, *data)
        return out

    # As long as it may be called.
    fun.compiled = compiled
    return fun


def _class(name, base, method, summary):
    doc = f"{summary}\n\n{base.__doc__ if base is Split else FixedStep.__doc__}"
    return type(name, (base,), {"_method": method, "__doc__": doc, "__module__": __name__})


Gauss2 = _class("Gauss2", FixedStep, "gauss2", "Implicit midpoint rule, symplectic, of order 2.")
Gauss4 = _class("Gauss4", FixedStep, "gauss4", "Gauss collocation, symplectic, of order 4.")
Gauss6 = _class("Gauss6", FixedStep, "gauss6", "Gauss collocation, symplectic, of order 6.")
Gauss8 = _class("Gauss8", FixedStep, "gauss8", "Gauss collocation, symplectic, of order 8.")
Gauss16 = _class("Gauss16", FixedStep, "gauss16", "Gauss collocation, symplectic, of order 16.")
Verlet = _class("Verlet", Split, "verlet", "Störmer-Verlet, explicit, symplectic, of order 2.")
Yoshida4 = _class("Yoshida4", Split, "yoshida4", "Composition of Verlet steps, of order 4.")
Yoshida6 = _class("Yoshida6", Split, "yoshida6", "Composition of Verlet steps, of order 6.")
Yoshida8 = _class("Yoshida8", Split, "yoshida8", "Composition of Verlet steps, of order 8.")
