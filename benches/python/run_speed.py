"""Time of a call of `spim.Run.step`, beside the two lines of NumPy it stands for.

Usage::

    python benches/python/run_speed.py [--markdown]
"""

import argparse
import timeit

import numpy as np
from _table import show

import spim

CALLS, REPEATS = 5000, 9


def nanoseconds(call):
    """Median time of a call."""
    return np.median(timeit.repeat(call, number=CALLS, repeat=REPEATS)) / CALLS * 1e9


def rows():
    """Cells of the table: nanoseconds a call."""
    for n in (6, 30):
        K = 400.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        system = spim.StructuralSystem(np.eye(n), K)
        run, force = spim.Run(system, system.state(), step=0.01), np.ones(n)
        W, B = spim.discretize(system.A, np.vstack([0.0 * K, np.eye(n)]), 0.01)
        z = system.state()
        calls = [
            run.step,
            lambda run=run, force=force: run.step(force),
            lambda W=W, B=B, z=z, force=force: W @ z + B @ force,
        ]
        yield [str(n), *(f"{nanoseconds(call):.0f}" for call in calls)]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["degrees of freedom", "step()", "step(force)", "W @ z + B @ u"]
    show(head, rows(), parser.parse_args().markdown)


if __name__ == "__main__":
    main()
