"""Matrices of the reference data, and their exponentials in multiprecision.

Everything here is the same on every machine: random numbers come from the raw stream of
PCG64 and have 20 bits, so that sums of their products are exact in any order; what needs
more (inverses, Cholesky factors, frequencies) is done in mpmath and rounded once.
States are ordered ``z = [q; p]``; SI units.
"""

import math

import mpmath as mp
import numpy as np

BUILD_DIGITS = 50
SMALL_NORM = mp.mpf(2) ** -16  # norm at which the Taylor series is summed
MOST_ROUNDS = 12


# Random matrices


def uniform(seed, *shape, bits=20):
    """Uniform on [-1, 1), multiples of ``2^(1 - bits)``."""
    raw = np.random.PCG64(seed).random_raw(math.prod(shape)) >> np.uint64(64 - bits)
    return (raw.astype(float) * 2.0 ** (1 - bits) - 1.0).reshape(shape)


def norm1(A):
    """Largest column sum of the magnitudes."""
    return np.abs(A).sum(axis=0).max()


def scaled(A, norm):
    """`A` times the double that brings `norm1` to `norm`; entries then have all 53 bits."""
    return A * (norm / norm1(A))


def definite(seed, n):
    """Symmetric positive definite (n, n): ``B B^T + I/4``."""
    B = uniform(seed, n, n)
    return B @ B.T + 0.25 * np.eye(n)


def symmetric(seed, n):
    """Symmetric, indefinite (n, n)."""
    B = uniform(seed, n, n)
    return np.tril(B) + np.tril(B, -1).T


def orthogonal(seed, n):
    """Orthogonal factor of a random (n, n) matrix, as an mpmath matrix."""
    with mp.workdps(BUILD_DIGITS):
        return mp.qr(mp.matrix(uniform(seed, n, n).tolist()))[0]


# Hamiltonian matrices


def hamiltonian(A, B, C):
    """``[[A, B], [C, -A^T]]`` with B, C symmetric: ``z' = H z``, ``z = [q; p]``."""
    return np.block([[A, B], [C, -A.T]])


def structural(G, K):
    """``[[0, G], [-K, 0]]``: inverse mass G, stiffness K."""
    return hamiltonian(np.zeros_like(G), G, -K)


def random_hamiltonian(kind, m, norm, seed):
    """Random Hamiltonian matrix of a kind.

    Parameters
    ----------
    kind : {"oscillatory", "hyperbolic", "mixed", "singular"}
        ``[[0, G], [-K, 0]]``, ``[[0, G], [K, 0]]``, ``[[A, B], [C, -A^T]]``, and
        oscillatory with a stiffness of half rank (exactly: its entries are not rounded).
    m : int
        Size, even.
    norm : float
        Its norm1.
    seed : int
    """
    n = m // 2
    if kind == "oscillatory":
        return scaled(structural(definite(seed, n), definite(seed + 1, n)), norm)
    if kind == "hyperbolic":
        return scaled(structural(definite(seed, n), -definite(seed + 1, n)), norm)
    if kind == "mixed":
        H = hamiltonian(uniform(seed, n, n), symmetric(seed + 1, n), symmetric(seed + 2, n))
        return scaled(H, norm)
    B = uniform(seed + 1, n, n // 2, bits=10)
    H = structural(definite(seed, n), B @ B.T)
    return H * float(np.float32(norm / norm1(H)))  # 23 + 24 bits: K stays exact


def oscillators():
    """The paper's three oscillators (6.2): ``m = 0.1, 10, 1000 kg``, ``k = 100, 10, 1 N/m``."""
    mass = np.array([0.1, 10.0, 1000.0])
    return structural(np.diag(1.0 / mass), np.diag([100.0, 10.0, 1.0]))


# The paper's cantilever (6.1), hub at rest

LENGTH = 8.0  # m
DENSITY = 2.7667e3  # kg/m^3
YOUNG = 6.8952e10  # N/m^2
ROOT = (0.04596, 0.00248)  # m: in-plane depth b, thickness h
TIP = (0.02673, 0.00144)
TIP_MASS = 0.085  # kg

# Gauss-Legendre, 5 points on [0, 1]: exact for every integral of a linearly tapered element
with mp.workdps(BUILD_DIGITS):
    _inner, _outer = (mp.sqrt(5 + s * 2 * mp.sqrt(mp.mpf(10) / 7)) / 3 for s in (-1, 1))
    _near, _far = ((322 + s * 13 * mp.sqrt(70)) / 900 for s in (1, -1))
    GAUSS = [
        ((1 + x) / 2, w / 2)
        for x, w in [
            (-_outer, _far),
            (-_inner, _near),
            (mp.mpf(0), mp.mpf(128) / 225),
            (_inner, _near),
            (_outer, _far),
        ]
    ]


def cantilever(elements, plane="chord"):
    """Mass and stiffness of the clamped beam with axial and bending dofs.

    Linear shape functions axially, cubic Hermite transversally, linear taper inside the
    integrals, tip mass (BEAM.md 1, 2).

    Parameters
    ----------
    elements : int
        Number of equal elements, n.
    plane : {"chord", "flap"}
        Bending in the plane of rotation (stiff, ``I = h b^3/12``: the paper's) or out of it
        (limp, ``I = b h^3/12``).

    Returns
    -------
    M, K : mpmath matrices, (3n, 3n), SI
        Dofs u, v, theta of nodes 1..n, interleaved.
    """
    with mp.workdps(BUILD_DIGITS):
        size = 3 * (elements + 1)
        M, K = mp.zeros(size), mp.zeros(size)
        length = mp.mpf(LENGTH) / elements
        for element in range(elements):
            for x, weight in GAUSS:
                position = (element + x) / elements
                b, h = (
                    mp.mpf(r) + position * (mp.mpf(t) - r) for r, t in zip(ROOT, TIP, strict=True)
                )
                area = b * h
                inertia = h * b**3 / 12 if plane == "chord" else b * h**3 / 12
                N_u = [1 - x, 0, 0, x, 0, 0]
                N_v = [
                    0,
                    1 - 3 * x**2 + 2 * x**3,
                    length * (x - 2 * x**2 + x**3),
                    0,
                    3 * x**2 - 2 * x**3,
                    length * (x**3 - x**2),
                ]
                strain = [-1 / length, 0, 0, 1 / length, 0, 0]
                curvature = [
                    0,
                    (12 * x - 6) / length**2,
                    (6 * x - 4) / length,
                    0,
                    (6 - 12 * x) / length**2,
                    (6 * x - 2) / length,
                ]
                for i in range(6):
                    for j in range(6):
                        row, column = 3 * element + i, 3 * element + j
                        M[row, column] += (
                            weight * length * DENSITY * area * (N_u[i] * N_u[j] + N_v[i] * N_v[j])
                        )
                        K[row, column] += (weight * length * YOUNG) * (
                            area * strain[i] * strain[j] + inertia * curvature[i] * curvature[j]
                        )
        M[size - 3, size - 3] += TIP_MASS
        M[size - 2, size - 2] += TIP_MASS
        return M[3:, 3:], K[3:, 3:]


def cantilever_hamiltonian(elements, coordinates, plane="chord"):
    """Hamiltonian matrix of `cantilever`, and its largest frequency.

    Parameters
    ----------
    elements : int
    coordinates : {"raw", "normalised"}
        ``[[0, M^-1], [-K, 0]]``; or with ``M = L L^T`` the coordinates ``L^T q`` and
        ``L^-1 p / w_max``: mass-normalised, momentum in units of ``w_max``.
    plane : {"chord", "flap"}
        As for `cantilever`.

    Returns
    -------
    H : (6n, 6n) float64 array
    w_max : float
        rad/s.
    """
    M, K = cantilever(elements, plane)
    with mp.workdps(BUILD_DIGITS):
        inverse = mp.inverse(mp.cholesky(M))
        normalised = inverse * K * inverse.T
        w_max = mp.sqrt(max(mp.eigsy(normalised, eigvals_only=True)))
        if coordinates == "raw":
            H = structural(doubles(inverse.T * inverse), doubles(K))
        else:
            H = structural(doubles(w_max * mp.eye(M.rows)), doubles(normalised / w_max))
        return H, float(w_max)


# Exponentials and rounding in multiprecision


def exponential(A, digits):
    """``exp(A)`` by Taylor series at norm ``2^-16`` and squaring, all with `digits` digits.

    Parameters
    ----------
    A : float64 array or mpmath matrix, (m, m)
    digits : int
        Working digits; the squarings lose about ``log10(norm1(A))`` of them, and more where
        intermediate powers exceed the result: see `settled`.
    """
    with mp.workdps(digits):
        A = mp.matrix(A.tolist() if isinstance(A, np.ndarray) else A)
        norm = mp.mnorm(A, 1)
        squarings = max(0, int(mp.ceil(mp.log(norm / SMALL_NORM, 2)))) if norm else 0
        X = A * mp.ldexp(1, -squarings)
        term = W = mp.eye(A.rows)
        k = 0
        while mp.mnorm(term, 1) > mp.mpf(10) ** -digits:
            k += 1
            term = term * X / k
            W = W + term
        for _ in range(squarings):
            W = W * W
        return W


def doubles(X):
    """Nearest doubles of an mpmath matrix, as an array."""
    return np.array([float(x) for x in X]).reshape(X.rows, X.cols)


def pair(X):
    """Nearest doubles `hi` of an mpmath matrix and `lo` of what remains."""
    hi = doubles(X)
    return hi, doubles(X - mp.matrix(hi.tolist()))


def settled(compute, digits):
    """``compute(digits)`` as (hi, lo), at a precision where 30 more digits change nothing.

    Returns
    -------
    hi, lo : float64 arrays
    digits : int
        The smaller of the two numbers of digits that agree.

    Raises
    ------
    ArithmeticError
        If `hi` and `lo` still change after 12 rounds.
    """
    before = None
    for more in range(0, 30 * MOST_ROUNDS, 30):
        with mp.workdps(digits + more):
            now = pair(compute(digits + more))
        if before is not None and all(map(np.array_equal, before, now)):
            return *now, digits + more - 30
        before = now
    raise ArithmeticError(f"hi and lo still change at {digits + more} digits")
