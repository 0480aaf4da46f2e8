"""Energy errors where rounding is all there is: Brouwer's law, sqrt(N), and what it takes.

Henon & Heiles' system, the chain of Fermi, Pasta, Ulam & Tsingou with springs of 50 rad/s and the
paper's pendulum, with `lawson_gauss8` and `gauss16`. Steps go down by factors of sqrt(2) to the
first one that halving improves by less than a factor of 2, by the largest error of all states over
1e4 steps: truncation is below rounding there. Tables hold the largest relative error over 1e6 steps
beside 10 u sqrt(N), and root mean squares over 32 initial states from 1e4 to 1e7 steps, with the
slope of their logarithms from where they exceed three times those of the first 16 steps, which the
rounding of stored states makes. Then a system of one degree of freedom, y'' = -y + y^2 (Henon &
Heiles' on x = 0), over 1e8 steps. Energies are computed from stored states in the longest floats of
NumPy. Runs go on as many threads as there are cores; the times of a step are those of a thread.

A quarter of an hour on two cores, a minute with ``--quick``; the plot needs Matplotlib::

    python benches/python/rounding_limit.py [--markdown] [--quick] [--plot docs/rounding_limit.svg]
        [--steps 10000000] [--states 32] [--long 100000000] [--finer 1]
"""

import argparse
import math
import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from _table import show

import spim

U = 2.0**-53
METHODS = ("lawson_gauss8", "gauss16")
real = np.longdouble


class HenonHeiles:
    """Random states of energies from 1/24 to 1/8, regular and chaotic."""

    name, model = "Henon-Heiles", spim.models.HenonHeiles()
    coarse = {"lawson_gauss8": 0.8, "gauss16": 1.6}

    def states(self, count):
        """Initial states, (count, 4)."""
        random = np.random.default_rng(1)
        made = []
        while len(made) < count:
            z = random.normal(size=4) * 0.25
            if 1.0 / 24.0 < self.energy(z) < 1.0 / 8.0 and np.hypot(z[0], z[1]) < 0.5:
                made.append(z)
        return np.array(made)

    def energy(self, z):
        """Energies in the longest floats, (..., 4) -> (...)."""
        x, y, px, py = np.moveaxis(np.asarray(z, real), -1, 0)
        return (px * px + py * py + x * x + y * y) / 2 + x * x * y - y * y * y / 3


class Chain:
    """The usual start, amplitudes changed by some tenths."""

    name, model = "FPUT, w = 50", spim.models.FermiPastaUlamTsingou(3, 50.0)
    coarse = {"lawson_gauss8": 0.1, "gauss16": 0.1}

    def states(self, count):
        """Initial states, (count, 12)."""
        random = np.random.default_rng(2)
        z = np.tile(self.model.state(), (count, 1))
        z += random.uniform(-0.3, 0.3, z.shape) * np.repeat([1.0, 0.02, 1.0, 1.0], 3)
        return z

    def energy(self, z):
        """Energies in the longest floats, (..., 12) -> (...)."""
        x, y, px, py = np.moveaxis(np.asarray(z, real).reshape(*np.shape(z)[:-1], 4, 3), -2, 0)
        nothing = np.zeros_like(x[..., :1])
        right = np.concatenate([x - y, nothing], -1)
        left = np.concatenate([nothing, x + y], -1)
        stretched = (right - left) ** 2
        stiff = (px * px + py * py + 2500 * y * y).sum(-1) / 2
        return stiff + (stretched * stretched).sum(-1) / 4


class Pendulum:
    """The paper's start, amplitudes changed."""

    name, model = "pendulum", spim.models.CompoundPendulum()
    coarse = {"lawson_gauss8": 0.05, "gauss16": 0.1}

    def states(self, count):
        """Initial states, (count, 4)."""
        random = np.random.default_rng(3)
        z = random.uniform(-1.0, 1.0, (count, 4)) * [0.1, 0.8, 0.3, 0.5]
        z[0] = [0.1, math.pi / 6.0, 0.0, 0.0]
        return z

    def energy(self, z):
        """Energies in the longest floats, (..., 4) -> (...)."""
        x, theta, px, ptheta = np.moveaxis(np.asarray(z, real), -1, 0)
        # Rounded as the model's own.
        m, k, g = real(0.1), real(100.0), real(9.81914)
        inertia, sag = real(1.0 / 3.0), real(0.1 * 9.81914 / 100.0)
        r, half = real(1.0 + 0.1 * 9.81914 / 100.0) + x, np.sin(theta / 2)
        return (
            px * px / (2 * m)
            + ptheta * ptheta / (2 * (inertia + m * r * r))
            + g * half * half
            + m * g * (2 * r * half * half - x)
            + k * (sag + x) ** 2 / 2
        )


def errors(problem, z0, method, step, steps, every, **options):
    """Relative energy errors of the states stored, the first left out."""
    span = (0.0, steps * step)
    run = spim.integrate(problem.model, z0, span, step, method=method, every=every, **options)
    energies = problem.energy(run.z)
    return np.abs(energies[1:] / energies[0] - 1).astype(float)


def fine_step(problem, method, starts, pool):
    """The first step that halving hardly improves, and the factor."""
    found = []
    for k in range(24):
        step = problem.coarse[method] * 2.0 ** (-k / 2)
        try:
            runs = pool.map(lambda z, h=step: errors(problem, z, method, h, 10_000, 10), starts)
            found.append(max(run.max() for run in runs))
        except spim.SpimError:
            found.append(math.inf)
        # The one before the last but one had twice this step.
        if k > 1 and found[-3] < 2.0 * found[-1]:
            return 2.0 * step, found[-3] / found[-1]
    raise RuntimeError(f"{method}, {problem.name}: no step is fine enough")


def slope(counts, sizes, floor=0.0):
    """Of the logarithms, as text, where sizes are well above a floor; over a decade at least."""
    counts, sizes = np.asarray(counts), np.asarray(sizes)
    grown = sizes > 3.0 * floor
    if grown.sum() < 3 or counts[grown].max() < 10 * counts[grown].min():
        return "-"
    return f"{np.polyfit(np.log(counts[grown]), np.log(sizes[grown]), 1)[0]:.2f}"


def rows(most, states, decades, finer, pool):
    """Cells of the first table."""
    counts = np.array([m * d for d in decades for m in (1, 2, 5) if m * d <= most])
    for problem in (HenonHeiles(), Chain(), Pendulum()):
        starts = problem.states(states)
        for method in METHODS:
            step, factor = fine_step(problem, method, starts, pool)
            step /= finer
            N = min(1_000_000, most)
            worst = errors(problem, starts[0], method, step, N, 100).max()

            def run(z, problem=problem, method=method, step=step):
                begin = time.thread_time()
                found = errors(problem, z, method, step, most, 10_000)
                return found[counts // 10_000 - 1], time.thread_time() - begin

            found, seconds = zip(*pool.map(run, starts), strict=True)
            sizes = np.sqrt(np.mean(np.square(found), axis=0))
            # A stored state is rounded, what the method carries beyond it is not there.
            early = [errors(problem, z, method, step, 16, 1) for z in starts]
            floor = math.sqrt(np.mean(np.square(early)))
            at = dict(zip(counts.tolist(), sizes, strict=True))
            yield [
                problem.name,
                method,
                f"{step:.3g}",
                f"{factor:.1f}",
                f"{worst:.1e}",
                f"{10.0 * U * math.sqrt(N):.1e}",
                *(f"{at[d]:.1e}" for d in decades),
                slope(counts, sizes, floor),
                f"{np.median(seconds) / most * 1e9:.0f}",
            ]


ONE = np.array([0.0, 0.3, 0.0, 0.25])
CURVES = (
    ("gauss16", "gauss16", {}),
    ("gauss8", "gauss8", {}),
    ("lawson_gauss8", "lawson_gauss8", {}),
    ('gauss16, roundoff="tolerance"', "gauss16", {"roundoff": "tolerance"}),
    ("yoshida8", "yoshida8", {}),
)
STEP = {"gauss16": 0.4, "gauss8": 0.05, "lawson_gauss8": 0.05, "yoshida8": 0.01}


def long_runs(steps, pool):
    """(name, numbers of steps, largest errors so far) of the system of one degree of freedom."""
    problem = HenonHeiles()
    every = max(1, steps // 10_000)

    def run(curve):
        name, method, options = curve
        step = STEP[method]
        early = errors(problem, ONE, method, step, every, 1, **options)
        late = errors(problem, ONE, method, step, steps, every, **options)
        counts = np.append(np.arange(1, every), every * np.arange(1, len(late) + 1))
        found = np.append(early[: every - 1], late)
        return name, step, counts, np.maximum.accumulate(found)

    return list(pool.map(run, CURVES))


def plot(path, found):
    """Largest errors so far over the number of steps, and lines of slope 1/2."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    ax = figure.add_subplot()
    for name, step, counts, sizes in found:
        # A point a twentieth of a decade is enough.
        marks = np.unique(np.searchsorted(counts, np.geomspace(1, counts[-1], 160)))
        marks = marks[marks < len(counts)]
        ax.loglog(counts[marks], np.maximum(sizes[marks], 1e-17), label=f"{name}, h = {step:g}")
    N = np.array([1.0, found[0][2][-1]])
    for factor, style in ((10.0, "k--"), (1.0, "k:")):
        label = f"{'10 ' if factor > 1.0 else ''}u sqrt(N)"
        ax.loglog(N, factor * U * np.sqrt(N), style, linewidth=0.8, label=label)
    ax.set(xlabel="steps N", ylabel="largest relative energy error so far")
    ax.set_title("y'' = -y + y^2")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    figure.savefig(path, metadata={"Date": None} if str(path).endswith("svg") else None)


def main():
    """Print tables and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--quick", action="store_true", help="1e5 steps, 8 states, 1e6 of the last")
    parser.add_argument("--steps", type=int, default=10**7, metavar="N", help="most of 32 states")
    parser.add_argument("--states", type=int, default=32, metavar="K")
    parser.add_argument("--long", type=int, default=10**8, metavar="N", help="of one dof")
    parser.add_argument("--finer", type=float, default=1.0, metavar="F", help="than the step found")
    parser.add_argument("--plot", metavar="FILE")
    given = parser.parse_args()
    most, states, steps = given.steps, given.states, given.long
    if given.quick:
        most, states, steps = 10**5, 8, 10**6
    if most < 10**5 or steps < 10**5:
        parser.error("--steps, --long: 100000 or more, or there is no slope")
    decades = [10**d for d in range(4, 10) if 10**d <= most]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        head = ["system", "method", "step", "halving gains", "largest", "10 u sqrt(N)"]
        head += [f"RMS, {d:.0e}" for d in decades] + ["slope", "ns a step"]
        print(f"RMS over {states} states; largest to {min(most, 10**6):.0e} steps\n")
        show(head, rows(most, states, decades, given.finer, pool), given.markdown, width=14)
        found = long_runs(steps, pool)
    decades = [10**d for d in range(4, 10) if 10**d <= steps]
    print(f"\ny'' = -y + y^2: largest error so far; slope from 1e4 to {steps:.0e} steps\n")
    head = ["method", "step", *(f"to {d:.0e}" for d in decades), "slope"]
    lines = [
        [
            name,
            f"{step:g}",
            *(f"{sizes[counts <= d].max():.1e}" for d in decades),
            slope(decades, [sizes[counts <= d].max() for d in decades]),
        ]
        for name, step, counts, sizes in found
    ]
    limit = [f"{10.0 * U * math.sqrt(d):.1e}" for d in decades]
    show(head, [*lines, ["10 u sqrt(N)", "-", *limit, "0.50"]], given.markdown, width=30)
    if given.plot:
        plot(given.plot, found)


if __name__ == "__main__":
    main()
