"""Write ``phi.npz``: matrices and their phi_0 .. phi_4, correctly rounded.

The first block row of ``exp([[A, I, 0, ..], [0, 0, I, ..], ..])`` in mpmath. Run time a few
seconds::

    python tests/data/generate_phi.py

Keys: ``names`` and for each name an array (6, m, m): ``A, phi_0, .., phi_4 = data[name]``.
"""

from pathlib import Path

import mpmath as mp
import numpy as np
from matrices import (
    cantilever_hamiltonian,
    exponential,
    oscillators,
    scaled,
    settled,
    structural,
    uniform,
)

DESTINATION = Path(__file__).with_name("phi.npz")
HIGHEST = 4


def cases():
    """Names and matrices."""
    yield "oscillators tau 1", oscillators()
    H, w_max = cantilever_hamiltonian(2, "normalised")
    yield "stiff cantilever tau w 1000", (1000.0 / w_max) * H
    # A free-free chain has a rigid mode: A is singular.
    K = 2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    K[0, 0] = K[-1, -1] = 1.0
    yield "free-free tau w 10", 10.0 / np.sqrt(4.0) * structural(np.eye(4), K)
    yield "decaying", uniform(8100, 4, 4) - 40.0 * np.eye(4)
    yield "decaying, norm 1000", scaled(uniform(8101, 5, 5) - 2.0 * np.eye(5), 1000.0)
    yield "random", scaled(uniform(8102, 6, 6), 10.0)
    yield "nilpotent", scaled(np.triu(uniform(8103, 4, 4), 1), 5.0)
    yield "one", np.array([[-1e-3]])
    yield "zero", np.zeros((2, 2))


def augmented(A):
    """``[[A, I, 0, ..], [0, 0, I, ..], ..]``."""
    m = len(A)
    whole = np.eye(m * (HIGHEST + 1), k=m)
    whole[:m, :m] = A
    return whole


def main():
    """Compute and write."""
    arrays = {}
    for name, A in cases():
        m = len(A)
        digits = 60 + max(0, int(2 * np.log10(max(np.abs(A).sum(axis=0).max(), 1.0))))

        def top(digits, A=A, m=m):
            whole = exponential(augmented(A), digits)
            return mp.matrix([[whole[i, j] for j in range(whole.cols)] for i in range(m)])

        hi, _, _ = settled(top, digits)
        arrays[name] = np.array([A, *(hi[:, m * k : m * (k + 1)] for k in range(HIGHEST + 1))])
        print(name, flush=True)
    np.savez_compressed(DESTINATION, names=np.array(list(arrays)), **arrays)


if __name__ == "__main__":
    main()
