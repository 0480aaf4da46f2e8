"""Damping matrices."""

import numpy as np

from spim._arrays import finite, matrix, mode_shapes

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
    M, K = matrix("mass", mass), matrix("stiffness", stiffness)
    if (frequencies is None) == (alpha is None and beta is None):
        raise ValueError("rayleigh: give frequencies= and ratios=, or alpha= and beta=")
    if frequencies is not None:
        if ratios is None:
            raise ValueError("rayleigh: frequencies= need ratios=")
        w = finite("frequencies", frequencies, (2,))
        z = np.broadcast_to(finite("ratios", ratios), (2,))
        if w[0] == w[1] or (w <= 0.0).any():
            raise ValueError(f"frequencies: must be positive and different, got {w}")
        # ratio = (alpha / w + beta w) / 2
        alpha, beta = np.linalg.solve(0.5 * np.array([1.0 / w, w]).T, z)
    return (alpha or 0.0) * M + (beta or 0.0) * K


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
    """
    M, K = matrix("mass", mass), matrix("stiffness", stiffness)
    squares, shapes = mode_shapes(M, K)
    ratios = finite("ratios", ratios)
    if ratios.ndim > 1 or ratios.size > len(M):
        raise ValueError(f"ratios: a number, or at most {len(M)} of them, got shape {ratios.shape}")
    count = len(M) if ratios.ndim == 0 else ratios.size
    factors = 2.0 * ratios * np.sqrt(np.maximum(squares[:count], 0.0))
    momenta = M @ shapes[:, :count]
    C = (momenta * factors) @ momenta.T
    return 0.5 * (C + C.T)
