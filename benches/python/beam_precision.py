"""Error over time of the rotating beam, beside heyoka's and SciPy's integrators.

The paper's beam with a free hub: two elements over 0.5 s, eight over 0.1 s, from rest and bent.
Errors are the largest of all coordinates (m and rad) at the end, against heyoka in the longest
floats of the machine. The right side of heyoka is compared with the beam's first. Only the end is
stored. Times are medians over interleaved repeats; heyoka's compilation is told apart. Runs that
begin with more than a second are repeated less often. Peers need ``pip install heyoka mpmath
scipy``, the plot Matplotlib::

    python benches/python/beam_precision.py [--markdown] [--plot] [--elements 2 8]
"""

import argparse
import importlib.util
import itertools
import pathlib
import sys
import time

import numpy as np
from _heyoka import FORMS, equations, rate
from _table import show

import spim

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tests" / "python"))
from beams import paper

SPANS = {2: 0.5, 8: 0.1}
# Steps in a span.
STEPS = {
    2: {
        "srk2": (5000, 20_000, 80_000),
        "gauss4": (5000, 10_000, 20_000),
        "gauss8": (1000, 2000, 4000, 8000),
        "gauss16": (250, 300, 400, 500, 600, 800),
    },
    8: {
        "srk2": (1000, 5000, 20_000),
        "gauss4": (2000, 4000, 10_000),
        "gauss8": (500, 1000, 2000, 4000),
        "gauss16": (150, 200, 300, 400, 600),
    },
}
HEYOKA = (1e-6, 1e-9, 1e-11, 1e-12, 1e-13, 2.0**-52)
SCIPY = {"DOP853": (1e-6, 1e-9, 1e-12), "Radau": (1e-3, 1e-5)}
EQUAL = 1e-11
REPEATS = 15
# Seconds of all repeats of a row, and beyond which one run is enough.
AT_MOST, LONG = 8.0, 4.0


def installed(*names):
    """Whether all can be imported; says what to install."""
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if missing:
        print(f"left out: pip install {' '.join(missing)}", file=sys.stderr)
    return not missing


def forget_compiled():
    """Makes heyoka compile anew, whatever it has kept of former runs."""
    import heyoka

    for name, arguments in (("set_diskcache_enabled", (False,)), ("clear_memcache", ())):
        if hasattr(heyoka.llvm_state, name):
            getattr(heyoka.llvm_state, name)(*arguments)


def start(n):
    """Beam and state."""
    beam = paper(elements=n)
    if n == 2:
        return beam, beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    bent = {"u": lambda x: x / 40.0, "v": lambda x: x**2 / 64.0, "theta": lambda x: x / 32.0}
    return beam, beam.state(**bent)


def ours(n, method, steps):
    """A run with spim as a function, and no time to compile."""
    beam, z = start(n)
    span = (0.0, SPANS[n])
    step = SPANS[n] / steps

    def run():
        solution = spim.integrate(beam, z, span, step, method=method, every=steps)
        return solution.z[-1, : beam.dof]

    return run, 0.0


def heyoka_run(n, form, tolerance, real=float, **options):
    """A run with heyoka as a function, and the time to compile."""
    import heyoka

    beam, z = start(n)
    made = equations(beam, z[-1], form, real)
    first = made.start(z).astype(real)
    begin = time.perf_counter()
    machine = heyoka.taylor_adaptive(
        made.system, first, tol=real(tolerance), fp_type=real, **options
    )
    compiling = time.perf_counter() - begin

    def run():
        machine.time = real(0.0)
        machine.state[:] = first
        outcome = machine.propagate_until(real(SPANS[n]))
        assert outcome[0] == heyoka.taylor_outcome.time_limit, outcome
        return made.coordinates(machine.state)

    return run, compiling


def scipy_run(n, method, tolerance):
    """A run with SciPy as a function, and no time to compile."""
    from scipy.integrate import solve_ivp

    beam, z = start(n)
    scale = np.abs(beam.rates(z)).max() + np.abs(z).max()

    def run():
        found = solve_ivp(
            lambda t, z: beam.rate(z, t),
            (0.0, SPANS[n]),
            z,
            method=method,
            t_eval=[SPANS[n]],
            rtol=max(tolerance, 3e-14),
            atol=tolerance * scale,
        )
        return found.y[: beam.dof, -1]

    return run, 0.0


def check(n):
    """Largest difference of heyoka's right sides from the beam's, in parts of the largest entry."""
    beam, z = start(n)
    random = np.random.default_rng(0)
    N = beam.dof
    z[N - 1 : 2 * N - 1] = 0.1 * random.normal(size=N)
    wanted, worst = beam.rate(z), 0.0
    for form in FORMS:
        found = rate(equations(beam, z[-1], form), z)
        for part in (slice(0, N), slice(N, 2 * N)):
            difference = np.abs(found[part] - wanted[part]).max() / np.abs(wanted[part]).max()
            worst = max(worst, difference)
    assert worst <= 1e-12, worst
    return worst


def reference(n):
    """Coordinates at the end, and the name and eps of the floats they were computed with."""
    import heyoka

    longest = "taylor_adaptive_ldbl" in dir(heyoka) and np.finfo(np.longdouble).eps < 2e-16
    real = np.longdouble if longest else float
    eps = np.finfo(real).eps
    run, _ = heyoka_run(n, "physical", eps, real, compact_mode=True, high_accuracy=True)
    return run(), f"eps = {eps:.0e}"


def cases(n):
    """(method, step or tolerance, how to make a run)."""
    for method, counts in STEPS[n].items():
        for steps in counts:
            yield f"spim {method}", f"h = {SPANS[n] / steps:.3g}", (ours, n, method, steps)
    for form, tolerance in itertools.product(FORMS, HEYOKA):
        yield f"heyoka {form}", f"tol {tolerance:.0e}", (heyoka_run, n, form, tolerance)
    for method, tolerances in SCIPY.items():
        for tolerance in tolerances:
            yield f"SciPy {method}", f"tol {tolerance:.0e}", (scipy_run, n, method, tolerance)


def measure(n):
    """Rows (method, setting, error, seconds, seconds to compile) of so many elements."""
    right, floats = reference(n)
    print(f"{n} elements, 0..{SPANS[n]} s; right sides differ by {check(n):.0e} of the largest")
    print(f"entry; reference with {floats}")
    rows, runs = [], []
    for method, setting, (make, *arguments) in cases(n):
        run, compiling = make(*arguments)
        try:
            begin = time.perf_counter()
            found = run()
            first = time.perf_counter() - begin
        except (spim.SpimError, RuntimeError, ArithmeticError) as error:
            print(f"{method}, {setting}: {str(error)[:150]}")
            continue
        rows.append([method, setting, float(np.abs(found - right).max()), [first], compiling])
        runs.append(run)
    for repeat in range(REPEATS):
        for row, run in zip(rows, runs, strict=True):
            first = row[3][0]
            if first > LONG or repeat * first > AT_MOST:
                continue
            begin = time.perf_counter()
            run()
            row[3].append(time.perf_counter() - begin)
    # The first run is for warming up, unless it is the only one.
    return [[*row[:3], np.median(row[3][1:] or row[3]), row[4]] for row in rows]


def at_equal_error(rows, method, error=EQUAL):
    """Time at an error, by interpolation of logarithms between the points that nothing beats."""
    points = sorted((row[2], row[3]) for row in rows if row[0] == method)
    best, least = [], np.inf
    for e, seconds in points:
        if seconds < least:
            best.append((max(e, 1e-17), seconds))
            least = seconds
    if not best or error < best[0][0]:
        return None
    errors, times = np.log(best).T
    return float(np.exp(np.interp(np.log(error), errors, times)))


def read_off(rows):
    """Lines with times at an equal error."""
    found = {method: at_equal_error(rows, method) for method in dict.fromkeys(r[0] for r in rows)}
    found = {method: seconds for method, seconds in found.items() if seconds is not None}
    peers = [v for k, v in found.items() if k.startswith("heyoka")]
    best = min(peers) if peers else None
    for method, seconds in found.items():
        more = ""
        if best is not None and method.startswith("spim"):
            more = f"; heyoka/spim {best / seconds:.2f}"
        yield f"time at equal error {EQUAL:.0e}: {method} {seconds * 1e3:.3f} ms{more}"


def plot(n, rows):
    """Error over time in out/."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(9.0, 5.0), layout="constrained")
    for method in dict.fromkeys(row[0] for row in rows):
        points = sorted((row[3] * 1e3, row[2]) for row in rows if row[0] == method)
        style = "o-" if method.startswith("spim") else "s--"
        axes.loglog(*zip(*points, strict=True), style, label=method, markersize=4)
    axes.set_xlabel("time, ms (median)")
    axes.set_ylabel("largest error of a coordinate at the end, m or rad")
    axes.set_title(f"the paper's beam, {n} elements, 0 to {SPANS[n]} s")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper")
    place = pathlib.Path("out")
    place.mkdir(exist_ok=True)
    figure.savefig(place / f"beam_precision_{n}.png", dpi=150)
    plt.close(figure)


def main():
    """Print tables and read-off lines."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--plot", action="store_true")
    parser.add_argument("--elements", type=int, nargs="+", default=list(SPANS), choices=SPANS)
    given = parser.parse_args()
    if not installed("heyoka", "mpmath", "scipy"):
        print("left out: the reference solution is heyoka's")
        return
    forget_compiled()
    for n in given.elements:
        rows = measure(n)
        print()
        head = ["method", "setting", "error", "time, ms", "compiling, s"]
        cells = (
            [m, s, f"{e:.1e}", f"{t * 1e3:.3f}", f"{c:.1f}" if c else "-"] for m, s, e, t, c in rows
        )
        show(head, cells, given.markdown)
        print("\n" + "\n".join(read_off(rows)) + "\n", flush=True)
        if given.plot and installed("matplotlib"):
            plot(n, rows)


if __name__ == "__main__":
    main()
