"""Nonlinear systems given as functions."""

import functools
import inspect

import numpy as np

from spim import _core
from spim._arrays import cholesky, finite, matrix, symmetric
from spim._calls import _writes, given, is_compiled, times_and_states
from spim._choice import along, collocation
from spim._core import UnsupportedError
from spim._linearize import linearize, stepped
from spim._systems import System

# What parts are called by their users, where it is not what the core calls them.
NAMES = {"kick": "force"}


class _Called(System):
    """A system of functions; the core makes it anew for each process."""

    _kind = ""
    _inverse = None
    # What is true of a symmetric and symplectic method on it.
    _kept = "symplectic"
    # What makes the system anew where its functions cannot be pickled.
    _recipe = None

    def _take(self, functions, linear=None, args=(), vectorized=False):
        """Keeps functions: part -> (function, components given, shape of the result)."""
        if not isinstance(args, tuple):
            raise TypeError(f"args: must be a tuple, got {type(args).__name__}")
        self._functions = {
            part: given(
                NAMES.get(part, part),
                function,
                inputs,
                outputs,
                args=args,
                vectorized=bool(vectorized),
            )
            for part, (function, inputs, outputs) in functions.items()
            if function is not None
        }
        for part in ("hessian", "jacobian"):
            # Of one state in any case.
            if part in self._functions:
                self._functions[part]["vectorized"] = False
        self._linear_part = linear

    def __getstate__(self):
        return {name: value for name, value in self.__dict__.items() if name != "_made"}

    def __reduce__(self):
        if self._recipe is not None:
            return self._recipe
        return super().__reduce__()

    @property
    def _core(self):
        if "_made" not in self.__dict__:
            self._made = _core.Called(self._kind, self._functions, self._linear_part, self._inverse)
        return self._made

    def _matrices(self):
        """None of a linear structure's."""

    def _chosen(self, step):
        if len(self._spectrum):
            return along(self._spectrum, self._kept, step)
        if self._linear_part is not None:
            return collocation(f"{self._kept}; the linear part solved within the iterations")
        return collocation(self._kept)

    @functools.cached_property
    def _spectrum(self):
        linear = self.__dict__.get("_linear")
        return np.zeros(0, complex) if linear is None else np.linalg.eigvals(linear.A)

    def rate(self, z, t=0.0):
        """``z'`` of states, (..., m) -> (..., m)."""
        times, states, shape = times_and_states(z, t, self.size)
        return _core.rates(self._core, times, states).reshape(*shape, self.size)

    def energy(self, z, t=0.0):
        """Energy of states, (..., m) -> (...).

        Raises
        ------
        UnsupportedError
            The system was made without a function for it.
        """
        if not self._has_energy:
            raise UnsupportedError(f"{type(self).__name__}: no energy was given")
        times, states, shape = times_and_states(z, t, self.size)
        return self._energies(times, states).reshape(shape)

    def _energy_at(self, z, t):
        return self.energy(z, t)

    @property
    def _has_energy(self):
        return "potential" in self._functions

    def _values(self, part, times, states):
        return self._core.values(part, times, np.ascontiguousarray(states))[:, 0]

    def __repr__(self):
        return f"{type(self).__name__}({self.size} states)"


def _dof(dof, name="dof"):
    if isinstance(dof, bool) or not isinstance(dof, int | np.integer) or dof < 1:
        raise ValueError(f"{name}: must be a positive whole number, got {dof!r}")
    return int(dof)


class FlowSystem(_Called):
    """``z' = rate(t, z)``: any system, of which no more is known.

    Parameters
    ----------
    size : int
        Length m of the state.
    rate : callable or compiled function
        ``rate(t, z) -> (m,)``, or ``rate(t, z, out)``; see the notes.
    jacobian : callable or compiled function, optional
        ``jacobian(t, z) -> (m, m)``, row by row where it is compiled.
    linear : array_like (m, m), optional
        A constant part of the Jacobian, which implicit methods solve for within their iterations:
        it says how fast they converge, not what they converge to.
    args : tuple
        What Python functions are given after ``t, z``, or ``t, z, out``.
    vectorized : bool
        Functions (but Jacobians and Hessians) take many states at once: t (k,), z (m, k) -> (m, k).
        Implicit methods then make one call an iteration, of the stages alone. k differs from call
        to call, and times are in no order.

    Notes
    -----
    Functions of all systems may be

    - Python's; whether they return or write their result is told by their signature, once. Arrays
      they are given are theirs to keep and to change;
    - compiled: what ``@numba.cfunc(spim.cfunc_signature())`` makes, a ``scipy.LowLevelCallable``
      (with its user data), or a ctypes pointer with ``argtypes``. The signature
      ``void(double t, double* z, double* out)``, or of eight states as `cfunc_signature` has it, is
      checked; a pair is a function of one state and one of eight. They are kept alive with the
      system and called without the interpreter.

    Exceptions reach the caller of `integrate` as they are. A result that is not finite is a
    `ModelError`, one of another shape a ValueError; both come with the run, from its first call.

    Raises
    ------
    ValueError
        A size that is none, a matrix of another size, a compiled function of another signature.
    TypeError
        What is no function; `args` or `vectorized` with a compiled one.

    Examples
    --------
    >>> import spim
    >>> damped = spim.FlowSystem(2, lambda t, z: [z[1], -z[0] - z[0] ** 3 - 0.1 * z[1]])
    >>> run = spim.integrate(damped, [1.0, 0.0], (0.0, 10.0), 0.1)
    >>> run.method
    'gauss16 (auto: of order 16, symmetric)'
    """

    _kind = "flow"
    _kept = "symmetric"

    def __init__(self, size, rate, *, jacobian=None, linear=None, args=(), vectorized=False):
        m = self._size = _dof(size, "size")
        linear = None if linear is None else matrix("linear", linear, m)
        functions = {"rate": (rate, m, (m,)), "jacobian": (jacobian, m, (m, m))}
        self._take(functions, linear, args, vectorized)

    @property
    def size(self):
        """Length m of the state."""
        return self._size


class HamiltonianSystem(_Called):
    """``q' = dH/dp``, ``p' = -dH/dq`` by the gradient of H, for implicit methods.

    Units are those of its functions; ``z = [q; p]`` holds momenta, not velocities.

    Parameters
    ----------
    dof : int
        n, the number of coordinates.
    gradient : callable or compiled function
        ``gradient(t, z) -> (2 n,)``, or ``gradient(t, z, out)``: dH/dz of ``z = [q; p]``. Functions
        may be compiled; see `FlowSystem`.
    hamiltonian : callable or compiled function, optional
        ``hamiltonian(t, z) -> float``, for ``solution.energy``; compiled, it writes ``out[0]``.
    hessian : callable or compiled function, optional
        ``hessian(t, z) -> (2 n, 2 n)``: d2H/dz2, for `linearize`, and for implicit steps of stiff
        systems, which else take differences.
    linear : array_like (2 n, 2 n), optional
        A constant part of the rates' Jacobian ``d z'/d z`` (not of the Hessian), which implicit
        methods solve for within their iterations: it says how fast they converge, not what to.
    args, vectorized
        As in `FlowSystem`.

    Raises
    ------
    ValueError, TypeError
        As in `FlowSystem`. That `gradient` is the gradient of `hamiltonian` is not checked: an
        energy that drifts tells.

    Examples
    --------
    >>> import numpy as np
    >>> import spim
    >>> pendulum = spim.HamiltonianSystem(
    ...     1,
    ...     lambda t, z: [np.sin(z[0]), z[1]],
    ...     hamiltonian=lambda t, z: 0.5 * z[1] ** 2 - np.cos(z[0]),
    ... )
    >>> run = spim.integrate(pendulum, [2.0, 0.0], (0.0, 10.0), 0.1)
    >>> bool(abs(run.energy / run.energy[0] - 1.0).max() < 1e-8)
    True
    """

    _kind = "hamiltonian"

    def __init__(
        self,
        dof,
        gradient,
        *,
        hamiltonian=None,
        hessian=None,
        linear=None,
        args=(),
        vectorized=False,
    ):
        self._dof = _dof(dof)
        m = self.size
        linear = None if linear is None else matrix("linear", linear, m)
        functions = {
            "gradient": (gradient, m, (m,)),
            "hamiltonian": (hamiltonian, m, (1,)),
            "hessian": (hessian, m, (m, m)),
        }
        self._take(functions, linear, args, vectorized)

    @property
    def size(self):
        """Length 2 n of the state."""
        return 2 * self._dof

    @property
    def _has_energy(self):
        return "hamiltonian" in self._functions

    def _energies(self, times, states):
        return self._values("hamiltonian", times, states)


class SeparableSystem(_Called):
    """``q' = M^-1 p`` or ``velocity(p)``, ``p' = force(t, q)``: for explicit splitting, and others.

    Forces must not depend on momenta: no damping, no magnetic or Coriolis forces. Units are those
    of its functions and masses.

    Parameters
    ----------
    force : callable or compiled function
        ``force(t, q) -> (n,)``, or ``force(t, q, out)``. Functions may be compiled; see
        `FlowSystem`.
    mass : array_like (n,) or (n, n), optional
        Masses, or a symmetric positive definite matrix, whose inverse is formed; n is its size.
    velocity : callable or compiled function, optional
        ``velocity(p) -> (n,)``, or ``velocity(p, out)``, instead; compiled ones take a time that
        means nothing, ``velocity(t, p, out)``.
    dof : int, optional
        n, where `velocity` is given; else the size of `mass`.
    potential : callable or compiled function, optional
        ``potential(t, q) -> float``; with masses, for ``solution.energy``.
    args, vectorized
        As in `FlowSystem`. A vectorised `velocity` takes p (n, k); one of Python takes no time.

    Raises
    ------
    ValueError
        A mass that is not symmetric positive definite; else as in `FlowSystem`.
    TypeError
        Both `mass` and `velocity`, or none; a `potential` without `mass`.

    Examples
    --------
    >>> import numpy as np
    >>> import spim
    >>> K = np.array([[200.0, -100.0], [-100.0, 100.0]])  # N/m, and 50 N/m^3
    >>> springs = spim.SeparableSystem(
    ...     lambda t, q: -K @ q - 50.0 * q**3,
    ...     mass=[2.0, 1.0],
    ...     potential=lambda t, q: 0.5 * q @ K @ q + 12.5 * np.sum(q**4),
    ... )
    >>> run = spim.integrate(springs, [0.1, 0.2, 0.0, 0.0], (0.0, 10.0), 0.01, method="kahan_li8")
    >>> bool(abs(run.energy / run.energy[0] - 1.0).max() < 1e-9)
    True
    """

    _kind = "separable"

    def __init__(
        self,
        force,
        *,
        mass=None,
        velocity=None,
        dof=None,
        potential=None,
        args=(),
        vectorized=False,
    ):
        if (mass is None) == (velocity is None):
            raise TypeError("a separable system needs either mass= or velocity=")
        if mass is not None:
            if np.ndim(mass) == 1:
                mass = np.diag(finite("mass", mass))
            M = symmetric("mass", matrix("mass", mass))
            cholesky("mass", M)
            self._dof, self._inverse = len(M), np.linalg.inv(M)
            if dof is not None and _dof(dof) != self._dof:
                raise ValueError(f"dof: is {dof}, but mass is of {self._dof}")
        else:
            self._dof = _dof(dof)
            if potential is not None:
                raise TypeError("potential: needs mass=, which gives the kinetic energy")
        n = self._dof
        if callable(velocity) and not is_compiled("velocity", velocity):
            more = len(args) if isinstance(args, tuple) else 0
            writes = _writes(velocity, more - 1)
            velocity = _Written(velocity, more) if writes else _Velocity(velocity)
        functions = {
            "force": (force, n, (n,)),
            "velocity": (velocity, n, (n,)),
            "potential": (potential, n, (1,)),
        }
        self._take(functions, None, args, vectorized)

    @property
    def size(self):
        """Length 2 n of the state."""
        return 2 * self._dof

    def _energies(self, times, states):
        q, p = states[:, : self._dof], states[:, self._dof :]
        kinetic = 0.5 * np.einsum("ki,ij,kj->k", p, self._inverse, p)
        return kinetic + self._values("potential", times, q)


class _Velocity:
    """A Python function of momenta as one of time and momenta."""

    def __init__(self, function):
        self.function = function

    def __call__(self, t, p, *args):
        return self.function(p, *args)


class _Written(_Velocity):
    """The same of one that writes its result."""

    def __init__(self, function, args):
        super().__init__(function)
        # By which it is told to write.
        places = (f"x{i}" for i in range(3 + args))
        self.__signature__ = inspect.Signature(
            [inspect.Parameter(place, inspect.Parameter.POSITIONAL_ONLY) for place in places]
        )

    def __call__(self, t, p, out, *args):
        self.function(p, out, *args)


class SemilinearSystem(_Called):
    """``z' = A z + nonlinear(t, z)``, or ``A z + [0; force(t, q)]``: with a linear part apart.

    For exponential methods, which take the linear part exactly; where it decays fast, Gauss methods
    are right and those are not. Either `nonlinear` or `force` must be given; splittings
    (``strang``, ``mollified_impulse``, ``mclachlan84``) need `force`.

    Parameters
    ----------
    A : array_like (m, m)
        Real, finite. Per unit of time; of ``M q'' + K q = f(q)`` it is ``[0 M^-1; -K 0]``.
    nonlinear : callable or compiled function, optional
        ``nonlinear(t, z) -> (m,)``, or ``nonlinear(t, z, out)``: all that A leaves of ``z'``.
        Functions may be compiled; see `FlowSystem`.
    force : callable or compiled function, optional
        ``force(t, q) -> (n,)``, ``m = 2 n``, instead: what A leaves of ``p'``, where ``q'`` is all
        linear. Functions that go with it are of q as well.
    jacobian : callable or compiled function, optional
        ``jacobian(t, z) -> (m, m)`` of the nonlinear part; of a force ``jacobian(t, q) -> (n, n)``.
    potential : callable or compiled function, optional
        ``potential(t, z) -> float`` with ``nonlinear = J grad potential``, ``J = [0 I; -I 0]``; of
        a force ``potential(t, q)`` with ``force = -grad potential``. With a Hamiltonian A, for
        ``solution.energy``.
    args, vectorized
        As in `FlowSystem`.

    Raises
    ------
    ValueError
        An A that is not square or not finite, or of odd size with `force`; a `potential` without a
        Hamiltonian A; else as in `FlowSystem`.
    TypeError
        Both `nonlinear` and `force`, or none; else as in `FlowSystem`.

    Examples
    --------
    >>> import spim
    >>> A = [[0.0, 1.0], [-2500.0, 0.0]]  # 1 kg on 2500 N/m: 50 rad/s
    >>> spring = spim.SemilinearSystem(
    ...     A, force=lambda t, q: -10.0 * q**3, potential=lambda t, q: 2.5 * q[0] ** 4
    ... )
    >>> run = spim.integrate(spring, [0.1, 0.0], (0.0, 10.0), 0.02, method="mclachlan84")
    >>> bool(abs(run.energy / run.energy[0] - 1.0).max() < 1e-9)
    True
    """

    _kind = "semilinear"

    @property
    def _kept(self):
        return "symplectic if it is Hamiltonian" if self._linear.hamiltonian else "symmetric"

    def __init__(
        self,
        A,
        nonlinear=None,
        *,
        force=None,
        jacobian=None,
        potential=None,
        args=(),
        vectorized=False,
    ):
        if (nonlinear is None) == (force is None):
            raise TypeError("a semilinear system needs either nonlinear or force=")
        self._linear = _core.Linear(A)
        m = self.size
        if potential is not None and not self._linear.hamiltonian:
            raise ValueError("potential: A is not Hamiltonian, so that there is no energy")
        # Components that functions are given.
        k, odd = (m, 0) if force is None else divmod(m, 2)
        if odd:
            raise ValueError(f"force: needs a state z = [q; p], got a matrix A of {m} rows")
        functions = {
            "nonlinear": (nonlinear, k, (k,)),
            "kick": (force, k, (k,)),
            "jacobian": (jacobian, k, (k, k)),
            "potential": (potential, k, (1,)),
        }
        self._take(functions, self._linear.A, args, vectorized)

    @classmethod
    def about(cls, system, z0, t=0.0, *, scale=None):
        """Any system, split at its linearisation at a state: for methods that need a linear part.

        Parameters
        ----------
        system : System
            Without a load.
        z0 : array_like (m,)
            The state; an equilibrium, as a rule.
        t : float
        scale : array_like (m,) or float, optional
            As for `linearize`.

        Returns
        -------
        SemilinearSystem
            The same motion and energy; ``linear`` is ``spim.linearize(system, z0, t)``. What is
            left, ``z' - A z``, is rounded once, so that it is as exact as ``z'``; a remainder in
            closed form, as `SemilinearSystem` takes, is more exact near the origin.

        Raises
        ------
        UnsupportedError
            A system with a load, or a beam with damping, which steps more than its state.
        """
        return _About(system, z0, t, scale)

    @property
    def linear(self):
        """The linear part A, (m, m)."""
        return self._linear.A

    @property
    def size(self):
        """Length m of the state."""
        return len(self._linear.A)

    def _energies(self, times, states):
        given = states[:, : self.size // 2] if "kick" in self._functions else states
        return self._linear.energy(states) + self._values("potential", times, given)


class _About(SemilinearSystem):
    """See `SemilinearSystem.about`."""

    def __init__(self, system, z0, t, scale):
        A = linearize(system, z0, t, scale=scale)
        if system.load is not None or stepped(system) != system.size:
            raise UnsupportedError(
                f"about: {type(system).__name__} has a load, or steps accounts along with its "
                "state; leave damping and loads out"
            )
        self._linear, self._functions, self._system = _core.Linear(A), {}, system

    @property
    def _core(self):
        if "_made" not in self.__dict__:
            self._made = _core.Called.about(self._system._core, self._linear.A)
        return self._made

    def __repr__(self):
        return f"SemilinearSystem({self.size} states, about one of {self._system!r})"

    def energy(self, z, t=0.0):
        """Energy of states, as the system that was split has it."""
        return self._system._energy_at(z, t)
