"""Nonlinear systems given as Python functions."""

import inspect

import numpy as np

from spim import _core
from spim._arrays import cholesky, finite, matrix, symmetric
from spim._core import UnsupportedError
from spim._systems import System, fastest_of

EXPLICIT = "yoshida6", "explicit, symplectic: the system is separable"
IMPLICIT = "gauss8", "implicit, symplectic"
EXPONENTIAL = "lawson_gauss6", "along the exact linear flow; symplectic if the parts are"


def _writes(name, function):
    """Whether ``f(t, x, out)`` writes its result, or ``f(t, x)`` returns it."""
    if not callable(function):
        raise TypeError(f"{name}: must be a function f(t, x), got {type(function).__name__}")
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return sum(p.kind in kinds and p.default is p.empty for p in parameters) >= 3


class _Called(System):
    """A system of functions; the core makes it anew for each process."""

    _energy = None

    def __getstate__(self):
        return {name: value for name, value in self.__dict__.items() if name != "_made"}

    @property
    def _core(self):
        if "_made" not in self.__dict__:
            self._made = _core.Called(*self._arguments())
        return self._made

    def _matrices(self):
        """None of a linear structure's."""

    def energy(self, z, t=0.0):
        """Energy of states, (..., m) -> (...).

        Raises
        ------
        UnsupportedError
            The system was made without a function for it.
        """
        if self._energy is None:
            raise UnsupportedError(f"{type(self).__name__}: no energy was given")
        z = np.asarray(z, float)
        if not z.ndim or z.shape[-1] != self.size:
            raise ValueError(f"z: must have shape (..., {self.size}), got {z.shape}")
        times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).ravel()
        states = z.reshape(-1, self.size)
        found = [self._energy_of(float(t), x) for t, x in zip(times, states, strict=True)]
        return np.array(found, float).reshape(z.shape[:-1])

    def __repr__(self):
        return f"{type(self).__name__}({self.size} states)"


class HamiltonianSystem(_Called):
    """``q' = dH/dp``, ``p' = -dH/dq`` by the gradient of H.

    Parameters
    ----------
    dof : int
        n.
    gradient : callable
        ``gradient(t, z) -> (2 n,)``, or ``gradient(t, z, out)``: dH/dz of ``z = [q; p]``.
    hamiltonian : callable, optional
        ``hamiltonian(t, z) -> float``, for ``solution.energy``.

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

    _preferred = IMPLICIT

    def __init__(self, dof, gradient, *, hamiltonian=None):
        if isinstance(dof, bool) or not isinstance(dof, int | np.integer) or dof < 1:
            raise ValueError(f"dof: must be a positive whole number, got {dof!r}")
        self._dof, self._gradient, self._energy = int(dof), gradient, hamiltonian
        self._in_place = _writes("gradient", gradient)

    @property
    def size(self):
        """Length 2 n of the state."""
        return 2 * self._dof

    def _arguments(self):
        return "hamiltonian", self._gradient, self.size, self._in_place

    def _energy_of(self, t, z):
        return self._energy(t, z)


class SeparableSystem(_Called):
    """``q' = M^-1 p`` or ``velocity(p)``, ``p' = force(t, q)``: for explicit splitting.

    Parameters
    ----------
    force : callable
        ``force(t, q) -> (n,)``, or ``force(t, q, out)``.
    mass : array_like (n,) or (n, n), optional
        Masses, or a symmetric positive definite matrix.
    velocity : callable, optional
        ``velocity(p) -> (n,)`` instead.
    dof : int, optional
        n, where `velocity` is given.
    potential : callable, optional
        ``potential(t, q) -> float``; with masses, for ``solution.energy``.
    """

    _preferred = EXPLICIT

    def __init__(self, force, *, mass=None, velocity=None, dof=None, potential=None):
        if (mass is None) == (velocity is None):
            raise TypeError("a separable system needs either mass= or velocity=")
        self._in_place = _writes("force", force)
        self._force, self._velocity, self._energy = force, velocity, potential
        self._inverse = None
        if mass is not None:
            if np.ndim(mass) == 1:
                mass = np.diag(finite("mass", mass))
            M = symmetric("mass", matrix("mass", mass))
            cholesky("mass", M)
            self._dof, self._inverse = len(M), np.linalg.inv(M)
        else:
            if isinstance(dof, bool) or not isinstance(dof, int | np.integer) or dof < 1:
                raise ValueError(f"dof: must be a positive whole number, got {dof!r}")
            if not callable(velocity):
                raise TypeError("velocity: must be a function of p")
            if potential is not None:
                raise TypeError("potential: needs mass=, which gives the kinetic energy")
            self._dof = int(dof)

    @property
    def size(self):
        """Length 2 n of the state."""
        return 2 * self._dof

    def _arguments(self):
        velocity = None
        if self._velocity is not None:
            function = self._velocity

            def velocity(_, p):
                return function(p)

        return "separable", self._force, self._dof, self._in_place, self._inverse, velocity

    def _energy_of(self, t, z):
        q, p = z[: self._dof], z[self._dof :]
        return 0.5 * p @ self._inverse @ p + self._energy(t, q)


class SemilinearSystem(_Called):
    """``z' = A z + nonlinear(t, z)``: a stiff linear part, and the rest.

    Parameters
    ----------
    A : array_like (m, m)
    nonlinear : callable
        ``nonlinear(t, z) -> (m,)``, or ``nonlinear(t, z, out)``.
    potential : callable, optional
        ``potential(t, z) -> float``, whose canonical gradient the nonlinear part is; with a
        Hamiltonian A, for ``solution.energy``.
    """

    _preferred = EXPONENTIAL

    def __init__(self, A, nonlinear, *, potential=None):
        self._linear = _core.Linear(A)
        self._in_place = _writes("nonlinear", nonlinear)
        self._nonlinear, self._energy = nonlinear, potential
        if potential is not None and not self._linear.hamiltonian:
            raise ValueError("potential: A is not Hamiltonian, so that there is no energy")

    @property
    def size(self):
        """Length m of the state."""
        return len(self._linear.A)

    def _fastest(self):
        return fastest_of(self._linear.A)

    def _arguments(self):
        return "semilinear", self._nonlinear, self.size, self._in_place, self._linear.A

    def _energy_of(self, t, z):
        return float(self._linear.energy(z)) + self._energy(t, z)
