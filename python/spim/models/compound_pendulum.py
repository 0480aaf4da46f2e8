"""A bead on a spring along a swinging rod: study 6.3 of the paper."""

import functools

import numpy as np

from spim import _core
from spim._arrays import finite
from spim._systems import System


class CompoundPendulum(System):
    """A rod that swings, with a bead on a spring along it (Huang, Deng & Yao 2007, eqs. 51-55).

    The state is ``z = [x, theta, p_x, p_theta]``: the bead's displacement from rest [m], the rod's
    angle [rad], their momenta. The spring is stiff and linear, the swing slow and nonlinear.

    Parameters
    ----------
    rod_mass : float
        kg.
    length : float
        Of the rod, and of the unstretched spring, m.
    bead_mass : float
        kg.
    stiffness : float
        N/m.
    gravity : float
        m/s^2.

    Raises
    ------
    ValueError
        Numbers that are not positive and finite.

    Notes
    -----
    Eq. 54 as printed lacks the constant ``-m g``; the gradient of the energy, eq. 52, is used. The
    linear part of semilinear methods is that at the equilibrium, the rest exact.
    """

    _preferred = "gauss16", "of high order, symplectic"

    def __init__(self, rod_mass=1.0, length=1.0, bead_mass=0.1, stiffness=100.0, gravity=9.81914):
        given = {
            "rod_mass": rod_mass,
            "length": length,
            "bead_mass": bead_mass,
            "stiffness": stiffness,
            "gravity": gravity,
        }
        self._given = {name: float(finite(name, value, ())) for name, value in given.items()}
        self._core = _core.CompoundPendulum(*self._given.values())

    def __reduce__(self):
        return functools.partial(CompoundPendulum, **self._given), ()

    @property
    def size(self):
        """Length of the state, 4."""
        return 4

    def _mapped(self, what, z, t):
        z = np.asarray(z, float)
        if not z.ndim or z.shape[-1] != 4:
            raise ValueError(f"z: must have shape (..., 4), got {z.shape}")
        times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).reshape(-1)
        found = getattr(self._core, what)(np.ascontiguousarray(times), z.reshape(-1, 4))
        return found.reshape(z.shape[:-1] + found.shape[1:])

    def energy(self, z):
        """Energy of states, (..., 4) -> (...), J (eq. 52)."""
        return self._mapped("energies", z, 0.0)[..., 0]

    def rate(self, z, t=0.0):
        """``z'`` of states, (..., 4) -> (..., 4)."""
        return self._mapped("rate", z, t)

    def _matrices(self):
        """None of a linear structure's."""

    def __repr__(self):
        return f"CompoundPendulum({', '.join(f'{k}={v:g}' for k, v in self._given.items())})"
