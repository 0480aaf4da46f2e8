"""Time a stored step of `Propagator.trajectory` beside a NumPy loop, in one run.

Chains of springs, every state stored; medians over interleaved repeats, set-up included after the
first call of each (the powers of a propagator are formed once)::

    python benches/python/trajectory_speed.py [--markdown]
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from _table import show

import spim

CASES = ((6, 100_000), (14, 100_000), (60, 20_000), (480, 5_000))


def chain(m):
    """`z' = A z` of m/2 unit masses on unit springs between two walls."""
    n = m // 2
    k = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-k, np.zeros((n, n))]])


def loop(w, z0, steps):
    """The loop users write."""
    out = np.empty((steps + 1, len(z0)))
    out[0] = z0
    for k in range(steps):
        np.dot(w, out[k], out[k + 1])
    return out


def rows():
    """Cells of the table: nanoseconds a step."""
    for m, steps in CASES:
        z0 = np.ones(m)
        plain = spim.Propagator(chain(m), 0.5)
        exact = spim.Propagator(chain(m), 0.5, correction="exact")
        calls = [
            lambda p=plain, z0=z0, n=steps: p.trajectory(z0, n),
            lambda p=exact, z0=z0, n=steps: p.trajectory(z0, n),
            lambda w=plain.matrix, z0=z0, n=steps: loop(w, z0, n),
        ]
        error = np.abs(calls[0]() - calls[2]()).max()
        assert error < 1e-8, error
        times = [[] for _ in calls]
        for _ in range(9):
            for call, found in zip(calls, times, strict=True):
                start = time.perf_counter()
                call()
                found.append((time.perf_counter() - start) / steps * 1e9)
        yield [str(m), *(f"{np.median(found):.1f}" for found in times)]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    head = ["m", "polish", "exact", "NumPy loop"]
    print(f"ns a stored step; kernels {spim.kernel_level()}\n")
    show(head, rows(), options.markdown, width=12)


if __name__ == "__main__":
    main()
