"""Errors of a free-free beam under a polynomial, a resonant and a decaying load, by correction.

Against ``tests/data/loads.npz``, 1000 steps, in parts of the largest component at that step::

    python benches/python/load_accuracy.py [--markdown]
"""

import argparse
from pathlib import Path

import numpy as np
from _table import show

import spim

DATA = np.load(Path(__file__).parents[2] / "tests" / "data" / "loads.npz")
PERIODS = ("0.1", "1.3", "10.7")


def rows():
    """Cells of the table: largest errors of displacements and of velocities."""
    load = (
        spim.loads.Polynomial(DATA["polynomial"])
        + spim.loads.Harmonic(DATA["harmonic"], float(DATA["frequency"]), float(DATA["phase"]))
        + spim.loads.Exponential(DATA["exponential"], float(DATA["rate"]))
    )
    beam = spim.StructuralSystem(DATA["mass"], DATA["stiffness"], load=load)
    cases = zip(PERIODS, DATA["steps"], DATA["states"], DATA["velocities"], strict=True)
    for periods, step, states, velocities in cases:
        for correction in ("exact", "none"):
            run = spim.integrate(
                beam, beam.state(), (0.0, 1000 * step), step, correction=correction
            )
            errors = []
            for found, exact in ((run.q, states[:, : beam.dof]), (run.v, velocities)):
                off = np.abs(found[DATA["counts"]] - exact).max(axis=1)
                errors.append((off / np.abs(exact).max(axis=1)).max())
            yield [periods, correction, *(f"{error:.1e}" for error in errors)]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["step, shortest periods", "correction", "displacement", "velocity"]
    show(head, rows(), parser.parse_args().markdown, width=24)


if __name__ == "__main__":
    main()
