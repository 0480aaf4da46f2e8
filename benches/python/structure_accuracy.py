"""Error against step and run time: spim, Newmark, generalized-alpha, SciPy's Radau.

A cantilever of ten elements under a step load at its tip, and the same with stiffness-proportional
damping that overdamps its highest modes, under a gust (a blade). The error is the largest one of
the tip's displacement at 200 common times, in parts of its peak. The table reads off what an error
of 1e-3 and of 1e-6 takes, on a ladder of steps (tolerances for Radau) a factor 2 apart::

    python benches/python/structure_accuracy.py [--markdown] [--plot docs/structures.svg]
"""

import argparse
import time

import numpy as np
from _beams import beam
from _table import show
from scipy.integrate import solve_ivp

import spim

ELEMENTS = 10
END = 4.0  # s; the first period is 1 s
SAMPLES = 200
LEVELS = (1e-3, 1e-6)


def cantilever():
    """Mass and stiffness of a uniform Euler-Bernoulli cantilever whose first period is 1 s."""
    M, K = beam(ELEMENTS)
    first = spim.StructuralSystem(M, K).modal(1).frequencies[0]
    return M, K * (2.0 * np.pi / first) ** 2


def cases():
    """Names and systems."""
    M, K = cantilever()
    tip = np.zeros(len(M))
    tip[-2] = 1.0
    step = spim.loads.Polynomial([tip])
    yield "beam, step load", spim.StructuralSystem(M, K, load=step)
    gust = spim.loads.Polynomial([1.0]) - spim.loads.Harmonic([1.0], 2.5)
    damping = spim.damping.rayleigh(M, K, beta=2e-3)
    shape = spim.loads.Polynomial([np.tile([1.0, 0.0], ELEMENTS) / ELEMENTS])
    yield "damped blade, gust", spim.StructuralSystem(M, K, damping=damping, load=shape * gust)


def radau(system, tolerance, times):
    """Tip displacement by SciPy, absolute tolerance that of the peak."""
    n, A = system.dof, system.A
    force = system.load
    push = np.vstack([np.zeros((n, n)), np.eye(n)])

    def rate(t, z):
        return A @ z + push @ force(t)

    found = solve_ivp(
        rate,
        (0.0, END),
        np.zeros(2 * n),
        "Radau",
        times,
        rtol=tolerance,
        atol=1e-3 * tolerance,
        jac=A,
    )
    return found.y[n - 2]


def ladders(system):
    """For each method, its name and points (step or tolerance, run time, error)."""
    n, times = system.dof, np.linspace(0.0, END, SAMPLES + 1)
    best = spim.integrate(system, system.state(), (0.0, END), END / SAMPLES, correction="exact")
    exact = best.q[:, n - 2]
    peak = np.abs(exact).max()

    def point(label, call):
        start = time.perf_counter()
        tip = call()
        return label, time.perf_counter() - start, np.abs(tip - exact).max() / peak

    def fixed(method, steps):
        run = spim.integrate(
            system, system.state(), (0.0, END), END / steps, method=method, every=steps // SAMPLES
        )
        return run.q[:, n - 2]

    fixed("auto", SAMPLES)  # what a first call costs is not a method's
    for method, most in (("auto", 3), ("newmark", 11), ("generalized_alpha", 11)):
        counts = [SAMPLES * 2**i for i in range(most)]
        yield method, [point(END / c, lambda c=c, m=method: fixed(m, c)) for c in counts]
    tolerances = [10.0**-i for i in range(2, 9)]
    yield "Radau", [point(t, lambda t=t: radau(system, t, times)) for t in tolerances]


def read_off(points, level):
    """The cheapest point within an error, as text."""
    good = [p for p in points if p[2] <= level]
    if not good:
        return f"not reached ({min(p[2] for p in points):.0e})"
    label, seconds, _ = min(good, key=lambda p: p[1])
    return f"{label:.1e}, {1e3 * seconds:.2f} ms"


def plot(results, path):
    """Errors over steps and over run times, side by side for each case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    styles = {
        "auto": ("#0072B2", "o", "spim"),
        "newmark": ("#D55E00", "s", "Newmark"),
        "generalized_alpha": ("#E69F00", "^", "generalized-α"),
        "Radau": ("#009E73", "D", "SciPy Radau"),
    }
    figure, axes = pyplot.subplots(len(results), 2, figsize=(9, 7), sharey=True)
    for row, (name, curves) in zip(axes, results.items(), strict=True):
        for method, points in curves:
            color, marker, label = styles[method]
            steps, seconds, errors = np.array(points).T
            row[1].loglog(1e3 * seconds, errors, color=color, marker=marker, label=label)
            if method != "Radau":
                row[0].loglog(steps, errors, color=color, marker=marker, label=label)
        row[0].set(xlabel="step, s", ylabel=f"{name}\nerror of the tip, of its peak")
        row[1].set(xlabel="run time, ms")
        for axis in row:
            axis.grid(alpha=0.3)
    axes[0, 1].legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None} if path.endswith("svg") else None)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--plot")
    options = parser.parse_args()
    results = {name: list(ladders(system)) for name, system in cases()}
    head = ["case", "method", *(f"error {x:.0e}: step (tolerance), time" for x in LEVELS)]
    rows = [
        [name, method, *(read_off(points, level) for level in LEVELS)]
        for name, curves in results.items()
        for method, points in curves
    ]
    show(head, rows, options.markdown, width=40)
    if options.plot:
        plot(results, options.plot)


if __name__ == "__main__":
    main()
