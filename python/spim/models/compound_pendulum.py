"""A bead on a spring along a swinging rod: study 6.3 of the paper."""

from spim._arrays import finite
from spim.models._native import Native


class CompoundPendulum(Native):
    """A rod that swings, with a bead on a spring along it (Huang, Deng & Yao 2007, eqs. 51-55).

    The state is ``z = [x, theta, p_x, p_theta]``: the bead's displacement from where it hangs at
    rest [m], the rod's angle from the vertical [rad], their momenta [kg m/s, kg m^2/s]. The spring
    is stiff and linear, the swing slow and nonlinear.

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

    _name = "compound pendulum"

    def __init__(self, rod_mass=1.0, length=1.0, bead_mass=0.1, stiffness=100.0, gravity=9.81914):
        given = {
            "rod_mass": rod_mass,
            "length": length,
            "bead_mass": bead_mass,
            "stiffness": stiffness,
            "gravity": gravity,
        }
        self._make(*(float(finite(name, value, ())) for name, value in given.items()))
