"""A chain of stiff linear and soft quartic springs in turn."""

import numpy as np

from spim._arrays import finite
from spim.models._native import Native


class FermiPastaUlamTsingou(Native):
    """Stiff linear springs joined by soft quartic ones, between two walls.

    The state is ``z = [x, y, px, py]``, m numbers each: middles of the stiff springs and their
    lengths. The energy of the stiff springs, `oscillatory_energy`, is nearly conserved though they
    exchange it (Hairer, Lubich & Wanner, Geometric Numerical Integration, I.5.1).

    Parameters
    ----------
    springs : int
        m, stiff ones.
    frequency : float
        Of each, rad/s.
    """

    _name = "fput"

    def __init__(self, springs=3, frequency=50.0):
        self.springs, self.frequency = springs, float(finite("frequency", frequency, ()))
        self._make(springs, frequency)

    def state(self):
        """The usual start: the first stiff spring swings, at unit energy each way, (4 m,)."""
        m = self.springs
        z = np.zeros(4 * m)
        z[0], z[m], z[2 * m], z[3 * m] = 1.0, 1.0 / self.frequency, 1.0, 1.0
        return z

    def oscillatory_energy(self, z):
        """Energy of each stiff spring, (..., 4 m) -> (..., m)."""
        m, z = self.springs, np.asarray(z, float)
        lengths, momenta = z[..., m : 2 * m], z[..., 3 * m :]
        return 0.5 * (momenta**2 + (self.frequency * lengths) ** 2)
