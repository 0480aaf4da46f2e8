"""Uncoupled oscillators of very different frequencies: study 6.2 of the paper."""

import numpy as np

from spim._arrays import finite
from spim._systems import LinearSystem


class Oscillators(LinearSystem):
    """Masses on springs, ``H = sum of p_i^2 / (2 m_i) + k_i x_i^2 / 2``.

    The state is ``z = [x_1 .. x_n, p_1 .. p_n]``, displacements [m] and momenta [kg m/s].

    Parameters
    ----------
    mass : array_like (n,)
        Masses [kg], positive.
    stiffness : array_like (n,)
        Stiffnesses [N/m], positive.

    Raises
    ------
    ValueError
        Lengths that differ, values that are not positive and finite.
    """

    def __init__(self, mass, stiffness):
        m, k = finite("mass", mass), finite("stiffness", stiffness)
        for name, values in (("mass", m), ("stiffness", k)):
            if values.ndim != 1 or values.size == 0:
                raise ValueError(f"{name}: must have shape (n,), got {values.shape}")
            # The inverse of a subnormal number is infinite.
            bad = ~(values >= np.finfo(float).tiny)
            if bad.any():
                at = int(np.argmax(bad))
                raise ValueError(f"{name}: must be positive, entry {at} is {values[at]}")
            values.flags.writeable = False
        if m.size != k.size:
            raise ValueError(f"{m.size} masses, but {k.size} stiffnesses")
        self.mass, self.stiffness = m, k
        n = m.size
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:] = np.diag(1.0 / m)
        A[n:, :n] = -np.diag(k)
        super().__init__(A)

    @property
    def frequencies(self):
        """Angular frequencies sqrt(k / m) [rad/s], (n,)."""
        return np.sqrt(self.stiffness / self.mass)
