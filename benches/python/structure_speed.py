"""Time per step of loaded structures beside pyyeti's and SciPy's solvers.

The same M, C, K and record on every degree of freedom, all outputs stored (displacement, velocity,
acceleration), set-up included, by the default method and by modes, as `SolveUnc` does; medians over
interleaved repeats. The peers need ``pip install pyyeti``; the fair BLAS is that of one thread,
which the script sets for itself::

    python benches/python/structure_speed.py [--markdown]
"""

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.signal
from _table import show

import spim

CASES = ((6, 20_000), (15, 20_000), (60, 5_000), (240, 50_000))
STEP = 0.02
REPEATS = 5


def structure(n):
    """A damped chain of n masses between two walls, slow to fast as buildings are."""
    K = 400.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    M = np.diag(1.0 + 0.5 * np.arange(n) / n)
    return M, spim.damping.rayleigh(M, K, alpha=0.1, beta=2e-3), K


def ours(n, force, outputs, **options):
    """One run with spim, everything included."""
    M, C, K = structure(n)
    start = time.perf_counter()
    system = spim.StructuralSystem(M, K, damping=C, load=spim.loads.Sampled(force, STEP))
    ready = time.perf_counter()
    end = STEP * (len(force) - 1)
    solution = spim.integrate(system, system.state(), (0.0, end), STEP, **options)
    result = [getattr(solution, name) for name in outputs]
    return result, time.perf_counter() - start, ready - start


def theirs(solver, n, force):
    """One run with a peer, everything included."""
    M, C, K = structure(n)
    start = time.perf_counter()
    machine = solver(M, C, K, STEP)
    ready = time.perf_counter()
    solution = machine.tsolve(force.T)
    return solution.d, time.perf_counter() - start, ready - start


def lsim(n, force):
    """One run with SciPy: displacements alone."""
    M, C, K = structure(n)
    start = time.perf_counter()
    zero, unit, inverse = np.zeros((n, n)), np.eye(n), np.linalg.inv(M)
    A = np.block([[zero, unit], [-inverse @ K, -inverse @ C]])
    system = (A, np.vstack([zero, inverse]), np.hstack([unit, zero]), zero)
    ready = time.perf_counter()
    _, q, _ = scipy.signal.lsim(system, force, STEP * np.arange(len(force)))
    return q.T, time.perf_counter() - start, ready - start


def rows():
    """Cells of the table."""
    try:
        from pyyeti import ode
    except ImportError:
        ode = None
    rng = np.random.default_rng(0)
    for n, steps in CASES:
        force = rng.normal(size=(steps + 1, n))
        every = ["q", "v", "a"]
        calls = [
            lambda n=n, force=force, every=every: ours(n, force, every),
            lambda n=n, force=force, every=every: ours(n, force, every, method="modal"),
        ]
        calls.append(lambda n=n, force=force: lsim(n, force))
        if ode is not None:
            solvers = [ode.SolveExp2, ode.SolveUnc]
            calls += [lambda n=n, f=force, solver=s: theirs(solver, n, f) for s in solvers]
        found = [call() for call in calls]
        for displacement, _, _ in found[2:]:
            difference = np.abs(displacement.T - found[0][0][0]).max()
            assert difference <= 1e-6 * np.abs(displacement).max(), difference
        times = [[] for _ in calls]
        for _ in range(REPEATS if n < 240 else 1):
            for call, measured in zip(calls, times, strict=True):
                measured.append(call()[1:])
        medians = [np.median(measured, axis=0) for measured in times]
        cells = [f"{total / steps * 1e6:.2f} ({ready * 1e3:.1f} ms)" for total, ready in medians]
        peers = [total for total, _ in medians[3:]]
        ratios = [f"{min(peers) / total:.1f}x" if peers else "-" for total, _ in medians[:2]]
        yield [str(n), str(steps), *cells, *["-"] * (5 - len(cells)), *ratios]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["n", "steps", "default, us a step (set-up)", "modal", "lsim (q alone)"]
    show(
        [*head, "SolveExp2", "SolveUnc", "ratio", "modal"],
        rows(),
        parser.parse_args().markdown,
        width=26,
    )


if __name__ == "__main__":
    main()
