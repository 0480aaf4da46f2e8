"""Time of `spim.expm` through Python beside `scipy.linalg.expm`, both in one run.

Random Hamiltonian matrices of norm 10, medians over interleaved repeats. The fair peer is a BLAS of
one thread (``OPENBLAS_NUM_THREADS=1``, which the script sets for itself)::

    python benches/python/expm_speed.py [--markdown] [--level avx2]
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.linalg
from _table import show

import spim

SIZES = (4, 6, 14, 32, 64, 128, 256, 1024)


def hamiltonian(m, rng):
    """Random Hamiltonian matrix, 1-norm 10."""
    n = m // 2
    a, b, c = rng.normal(size=(3, n, n))
    h = np.block([[a, b + b.T], [c + c.T, -a.T]])
    return 10 * h / np.linalg.norm(h, 1)


def medians(calls, seconds=0.5):
    """Median time of each of some calls, taken in turn; repeats chosen to last."""
    for call in calls:
        call()
    start = time.perf_counter()
    calls[0]()
    repeats = max(1, int(1e-3 / max(time.perf_counter() - start, 1e-7)))
    times = [[] for _ in calls]
    end = time.perf_counter() + seconds * len(calls)
    while time.perf_counter() < end or len(times[0]) < 3:
        for call, found in zip(calls, times, strict=True):
            start = time.perf_counter()
            for _ in range(repeats):
                call()
            found.append((time.perf_counter() - start) / repeats)
    return [float(np.median(found)) for found in times]


def rows():
    """Cells of the table: sizes, SciPy's time, ours with the ratio."""
    rng = np.random.default_rng(1)
    cases = [(str(m), hamiltonian(m, rng), 1) for m in SIZES]
    cases += [
        (f"1000 x {m}", np.array([hamiltonian(m, rng) for _ in range(1000)]), 1000)
        for m in (4, 6, 14)
    ]
    for name, a, count in cases:
        methods = ["sid"] if a.shape[-1] > 256 else ["sid", "exact"]
        calls = [lambda a=a: scipy.linalg.expm(a)]
        calls += [lambda a=a, method=method: spim.expm(a, method=method) for method in methods]
        scipys, *ours = (1e6 * t / count for t in medians(calls))
        cells = [f"{t:.2f} ({scipys / t:.1f}x)" for t in ours]
        yield [name, f"{scipys:.2f}", *cells, *["-"] * (2 - len(cells))]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--level", default="auto", help="kernel level to force")
    options = parser.parse_args()
    head = ["m", "SciPy, us", "sid, us (ratio)", "exact, us (ratio)"]
    print(f"us a matrix; kernels {spim.kernel_level(options.level)}, SciPy {scipy.__version__}\n")
    show(head, rows(), options.markdown)


if __name__ == "__main__":
    main()
