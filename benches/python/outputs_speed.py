"""Time per step of a chain under a ground motion, for all states and for one output.

Set-up included and told apart; medians over interleaved repeats::

    python benches/python/outputs_speed.py [--markdown]
"""

import argparse
import time

import numpy as np
from _table import show

import spim

SIZES = ((15, 50_000), (60, 50_000), (240, 50_000))
STEP = 0.02
REPEATS = 5


def timed(system, steps, **options):
    """Seconds of one run."""
    start = time.perf_counter()
    spim.integrate(system, system.state(), (0.0, steps * STEP), STEP, **options)
    return time.perf_counter() - start


def rows():
    """Cells of the table."""
    for n, steps in SIZES:
        K = 400.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        M = np.diag(1.0 + 0.5 * np.arange(n) / n)
        C = spim.damping.rayleigh(M, K, alpha=0.1, beta=2e-3)
        record = spim.loads.Sampled(np.random.default_rng(0).normal(size=steps + 1), STEP)
        load = spim.loads.GroundMotion(record, np.ones(n))
        system = spim.StructuralSystem(M, K, damping=C, load=load)
        cases = [{}, {"outputs": [n - 1]}, {"method": "modal"}]
        times = [[] for _ in cases]
        setup = [timed(system, 1, **case) for case in cases]
        for _ in range(REPEATS):
            for found, case in zip(times, cases, strict=True):
                found.append(timed(system, steps, **case))
        medians = [np.median(found) for found in times]
        cells = [
            f"{total / steps * 1e6:.2f} ({begin * 1e3:.1f} ms)"
            for total, begin in zip(medians, setup, strict=True)
        ]
        yield [str(n), *cells, f"{medians[0] / medians[1]:.1f}x"]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["n", "all states, us a step (set-up)", "one output", "modal, all states", "ratio"]
    show(head, rows(), parser.parse_args().markdown, width=30)


if __name__ == "__main__":
    main()
