"""Write ``expm.npz``: matrices by class with their exponentials to about 32 digits.

Each exponential is computed in mpmath (`matrices.exponential`) from the matrix as stored
(exact doubles) with ``60 + 2 log10(norm1)`` digits or more, until 30 more digits change no
bit of ``hi`` and ``lo``. ``hi`` is the correctly rounded exponential, ``lo`` the double
nearest to what remains. Run time 27 s on one core::

    python tests/data/generate_expm.py

Keys: ``names``, ``labels`` (the class of each case), ``hamiltonian`` (whether ``J A`` is
symmetric to the last bit), ``digits`` (working digits used), and for each name an array
(3, m, m): ``A, hi, lo = data[name]``.
"""

from pathlib import Path

import mpmath as mp
import numpy as np
from matrices import (
    cantilever_hamiltonian,
    definite,
    doubles,
    exponential,
    norm1,
    orthogonal,
    oscillators,
    random_hamiltonian,
    scaled,
    settled,
    structural,
    uniform,
)

DESTINATION = Path(__file__).with_name("expm.npz")
ANGLES = [0.1, 0.5, 1.0, 2.1, 3.0, float(mp.pi), 4.25, 6.25, 10.0, 30.0, 100.0, 1000.0]


def rotation(w):
    return np.array([[0.0, w], [-w, 0.0]])


def structures():
    """Rotations, the paper's oscillators, cantilever beams."""
    for w in ANGLES:
        yield "rotation", f"{w:.6g}", rotation(w)
    for tau in (0.01, 0.05, 1.0, 100.0):
        yield "oscillators", f"tau {tau:g}", tau * oscillators()
    for coordinates in ("raw", "normalised"):
        for elements in (1, 2, 3, 4, 5):
            H, w_max = cantilever_hamiltonian(elements, coordinates)
            for tau_w in (10.0, 100.0, 1000.0, 1e4):
                name = f"{elements} elements tau w {tau_w:g}"
                yield f"beam {coordinates}", name, (tau_w / w_max) * H
    for elements in (1, 2, 3, 4):
        H, w_max = cantilever_hamiltonian(elements, "normalised", plane="flap")
        for tau_w in (100.0, 1000.0, 1e4):  # tau w_low is at most 1.9
            name = f"{elements} elements tau w {tau_w:g}"
            yield "beam flap normalised", name, (tau_w / w_max) * H


def hamiltonians():
    """Random Hamiltonian matrices, and what oscillates with a norm up to 1e20."""
    sizes = [(4, (1, 10, 30)), (6, (1, 10, 30)), (14, (1, 10, 30)), (16, (10,)), (32, (10,))]
    for number, kind in enumerate(("oscillatory", "hyperbolic", "mixed", "singular")):
        for m, norms in sizes:
            for norm in norms:
                seed = 1000 * number + 10 * m
                yield (
                    f"hamiltonian {kind}",
                    f"m {m} norm {norm}",
                    random_hamiltonian(kind, m, float(norm), seed),
                )
    G = definite(5000, 3)
    for norm in (1e6, 1e9, 1e12, 1e15, 1e18, 1e20):
        label = "norm to 1e12" if norm <= 1e12 else "norm to 1e20"
        yield label, f"rotation {norm:g}", rotation(norm)
        yield label, f"skew {norm:g}", scaled(structural(G, G), norm)
        yield label, f"oscillators {norm:g}", scaled(oscillators(), norm)


def generals():
    """Random matrices, and what decays."""
    for m in (2, 3, 4, 6, 8, 12, 16, 32):
        for norm in (0.01, 1.0, 10.0, 60.0) if m < 16 else (1.0, 60.0):
            yield "general", f"m {m} norm {norm:g}", scaled(uniform(6000 + m, m, m), norm)

    for m in (4, 8, 16, 32):  # spectrum: a disc about -20 of radius 20
        spread = 20.0 / np.sqrt(m / 3)
        yield "decaying", f"shifted {m}", spread * uniform(6100 + m, m, m) - 20.0 * np.eye(m)
    for m in (4, 8, 14):  # -Q D Q^T, D = 40, 20, 10, ...
        Q = orthogonal(6200 + m, m)
        with mp.workdps(50):
            A = doubles(-Q * mp.diag([mp.mpf(40) / 2**i for i in range(m)]) * Q.T)
        yield "decaying", f"definite {m}", np.tril(A) + np.tril(A, -1).T
    for n in (2, 4, 8):  # a chain whose highest modes are overdamped
        K = 100.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -0.125 * K]])
        yield "decaying", f"damped chain {2 * n}", A
    yield "decaying", "Moler Van Loan", np.array([[-49.0, 24.0], [-64.0, 31.0]])
    yield (
        "decaying",
        "Ward 3",
        np.array([[-131.0, 19.0, 18.0], [-390.0, 56.0, 54.0], [-387.0, 57.0, 52.0]]),
    )


def shaped():
    """Nilpotent, triangular, graded and trivial matrices."""
    for m in (2, 4, 8, 16):
        yield "nilpotent", f"m {m}", scaled(np.triu(uniform(7000 + m, m, m), 1), 5.0)
    for m in (3, 6):
        yield "nilpotent", f"m {m} entries 1e8", scaled(np.triu(uniform(7050 + m, m, m), 1), 1e8)
    for m in (4, 8, 16):
        yield "triangular", f"m {m}", scaled(np.triu(uniform(7100 + m, m, m)), 10.0)
    yield "triangular", "lower 6", scaled(np.tril(uniform(7150, 6, 6)), 20.0)

    powers = np.array([1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4])
    spread = powers[(uniform(7200, 6, 6) * 4.5 + 4.5).astype(int)] * uniform(7201, 6, 6)
    yield "graded", "triangular", np.triu(spread, 1) + np.diag(uniform(7202, 6))
    yield "graded", "skew", np.triu(spread, 1) - np.triu(spread, 1).T
    yield "graded", "1 1e8", np.array([[1.0, 1e8], [-1e-8, 1.0]])
    yield "graded", "rotation 1e9 1e-3", np.array([[0.0, 1e9], [-1e-3, 0.0]])
    d = powers[[0, 2, 3, 5, 7, 8]]
    yield "graded", "scaled 6", scaled(uniform(7203, 6, 6), 5.0) * (d[:, None] / d)
    yield "graded", "scaled transposed 6", scaled(uniform(7204, 6, 6), 5.0) * (d / d[:, None])

    for m in (4, 9):
        yield "trivial", f"norm 1e-10 m {m}", scaled(uniform(7300 + m, m, m), 1e-10)
    yield "trivial", "zero", np.zeros((4, 4))
    yield "trivial", "identity", np.eye(5)
    yield "trivial", "diagonal", np.diag(20.0 * uniform(7400, 6))
    yield "trivial", "one", np.array([[-0.7]])


def is_hamiltonian(A):
    """Whether ``J A`` is symmetric, to the last bit."""
    n = len(A) // 2
    if len(A) % 2:
        return False
    JA = np.vstack([A[n:], -A[:n]])
    return np.array_equal(JA, JA.T)


def main():
    names, labels, digits, even, arrays = [], [], [], [], {}
    for family in (structures, hamiltonians, generals, shaped):
        for label, detail, A in family():
            A = A + 0.0  # no negative zeros
            start = 60 + int(2 * np.log10(max(norm1(A), 1.0)))
            hi, lo, used = settled(lambda digits, A=A: exponential(A, digits), start)
            name = f"{label}: {detail}"
            names.append(name)
            labels.append(label)
            digits.append(used)
            even.append(is_hamiltonian(A))
            arrays[name] = np.stack([A, hi, lo])
            print(f"{name:45s} m {len(A):2d}  norm1 {norm1(A):8.1e}  {used} digits", flush=True)
    np.savez_compressed(
        DESTINATION, names=names, labels=labels, digits=digits, hamiltonian=even, **arrays
    )
    print(f"{len(names)} cases, {DESTINATION.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
