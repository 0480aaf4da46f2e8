"""Base of models that the core knows by name and numbers."""

import functools

import numpy as np

from spim import _core
from spim._arrays import finite
from spim._choice import along, collocation
from spim._systems import System


class Native(System):
    """A model of the core; a class of its own gives its name and what its numbers are."""

    _name = ""
    # Whether a linear part is faster than what is left.
    _stiff = True

    def _make(self, *parameters):
        self._parameters = finite("parameters", parameters)
        self._core = _core.Model(self._name, self._parameters)

    def __getstate__(self):
        return {name: value for name, value in self.__dict__.items() if name != "_core"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._core = _core.Model(self._name, self._parameters)

    @property
    def size(self):
        """Length m of the state."""
        return self._core.size

    @functools.cached_property
    def _spectrum(self):
        matrix = self._core.matrix
        return np.zeros(0, complex) if matrix is None else np.linalg.eigvals(matrix)

    def _chosen(self, step):
        if self._stiff and len(self._spectrum):
            return along(self._spectrum, "symplectic", step)
        return collocation("symplectic")

    def _states(self, z):
        """States as an array (..., m)."""
        z = np.asarray(z, float)
        if not z.ndim or z.shape[-1] != self.size:
            raise ValueError(f"z: must have shape (..., {self.size}), got {z.shape}")
        return z

    def _mapped(self, what, z, t):
        z = self._states(z)
        times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).reshape(-1)
        states = np.ascontiguousarray(z.reshape(-1, self.size))
        found = getattr(self._core, what)(np.ascontiguousarray(times), states)
        return found.reshape(z.shape[:-1] + found.shape[1:])

    def energy(self, z):
        """Energy of states, (..., m) -> (...); J, where the model has units."""
        return self._mapped("energies", z, 0.0)[..., 0]

    def rate(self, z, t=0.0):
        """``z'`` of states, (..., m) -> (..., m)."""
        return self._mapped("rate", z, t)

    def _matrices(self):
        """None of a linear structure's."""

    def __repr__(self):
        return f"{type(self).__name__}({self.size} states)"
