"""Time of propagators of undamped structures beside `scipy.linalg.expm`, set-up included.

"exact" is half-size doubling in pairs, "half" in doubles, both without polish; "default" polishes
what steps. Medians over interleaved repeats; BLAS on one thread, which the script sets for itself::

    python benches/python/separable_speed.py [--markdown]
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.linalg
from _table import show

import spim

SIZES = (4, 16, 60, 120, 240, 500, 1000)
# Fastest angle of a step.
ANGLE = 10.0


def chain(n):
    """Equal masses and springs between two walls."""
    return spim.StructuralSystem(np.eye(n), 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))


def rows():
    """Cells of the table."""
    for size in SIZES:
        system, tau = chain(size // 2), ANGLE / 2.0
        A = tau * system.A
        calls = {
            "SciPy": lambda A=A: scipy.linalg.expm(A),
            "exact": lambda s=system, t=tau: spim.Propagator(
                s, t, method="exact", correction="none"
            ),
            "half": lambda s=system, t=tau: spim.Propagator(s, t, method="half", correction="none"),
            "default": lambda s=system, t=tau: spim.Propagator(s, t),
            "pairs": lambda s=system, t=tau: spim.Propagator(s, t, correction="exact"),
        }
        times = {name: [] for name in calls}
        for call in calls.values():
            call()
        for _ in range(5 if size >= 500 else 31):
            for name, call in calls.items():
                start = time.perf_counter()
                call()
                times[name].append(time.perf_counter() - start)
        medians = {name: np.median(found) for name, found in times.items()}
        peer = medians.pop("SciPy")
        yield [str(size), f"{peer * 1e3:.4f} ms", *(f"{peer / t:.1f}x" for t in medians.values())]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["2n", "SciPy", "exact", "half", "default", 'correction="exact"']
    show(head, rows(), parser.parse_args().markdown, width=20)


if __name__ == "__main__":
    main()
