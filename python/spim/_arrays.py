"""Checks of the matrices users give."""

import numpy as np

from spim import _core

# Doubles of vectors that are worked on at once.
PIECE = 1 << 16


def finite(name, given, shape=None):
    """Real, finite doubles, of one shape if it is given."""
    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        raise ValueError(f"{name}: has masked entries; fill them first")
    try:
        array = np.asarray(given)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name}: needs real numbers, got dtype {array.dtype}")
    array = array.astype(float)
    if shape is not None and array.shape != shape:
        raise ValueError(f"{name}: must have shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f"entry {index} is" if index else "must be finite, got"
        raise ValueError(f"{name}: {where} {array[index]}")
    return array


def degrees(name, given, size):
    """Numbers of degrees of freedom, or of components, 0 .. size - 1."""
    array = finite(name, given)
    wrong = (array != np.floor(array)) | (array < 0) | (array >= size)
    if wrong.any():
        bad = array[wrong][0]
        raise ValueError(f"{name}: components are numbered 0 to {size - 1}, got {bad:g}")
    if array.ndim != 1 or not array.size:
        raise ValueError(f"{name}: must have shape (r,), r > 0, got {array.shape}")
    return array.astype(int)


def matrix(name, given, size=None):
    """A square matrix of doubles, from an array or a sparse matrix."""
    if hasattr(given, "toarray"):
        given = given.toarray()
    array = finite(name, given)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
        raise ValueError(f"{name}: must be square and not empty, got shape {array.shape}")
    if size is not None and len(array) != size:
        raise ValueError(f"{name}: must be ({size}, {size}) as the mass, got {array.shape}")
    return array


def symmetric(name, array, sign=1.0):
    """The symmetric (skew for ``sign=-1``) part of a matrix that is so to rounding."""
    off = np.abs(array - sign * array.T)
    if off.max() > 1e-10 * np.abs(array).max():
        i, j = (int(i) for i in np.unravel_index(np.argmax(off), off.shape))
        kind = "symmetric" if sign > 0 else "skew-symmetric"
        raise ValueError(
            f"{name}: must be {kind}; entries ({i}, {j}) and ({j}, {i}) are "
            f"{array[i, j]:g} and {array[j, i]:g}"
        )
    return 0.5 * (array + sign * array.T)


def cholesky(name, array):
    """Lower factor of a positive definite matrix; the error names the first bad pivot."""
    try:
        return np.linalg.cholesky(array)
    except np.linalg.LinAlgError:
        good, bad = 0, len(array)
        while bad - good > 1:
            middle = (good + bad) // 2
            try:
                np.linalg.cholesky(array[:middle, :middle])
                good = middle
            except np.linalg.LinAlgError:
                bad = middle
        raise ValueError(
            f"{name}: must be positive definite; the pivot of degree of freedom {bad - 1} is not "
            "positive (a massless or doubly counted one?)"
        ) from None


def mode_shapes(M, K):
    """Squares of frequencies, ascending, and mass-normalised shapes (n, n) as columns."""
    L = cholesky("mass", M)
    half = np.linalg.solve(L, K)
    S = np.linalg.solve(L, half.T)
    squares, vectors = np.linalg.eigh(0.5 * (S + S.T))
    shapes = np.linalg.solve(L.T, vectors)
    _refine_soft(M, K, squares, shapes)
    return squares, shapes


def _refine_soft(M, K, squares, shapes):
    """Finds again, in place, what the rounding of the stiffest modes has hidden.

    By the energies of the soft shapes, in pairs of doubles. A mode is rigid, and its square 0,
    where its energy is below the rounding of the stiffness itself.
    """
    largest = np.abs(squares).max()
    soft = np.flatnonzero(np.abs(squares) <= len(M) * 1e-13 * largest)
    if not soft.size or largest == 0.0:
        squares[soft] = 0.0
        return
    basis = shapes[:, soft].copy()

    def energies(S):
        # x^T S y of all pairs, by those of sums and differences.
        found = np.empty((soft.size, soft.size))
        for i, x in enumerate(basis.T):
            rows = np.vstack([basis.T[: i + 1] + x, basis.T[: i + 1] - x])
            twice = _core.quadratic(S, np.ascontiguousarray(rows)).reshape(2, -1)
            found[i, : i + 1] = found[: i + 1, i] = 0.5 * (twice[0] - twice[1])
        return found

    factor = np.linalg.cholesky(energies(M))
    half = np.linalg.solve(factor, energies(K))
    again, turned = np.linalg.eigh(np.linalg.solve(factor, half.T))
    shapes[:, soft] = basis = basis @ np.linalg.solve(factor.T, turned)
    sizes = np.einsum("ik,ij,jk->k", np.abs(basis), np.abs(K), np.abs(basis))
    squares[soft] = np.where(np.abs(again) <= 16.0 * np.finfo(float).eps * sizes, 0.0, again)


def in_pieces(size, z, make):
    """``make(rows, piece)`` of vectors (..., m), some at a time: (..., size).

    Temporaries then stay in the cache; first touches of fresh memory cost more than products.
    """
    flat = z.reshape(-1, z.shape[-1])
    out = np.empty((len(flat), size))
    count = max(64, PIECE // z.shape[-1])
    for first in range(0, len(flat), count):
        rows = slice(first, first + count)
        out[rows] = make(rows, flat[rows])
    return out.reshape(z.shape[:-1] + (size,))
