"""What rounding leaves on stiff beams: energy, states, balance of energy, propagators.

Errors of the ways of stepping, beside SciPy's exponential where it can do the same::

    python benches/python/stiff_beams.py [--markdown]
"""

import argparse

import numpy as np
import scipy.linalg
from _beams import beam
from _table import show

import spim

WAYS = {
    "default": {},
    "energy coordinates": {"coordinates": "energy"},
    "exact": {"correction": "exact"},
    "modal": {"method": "modal"},
}


def fastest(M, K):
    """rad/s."""
    return spim.StructuralSystem(M, K).modal().frequencies[-1]


def energy():
    """Largest relative change of energy of 80 elements let go from a static deflection."""
    M, K = beam(80)
    system, tau = spim.StructuralSystem(M, K), 314.0 / fastest(M, K)
    start = system.state(q=np.linalg.solve(K, np.eye(len(M))[-2]))
    for options in WAYS.values():
        run = spim.integrate(system, start, (0.0, 20_000 * tau), tau, every=100, **options)
        yield np.abs(run.energy / run.energy[0] - 1.0).max()
    W, z, states = scipy.linalg.expm(tau * system.A), start, [start]
    for step in range(1, 20_001):
        z = W @ z
        if step % 100 == 0:
            states.append(z)
    found = system.energy(np.array(states))
    yield np.abs(found / found[0] - 1.0).max()


def motion(angle):
    """Largest error of displacements, in parts of the peak, against the exact correction."""
    M, K = beam(80)
    load = spim.loads.Harmonic(np.eye(len(M))[-2], 10.0)
    system, tau = spim.StructuralSystem(M, K, load=load), angle / fastest(M, K)

    def displacements(options):
        return spim.integrate(system, system.state(), (0.0, 100 * tau), tau, **options).q

    exact = displacements(WAYS["exact"])
    for name, options in WAYS.items():
        if name == "exact":
            yield None
        else:
            yield np.abs(displacements(options) - exact).max() / np.abs(exact).max()


def balance(angle):
    """Largest balance error of a damped, loaded cantilever in parts of the largest energy."""
    M, K = beam(60)
    C = spim.damping.rayleigh(M, K, alpha=0.1, beta=1e-4)
    load = spim.loads.Harmonic(np.eye(len(M))[-2], 10.0)
    system, tau = spim.StructuralSystem(M, K, damping=C, load=load), angle / fastest(M, K)
    for options in WAYS.values():
        run = spim.integrate(system, system.state(), (0.0, 1000 * tau), tau, **options)
        yield np.abs(run.balance_error).max() / run.energy.max()


def propagators():
    """Largest error of a free beam's propagator, in parts of its largest entry."""
    M, K = beam(4, free=True)
    system = spim.StructuralSystem(M, K)
    # A power of two: its product with A is then exact for all.
    tau = 2.0 ** np.round(np.log2(900.0 / fastest(M, K)))
    exact = spim.expm(tau * system.A, method="exact")
    found = [
        spim.Propagator(system, tau, correction="none").matrix,
        spim.Propagator(system, tau, method="half", correction="none").matrix,
        scipy.linalg.expm(tau * system.A),
    ]
    default, half, peer = (np.abs(W - exact).max() / np.abs(exact).max() for W in found)
    yield from (default, None, None, None, peer, half)


def rows():
    """Cells of the table."""
    lines = [("energy, 80 elements, tau w = 314, 2e4 steps", energy())]
    for angle in (314.0, 1e4):
        lines.append((f"displacements, 80 elements, tau w = {angle:g}", motion(angle)))
    for angle in (1.0, 10.0, 9000.0):
        lines.append((f"balance, 60 elements, damped, tau w = {angle:g}", balance(angle)))
    lines.append(("propagator, free, 4 elements, tau w = 900", propagators()))
    for what, values in lines:
        cells = ["-" if value is None else f"{value:.1e}" for value in values]
        yield [what, *cells, *["-"] * (len(WAYS) + 2 - len(cells))]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["error of", *WAYS, "SciPy", "half"]
    show(head, rows(), parser.parse_args().markdown, width=44)


if __name__ == "__main__":
    main()
