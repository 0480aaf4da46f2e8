"""Damping matrices."""

import numpy as np

from spim._arrays import finite, matrix, mode_shapes, symmetric

__all__ = ["modal", "rayleigh"]


def rayleigh(mass, stiffness, *, frequencies=None, ratios=None, alpha=None, beta=None):
    """Rayleigh damping ``C = alpha M + beta K``.

    Parameters
    ----------
    mass, stiffness : array_like (n, n)
        Or sparse.
    frequencies : (float, float), optional
        Two frequencies, rad/s, at which `ratios` are met.
    ratios : float or (float, float), optional
        Damping ratios there.
    alpha, beta : float, optional
        The factors themselves, 1/s and s, instead.

    Returns
    -------
    ndarray (n, n)

    Raises
    ------
    ValueError
        Neither or both of the two ways; frequencies that are equal or not positive.
    """
    M = matrix("mass", mass)
    K = matrix("stiffness", stiffness, len(M))
    if (frequencies is None) == (alpha is None and beta is None):
        raise ValueError("rayleigh: give frequencies= and ratios=, or alpha= and beta=")
    if ratios is not None and frequencies is None:
        raise ValueError("ratios: need frequencies=; alpha= and beta= are factors")
    if frequencies is not None:
        if ratios is None:
            raise ValueError("rayleigh: frequencies= need ratios=")
        w = finite("frequencies", frequencies, (2,))
        z = finite("ratios", ratios)
        if z.shape not in ((), (2,)):
            raise ValueError(f"ratios: must be a number or two, got shape {z.shape}")
        if w[0] == w[1] or (w <= 0.0).any():
            raise ValueError(f"frequencies: must be positive and different, got {w}")
        # ratio = (alpha / w + beta w) / 2
        alpha, beta = np.linalg.solve(0.5 * np.array([1.0 / w, w]).T, np.broadcast_to(z, (2,)))
    factors = {"alpha": alpha, "beta": beta}
    alpha, beta = (0.0 if x is None else finite(name, x, ()) for name, x in factors.items())
    return alpha * M + beta * K


def modal(mass, stiffness, ratios):
    """Damping with a ratio for each mode, ``C = M Phi diag(2 ratio w) Phi^T M``.

    Parameters
    ----------
    mass, stiffness : array_like (n, n)
        Or sparse.
    ratios : float or array_like (k,)
        For the lowest k modes, the others undamped; a number for all of them.

    Returns
    -------
    ndarray (n, n)
        Symmetric.

    Raises
    ------
    ValueError
        Matrices that are not symmetric, a mass that is not positive definite, a negative mode.
    """
    M = symmetric("mass", matrix("mass", mass))
    K = symmetric("stiffness", matrix("stiffness", stiffness, len(M)))
    squares, shapes = mode_shapes(M, K)
    ratios = finite("ratios", ratios)
    if ratios.ndim > 1 or ratios.size > len(M):
        raise ValueError(f"ratios: a number, or at most {len(M)} of them, got shape {ratios.shape}")
    count = len(M) if ratios.ndim == 0 else ratios.size
    if (squares < 0.0).any():
        raise ValueError("stiffness: has a negative mode; the structure is unstable")
    factors = 2.0 * ratios * np.sqrt(squares[:count])
    momenta = M @ shapes[:, :count]
    C = (momenta * factors) @ momenta.T
    return 0.5 * (C + C.T)
