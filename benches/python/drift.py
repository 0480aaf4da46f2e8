"""Energy error of the three oscillators, tau = 1, over 1e8 steps, beside SciPy's propagator.

Prints the largest relative error by decade; draws `out/drift.png` where Matplotlib is installed::

    python benches/python/drift.py [--steps 100000000] [--markdown]
"""

import argparse
import time
from pathlib import Path

import numpy as np
import scipy.linalg
from _table import show

import spim

Z0 = np.array([0.0, 0, 0, 2, 2, 2])
ROWS = 10_000  # states kept of each run


def energies_of_scipy(osc, tau, steps, every):
    """Energies by SciPy's exponential, its powers by squaring: `every` steps at once."""
    W = scipy.linalg.expm(tau * osc.A)
    leap = np.linalg.matrix_power(W, every)
    states = np.empty((steps // every + 1, 6))
    states[0] = Z0
    for k in range(len(states) - 1):
        states[k + 1] = leap @ states[k]
    return osc.energy(states)


def runs(steps):
    """Name, steps of the stored states, relative energy errors and seconds of each run."""
    osc = spim.models.Oscillators([0.1, 10, 1000], [100, 10, 1])
    every = max(1, steps // ROWS)
    k = np.arange(steps // every + 1) * every
    for correction in ("exact", "polish", "none"):
        p = spim.Propagator(osc, 1.0, correction=correction)
        start = time.perf_counter()
        energy = osc.energy(p.trajectory(Z0, steps, every=every))
        yield correction, k, np.abs(energy / energy[0] - 1), time.perf_counter() - start
    start = time.perf_counter()
    energy = energies_of_scipy(osc, 1.0, steps, every)
    name = f"SciPy, {every} steps at once"
    yield name, k, np.abs(energy / energy[0] - 1), time.perf_counter() - start


def main():
    """Run, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=10**8)
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    found = list(runs(options.steps))
    decades = [10**d for d in range(5, 10) if 10**d <= options.steps]
    head = ["correction", *(f"to {d:.0e} steps" for d in decades), "s"]
    rows = [
        [name, *(f"{error[k <= d].max():.1e}" for d in decades), f"{seconds:.2f}"]
        for name, k, error, seconds in found
    ]
    show(head, rows, options.markdown, width=24)
    draw(found, Path("out"))


def draw(found, folder):
    """Draw the errors against the number of steps, where Matplotlib is installed."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    figure = Figure(figsize=(7, 4), layout="constrained")
    ax = figure.add_subplot()
    for name, k, error, _ in found:
        ax.loglog(k[1:], np.maximum.accumulate(error[1:]) + 1e-17, label=name)
    ax.set(xlabel="steps", ylabel="largest relative energy error so far")
    ax.set_title("three oscillators, tau = 1 s")
    figure.legend(loc="outside lower center", ncols=4)
    folder.mkdir(exist_ok=True)
    figure.savefig(folder / "drift.png", dpi=150)


if __name__ == "__main__":
    main()
