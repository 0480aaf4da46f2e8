"""Errors of `spim.phi` beside the two ways by hand: SciPy's augmented exponential, the inverse.

In parts of the largest entry of each function, against ``tests/data/phi.npz``::

    python benches/python/phi_accuracy.py [--markdown]
"""

import argparse
import math
from pathlib import Path

import numpy as np
import scipy.linalg
from _table import show

import spim

DATA = np.load(Path(__file__).parents[2] / "tests" / "data" / "phi.npz")
HIGHEST = 4


def augmented(a):
    """The first block row of the exponential of ``[[A, I, 0, ..], [0, 0, I, ..], ..]``."""
    m = len(a)
    whole = np.eye(m * (HIGHEST + 1), k=m)
    whole[:m, :m] = a
    top = scipy.linalg.expm(whole)[:m]
    return [top[:, m * k : m * (k + 1)] for k in range(HIGHEST + 1)]


def inverse(a):
    """``phi_k+1 = A^-1 (phi_k - I/k!)``: eq. (45) of the paper rests on it."""
    found = [scipy.linalg.expm(a)]
    for k in range(HIGHEST):
        found.append(np.linalg.solve(a, found[-1] - np.eye(len(a)) / math.factorial(k)))
    return found


def rows():
    """Cells of the table: largest errors of phi_1 .. phi_4."""
    for name in DATA["names"]:
        a, *exact = DATA[name]
        cells = [str(name)]
        for way in (lambda a: spim.phi(a, HIGHEST), augmented, inverse):
            try:
                found = way(a)
            except np.linalg.LinAlgError:
                cells.append("singular")
                continue
            errors = (
                np.abs(ours - best).max() / np.abs(best).max()
                for ours, best in zip(found[1:], exact[1:], strict=True)
            )
            cells.append(f"{max(errors):.1e}")
        yield cells


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["matrix", "spim.phi", "augmented, SciPy", "by inverses"]
    show(head, rows(), parser.parse_args().markdown, width=28)


if __name__ == "__main__":
    main()
