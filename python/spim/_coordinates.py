"""Other coordinates to step in: what goes into the core, and how states come back."""

import functools

import numpy as np

from spim import _core
from spim._arrays import in_pieces
from spim._core import UnsupportedError

# Damping that couples modes by less than this, beside what it does to them, is classical.
CLASSICAL = 1e-8


class Raw:
    """The coordinates of the system itself."""

    def __init__(self, system):
        self.core, self.A, self.input = system._core, system.A, system._input
        self.matrices = system._matrices()

    def into(self, z):
        """States as the core steps them."""
        return z

    def back(self, z):
        """States as the user knows them, (..., m)."""
        return z

    def outputs(self, matrix):
        """A map of states as one of what the core steps."""
        return matrix


class Whole(Raw):
    """A system that is no matrix and steps its state alone."""

    matrices = None

    def __init__(self, system):
        self.core = system._core


class WithBooks:
    """A system that steps more than its state: accounts of work and dissipation, zero at first."""

    matrices = None

    def __init__(self, system):
        self.core, self._size, self._stepped = system._core, system.size, system._core.size

    def into(self, z):
        """A state, with the accounts where they are not there yet."""
        _check_length(z, self._size, self._stepped)
        return np.concatenate([z, np.zeros(self._stepped - len(z))])

    def back(self, z):
        """All that is stepped, (..., m)."""
        return z

    def shown(self, z):
        """The state itself."""
        return z[: self._size]

    def outputs(self, matrix):
        """A map of states as one of what the core steps."""
        return np.hstack([matrix, np.zeros((len(matrix), self._stepped - self._size))])


class _Halved:
    """Coordinates and momenta changed apart: ``q = back_q y1``, ``p = back_p y2``."""

    matrices = None

    def _set(self, system, A, forces, back):
        self.core = _core.Linear(A)
        self.A, self.input = A, np.vstack([np.zeros_like(forces), forces])
        self._back, self._n = back, system.dof

    def back(self, z):
        def halves(_, z):
            q, p = z[:, : self._n], z[:, self._n :]
            return np.hstack([q @ self._back[0].T, p @ self._back[1].T])

        return in_pieces(2 * self._n, z, halves)

    def shown(self, z):
        """One state as the user knows it."""
        return self.back(z)

    def outputs(self, matrix):
        return np.hstack(
            [matrix[:, : self._n] @ self._back[0], matrix[:, self._n :] @ self._back[1]]
        )


class Energy(_Halved):
    """Coordinates in which the energy is half the square of the state's length."""

    def __init__(self, system):
        _demand_plain(system, 'coordinates: "energy"')
        n = system.dof
        (B, _), self._strain, (compliance, _), self._momentum, (L, _) = _core.energy_coordinates(
            system.mass, system.stiffness
        )
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:], A[n:, :n] = B, -B.T
        inverse = self._momentum[0]
        if system.damping.any():
            A[n:, n:] = -inverse @ system.damping @ inverse.T
        self._set(system, A, inverse, (compliance, L))

    def into(self, z):
        _check_length(z, 2 * self._n)
        q, p = z[: self._n], z[self._n :]
        return np.concatenate([_core.apply(*self._strain, q), _core.apply(*self._momentum, p)])


class Modal(_Halved):
    """Modal coordinates; damping must not couple modes."""

    def __init__(self, system):
        _demand_plain(system, "modal")
        n = system.dof
        modes = system.modal()
        shapes = modes.shapes
        damping = shapes.T @ system.damping @ shapes
        diagonal = np.diag(damping)
        coupling = np.abs(damping - np.diag(diagonal)).max()
        if coupling > CLASSICAL * np.abs(damping).max():
            raise UnsupportedError(
                "modal: the damping couples modes; use spim.damping.rayleigh or .modal, or "
                'method="auto", which takes any damping'
            )
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:] = np.eye(n)
        A[n:, :n] = -np.diag(modes.frequencies**2)
        A[n:, n:] = -np.diag(diagonal)
        momenta = system.mass @ shapes
        self._forth = momenta.T, shapes.T
        self._set(system, A, shapes.T, (shapes, momenta))

    def into(self, z):
        _check_length(z, 2 * self._n)
        return np.concatenate([self._forth[0] @ z[: self._n], self._forth[1] @ z[self._n :]])


def _check_length(z, *sizes):
    if z.ndim != 1 or len(z) not in sizes:
        raise ValueError(f"z0: must have shape ({sizes[0]},), got {z.shape}")


def _demand_plain(system, what):
    if not hasattr(system, "gyroscopic"):
        raise UnsupportedError(f"{what} needs a structure, got {type(system).__name__}")
    if system.gyroscopic.any():
        raise UnsupportedError(f"{what} needs a structure without gyroscopic terms")


def coordinates_of(system, method, options):
    """The coordinates a run is stepped in; made once a system."""
    if not hasattr(system, "A"):
        kind = Whole if system._core.size == system.size else WithBooks
        return kind(system)
    if method == "modal" and hasattr(system, "gyroscopic"):
        return _made(Modal, system)
    if options.get("coordinates") == "energy":
        return _made(Energy, system)
    return Raw(system)


@functools.lru_cache(maxsize=4)
def _made(kind, system):
    return kind(system)
