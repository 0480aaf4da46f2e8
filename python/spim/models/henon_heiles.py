"""Henon & Heiles' system: a star in a galaxy, regular and chaotic."""

from spim.models._native import Native


class HenonHeiles(Native):
    """``H = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2 y - y^3/3``.

    The state is ``z = [x, y, px, py]``, without units: linear oscillations have 1 rad per unit of
    time. Chaotic from an energy of 1/12 on, unbounded from 1/6; the energy is the only invariant
    (Henon & Heiles, Astron. J. 69 (1964) 73).
    """

    _name = "henon-heiles"
    # Its linear part has the frequencies of the motion itself.
    _stiff = False

    def __init__(self):
        self._make()
