"""Two bodies under gravity, in a plane."""

import math

import numpy as np

from spim._arrays import finite
from spim.models._native import Native


class Kepler(Native):
    """``H = |p|^2/2 - mu/|q|``, the state ``z = [x, y, px, py]``.

    Of a unit mass; lengths and times are in any units. Invariants: the energy, `angular_momentum`,
    and the direction and shape of the ellipse, `eccentricity_vector`. Steps are equal: ellipses of
    eccentricities near 1 need small ones all the way round.

    Parameters
    ----------
    mu : float
        Gravitational parameter, length^3 / time^2.

    Raises
    ------
    ValueError
        `mu` that is not positive and finite.
    """

    _name = "kepler"

    def __init__(self, mu=1.0):
        self.mu = float(finite("mu", mu, ()))
        self._make(self.mu)

    def state(self, eccentricity=0.6):
        """At the point nearest the centre of an ellipse of half axis 1, (4,)."""
        e = float(finite("eccentricity", eccentricity, ()))
        if not 0.0 <= e < 1.0:
            raise ValueError(f"eccentricity: must be from 0 to below 1, got {e:g}")
        return np.array([1.0 - e, 0.0, 0.0, math.sqrt(self.mu * (1.0 + e) / (1.0 - e))])

    @property
    def period(self):
        """Of an ellipse of half axis 1."""
        return 2.0 * math.pi / math.sqrt(self.mu)

    def angular_momentum(self, z):
        """``x py - y px``, (..., 4) -> (...)."""
        x, y, px, py = np.moveaxis(self._states(z), -1, 0)
        return x * py - y * px

    def eccentricity_vector(self, z):
        """To the nearest point, its length the eccentricity, (..., 4) -> (..., 2)."""
        x, y, px, py = np.moveaxis(self._states(z), -1, 0)
        turn, distance = x * py - y * px, np.hypot(x, y)
        return np.stack(
            [py * turn / self.mu - x / distance, -px * turn / self.mu - y / distance], -1
        )
