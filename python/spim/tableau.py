"""Runge-Kutta tableaus: what makes them symplectic, and methods of one's own."""

import numpy as np

from spim._arrays import finite

__all__ = ["RungeKutta", "symplectic_defect"]

# Rounding of sums of products of coefficients of size 1.
ROUNDING = 1e-13


def _checked(a, b):
    a, b = finite("a", a), finite("b", b)
    if b.ndim != 1 or not b.size or a.shape != (b.size, b.size):
        raise ValueError(f"a, b: must have shapes (s, s) and (s,), got {a.shape} and {b.shape}")
    return a, b


def symplectic_defect(a, b):
    """Largest ``|b_i a_ij + b_j a_ji - b_i b_j|``: 0 for symplectic methods.

    Theorem 1 of Huang, Deng & Yao (2007); Sanz-Serna, Lasagni, Suris (1988).

    Parameters
    ----------
    a : array_like (s, s)
    b : array_like (s,)

    Returns
    -------
    float

    Raises
    ------
    ValueError
        Shapes that do not match, entries that are not finite.
    """
    a, b = _checked(a, b)
    product = b[:, None] * a
    return float(np.abs(product + product.T - np.outer(b, b)).max())


class RungeKutta:
    """A Runge-Kutta method of one's own, for ``integrate(..., method=...)``.

    Implicit stages are solved by Newton's method to rounding.

    Parameters
    ----------
    a : array_like (s, s)
        Of the stages; those that depend on earlier ones alone cost least.
    b : array_like (s,)
        Weights; they add up to 1.
    symplectic : bool, optional
        True refuses a tableau that is not, False one that is. Told from the tableau by default.

    Attributes
    ----------
    symplectic : bool
        Whether the method is.
    symplectic_defect : float

    Raises
    ------
    ValueError
        Shapes that do not match, weights that do not add up to 1, a tableau that is not what
        `symplectic` says.

    Examples
    --------
    >>> import spim
    >>> srk2 = spim.RungeKutta([[0.25, 0.0], [0.5, 0.25]], [0.5, 0.5], symplectic=True)
    >>> srk2.symplectic_defect
    0.0
    """

    def __init__(self, a, b, *, symplectic=None):
        self.a, self.b = _checked(a, b)
        if abs(self.b.sum() - 1.0) > ROUNDING:
            raise ValueError(f"b: must add up to 1, not to {self.b.sum():.15g}")
        self.symplectic_defect = symplectic_defect(self.a, self.b)
        self.symplectic = self.symplectic_defect <= ROUNDING
        if symplectic is not None and bool(symplectic) != self.symplectic:
            found = f"b_i a_ij + b_j a_ji - b_i b_j is {self.symplectic_defect:.3g}"
            raise ValueError(
                f"symplectic: the tableau is {'' if self.symplectic else 'not '}symplectic: {found}"
            )

    def _options(self):
        return {"a": self.a.ravel(), "b": self.b}

    def __repr__(self):
        kind = "symplectic" if self.symplectic else "not symplectic"
        return f"RungeKutta({len(self.b)} stages, {kind})"
