"""Two point masses on rods, one hanging from the other."""

from spim._arrays import finite
from spim.models._native import Native


class DoublePendulum(Native):
    """A pendulum on a pendulum: chaotic, its energy the only invariant.

    The state is ``z = [theta1, theta2, p1, p2]``: angles of both rods from the downward vertical
    [rad] and their momenta [kg m^2/s], ``p = dL/dtheta'``. Energies are in J, 0 at the pivot.

    Parameters
    ----------
    masses : (float, float)
        kg.
    lengths : (float, float)
        m.
    gravity : float
        m/s^2.

    Raises
    ------
    ValueError
        Numbers that are not positive and finite.
    """

    _name = "double pendulum"

    def __init__(self, masses=(1.0, 1.0), lengths=(1.0, 1.0), gravity=9.80665):
        masses, lengths = finite("masses", masses, (2,)), finite("lengths", lengths, (2,))
        self._make(*masses, *lengths, float(finite("gravity", gravity, ())))
