"""A chain of stiff linear and soft quartic springs in turn."""

import numpy as np

from spim._arrays import finite
from spim.models._native import Native


class FermiPastaUlamTsingou(Native):
    """Stiff linear springs joined by soft quartic ones, between two walls.

    ``H = (|p|^2 + w^2 |y|^2)/2 + 1/4 [(x_1 - y_1)^4 + sum (x_i+1 - y_i+1 - x_i - y_i)^4
    + (x_m + y_m)^4]``. The state is ``z = [x, y, px, py]``, m numbers each: of the displacements a,
    b of the ends of each stiff spring ``x = (b + a)/sqrt(2)``, ``y = (b - a)/sqrt(2)``; masses are
    1. The energy of the stiff springs, `oscillatory_energy`, is nearly conserved though they
    exchange it (Hairer, Lubich & Wanner, Geometric Numerical Integration, I.5.1).

    Parameters
    ----------
    springs : int
        m, stiff ones.
    frequency : float
        Of each, rad/s.

    Raises
    ------
    ValueError
        Numbers that are not positive and finite; `springs` that is not whole.
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
