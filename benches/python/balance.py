"""Balance of energy of damped, loaded chains: change of energy + dissipated - work.

2000 steps, in parts of the largest of energy, work and dissipated energy::

    python benches/python/balance.py [--markdown]
"""

import argparse

import numpy as np
from _table import show

import spim

STEP, STEPS = 0.02, 2000


def rows():
    """Cells of the table."""
    record = np.random.default_rng(0).normal(size=STEPS + 1)
    for n in (5, 20, 60, 240):
        M = np.diag(1.0 + 0.5 * np.arange(n) / n)
        K = 4e4 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        C = spim.damping.rayleigh(M, K, alpha=0.1, beta=1e-4)
        shaken = spim.loads.GroundMotion(spim.loads.Sampled(record, STEP), np.ones(n))
        load = shaken + spim.loads.Harmonic(np.ones(n), 3.0)
        chain = spim.StructuralSystem(M, K, damping=C, load=load)
        start = chain.state(v=np.ones(n))
        cells = [str(n)]
        for correction in ("none", "exact"):
            end = STEPS * STEP
            run = spim.integrate(chain, start, (0.0, end), STEP, correction=correction)
            size = max(run.energy.max(), np.abs(run.work).max(), run.dissipated[-1])
            cells.append(f"{np.abs(run.balance_error).max() / size:.1e}")
        yield cells


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["degrees of freedom", "default", 'correction="exact"']
    show(head, rows(), parser.parse_args().markdown)


if __name__ == "__main__":
    main()
