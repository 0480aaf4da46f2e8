"""Checks of the matrices users give."""

import numpy as np

# Doubles of vectors that are worked on at once.
PIECE = 1 << 16


def finite(name, given, shape=None):
    """Real, finite doubles, of one shape if it is given."""
    if np.ma.is_masked(given):
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
    whole = array.astype(int)
    wrong = (whole != array) | (whole < 0) | (whole >= size)
    if wrong.any():
        bad = array[wrong][0]
        raise ValueError(f"{name}: components are numbered 0 to {size - 1}, got {bad:g}")
    if whole.ndim != 1 or not whole.size:
        raise ValueError(f"{name}: must have shape (r,), r > 0, got {whole.shape}")
    return whole


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
    return squares, np.linalg.solve(L.T, vectors)


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
