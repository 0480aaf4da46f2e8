"""A chain of stiff linear and soft quartic springs in turn."""

import numpy as np

from spim._arrays import finite
from spim._choice import Choice, collocation
from spim.models._native import Native

# Stiff springs up to which there is a linear part, and to which "auto" takes its exponentials:
# products with them are 16 m^2 numbers a stage, beside those of the springs, which are m.
LARGEST, EXPONENTIAL = 1024, 64
NONE = np.zeros(0, complex)


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
        m, stiff ones, to 1e6. Exponential methods, whose matrices of 4 m rows are full, take chains
        to 256; implicit ones know the linear part to 1024, and iterate without it beyond, where
        "auto" takes an explicit method.
    frequency : float
        Of each, rad/s.

    Raises
    ------
    ValueError
        Numbers that are not positive and finite; `springs` that is not whole, or too large.
    """

    _name = "fput"

    def __init__(self, springs=3, frequency=50.0):
        if isinstance(springs, bool | np.bool_):
            raise TypeError(f"springs: must be a whole number, got {springs}")
        self.frequency = float(finite("frequency", frequency, ()))
        self._make(springs, frequency)
        self.springs = int(springs)

    @property
    def _spectrum(self):
        return np.array([0.0, 1j, -1j]) * self.frequency if self.springs <= LARGEST else NONE

    def _chosen(self, step):
        if self.springs > LARGEST:
            words = "explicit, of order 10, symplectic: the chain is too long for matrices"
            return Choice("sofroniou_spaletta10", words)
        if self.springs > EXPONENTIAL:
            return collocation("symplectic; too long a chain for exponentials")
        return super()._chosen(step)

    def state(self):
        """The usual start: the first stiff spring swings, at unit energy each way, (4 m,)."""
        m = self.springs
        z = np.zeros(4 * m)
        z[0], z[m], z[2 * m], z[3 * m] = 1.0, 1.0 / self.frequency, 1.0, 1.0
        return z

    def oscillatory_energy(self, z):
        """Energy of each stiff spring, (..., 4 m) -> (..., m)."""
        m, z = self.springs, self._states(z)
        lengths, momenta = z[..., m : 2 * m], z[..., 3 * m :]
        return 0.5 * (momenta**2 + (self.frequency * lengths) ** 2)
