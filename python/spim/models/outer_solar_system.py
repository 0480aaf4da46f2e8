"""The sun and its outer planets."""

import numpy as np

from spim.models._native import Native

# Of Hairer, Lubich & Wanner, Geometric Numerical Integration, I.2.4: masses in those of the sun
# (which has the inner planets' as well), places in astronomical units, velocities in them a day,
# on 5 September 1994.
GRAVITY = 2.95912208286e-4
BODIES = {
    "sun": (1.00000597682, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "jupiter": (
        9.54786104043e-4,
        (-3.5023653, -3.8169847, -1.5507963),
        (0.00565429, -0.00412490, -0.00190589),
    ),
    "saturn": (
        2.85583733151e-4,
        (9.0755314, -3.0458353, -1.6483708),
        (0.00168318, 0.00483525, 0.00192462),
    ),
    "uranus": (
        4.37273164546e-5,
        (8.3101420, -16.2901086, -7.2521278),
        (0.00354178, 0.00137102, 0.00055029),
    ),
    "neptune": (
        5.17759138449e-5,
        (11.4707666, -25.7294829, -10.8169456),
        (0.00288930, 0.00114527, 0.00039677),
    ),
    "pluto": (
        1.0 / 1.3e8,
        (-15.5387357, -25.2225594, -3.1902382),
        (0.00276725, -0.00170702, -0.00136504),
    ),
}


class OuterSolarSystem(Native):
    """Six bodies under their mutual gravity; lengths in astronomical units, times in days.

    The state is ``z = [q; p]``, places of the six bodies, sun first, then their momenta.
    Invariants: the energy, `momentum` and `angular_momentum`.

    Attributes
    ----------
    names : tuple of str
    masses : ndarray (6,)
        In masses of the sun.
    """

    _name = "outer solar system"

    def __init__(self):
        self.names = tuple(BODIES)
        self.masses = np.array([mass for mass, _, _ in BODIES.values()])
        self._make(GRAVITY, *self.masses)

    def state(self):
        """On 5 September 1994, (36,)."""
        places = np.array([place for _, place, _ in BODIES.values()])
        speeds = np.array([speed for _, _, speed in BODIES.values()])
        return np.concatenate([places.ravel(), (self.masses[:, None] * speeds).ravel()])

    def momentum(self, z):
        """Of all bodies together, (..., 36) -> (..., 3)."""
        return _bodies(self._states(z))[1].sum(axis=-2)

    def angular_momentum(self, z):
        """Of all bodies together, (..., 36) -> (..., 3)."""
        q, p = _bodies(self._states(z))
        return np.cross(q, p).sum(axis=-2)


def _bodies(z):
    halves = z.reshape(z.shape[:-1] + (2, len(BODIES), 3))
    return halves[..., 0, :, :], halves[..., 1, :, :]
