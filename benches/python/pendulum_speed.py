"""Time of the paper's pendulum over 0-10 s, beside heyoka and the paper's own comparison.

`spim.models.CompoundPendulum`, the state at the end alone, through Python: whole calls of
`spim.integrate`, set-up included, beside `propagate_until` of heyoka's Taylor integrator, which was
compiled before (told apart). Steps and tolerances are scanned for both, and heyoka's equations are
taken in the canonical variables and with velocities, in compact mode and not; rows are those that
nothing of their kind beats. Errors are the largest of the four components, in SI units, against
heyoka in the longest floats of the machine. Then the paper's own schemes at its steps, and right
sides of one's own: a numba cfunc beside heyoka, Python functions beside SciPy's DOP853. Medians over
interleaved repeats. Half a minute; peers need ``pip install heyoka numba scipy``::

    python benches/python/pendulum_speed.py [--markdown] [--quick]
"""

import argparse
import itertools
import math

import numpy as np
from _peers import forget_compiled, heyoka_run, longest, medians, missing, unbeaten
from _table import show

import spim

SPAN = 10.0
START = (0.1, math.pi / 6.0, 0.0, 0.0)
# Steps in the span, by stages.
STEPS = {
    1: (100_000,),
    2: (10_000, 20_000, 40_000),
    3: (2000, 3000, 4000, 6000),
    4: (600, 800, 1000, 1200, 1600, 2000),
    6: (250, 300, 350, 400, 450, 500, 600),
    8: (110, 120, 130, 140, 150, 160, 180, 200, 220, 250, 300),
    12: (50, 60, 65, 70, 75, 80, 90, 100, 110, 120),
    16: (36, 40, 45, 50, 55, 60, 65, 70, 75, 80, 90, 100),
}
GAUSS = ("gauss16", "gauss24", "gauss32")
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15, 2.0**-52)
FORMS = ("canonical", "velocities")
BOUNDS = (2e-14, 1e-12)
# Larger errors are no rows.
WORST = 1e-8


def constants():
    """Numbers of the model: inertia, bead mass, distance at rest, stiffness, gravity, M L/2."""
    M, L, m, k, g = 1.0, 1.0, 0.1, 100.0, 9.81914
    real = longest() if missing("heyoka") is None else float
    M, L, m, k, g = map(real, (M, L, m, k, g))
    return M * L * L / 3, m, L + m * g / k, k, g, M * L / 2


def taylor(form, tolerance, real=float, **options):
    """A run with heyoka, in canonical variables or with velocities."""
    import heyoka as hy

    inertia, m, rest, k, g, arm = (hy.expression(real(v)) for v in constants())
    x, theta = hy.make_vars("x", "theta")
    bead = rest + x
    sin, cos = hy.sin(theta), hy.cos(theta)
    if form == "canonical":
        px, ptheta = hy.make_vars("px", "ptheta")
        rate = ptheta / (inertia + m * bead * bead)
        system = [
            (x, px / m),
            (theta, rate),
            (px, m * bead * rate * rate - k * x - m * g * (1.0 - cos)),
            (ptheta, -(arm + m * bead) * g * sin),
        ]
        return heyoka_run(system, START, SPAN, tolerance, None, real, **options)
    v, rate = hy.make_vars("v", "rate")
    system = [
        (x, v),
        (theta, rate),
        (v, bead * rate * rate - k / m * x - g * (1.0 - cos)),
        (
            rate,
            -((arm + m * bead) * g * sin + 2.0 * m * bead * v * rate) / (inertia + m * bead * bead),
        ),
    ]
    numbers = [float(value) for value in constants()]

    def canonical(z):
        inertia, m, rest = numbers[:3]
        x, theta, v, rate = z
        return np.array([x, theta, m * v, (inertia + m * (rest + x) ** 2) * rate])

    return heyoka_run(system, START, SPAN, tolerance, canonical, real, **options)


def ours(method, steps, system=None, **options):
    """A run with spim as a function."""
    system = spim.models.CompoundPendulum() if system is None else system

    def run():
        solution = spim.integrate(
            system, START, (0.0, SPAN), SPAN / steps, method=method, every=steps, **options
        )
        return solution.z[-1]

    return run


def reference():
    """The state at the end, and how it was found."""
    own = ours("gauss32", 400)()
    if missing("heyoka"):
        return own, "spim's gauss32 in 400 steps"
    real = longest()
    eps = np.finfo(real).eps
    right = taylor("canonical", eps, real, compact_mode=True, high_accuracy=True)[0]()
    apart = float(np.abs(own - right).max())
    assert apart <= 1e-14, apart
    return right, f"heyoka with eps = {eps:.0e}, {apart:.0e} from gauss32 in 400 steps"


def stages(name):
    """Half the order that a name ends with."""
    return int(name[name.index("gauss") + len("gauss") :]) // 2


def own_cases():
    """(kind, label, setting, run, seconds to compile) of spim's methods."""
    for record in spim.methods():
        name = str(getattr(record, "name", record))
        if name not in GAUSS and not name.startswith("lawson_gauss"):
            continue
        # One or two stages never get there.
        if stages(name) < 3:
            continue
        endings = ("minimal", "tolerance") if "roundoff" in options_of(record) else (None,)
        for ending, steps in itertools.product(endings, STEPS[stages(name)]):
            options = {} if ending is None else {"roundoff": ending}
            label = name if ending is None else f"{name}, {ending}"
            free = ending == "minimal"
            kind = "spim, drift-free" if free else "spim"
            yield kind, label, f"{steps} steps", ours(name, steps, **options), 0.0


def options_of(record):
    """Names of the options of a method."""
    return [getattr(option, "name", option) for option in getattr(record, "options", ())]


def heyoka_cases(quick):
    """The same of heyoka's."""
    tolerances = TOLERANCES[1::2] if quick else TOLERANCES
    for form, compact in itertools.product(FORMS, (False, True)):
        for tolerance in tolerances:
            run, compiling = taylor(form, tolerance, compact_mode=compact)
            label = f"heyoka {form}{', compact' if compact else ''}"
            name = "default" if tolerance == 2.0**-52 else f"{tolerance:.0e}"
            yield "heyoka", label, f"tol {name}", run, compiling


def native(right, quick, markdown):
    """The first table; the best times of heyoka at the bounds, by interpolation between none."""
    cases = list(own_cases())
    if missing("heyoka") is None:
        cases += heyoka_cases(quick)
    good = []
    for case in cases:
        try:
            error = float(np.abs(case[3]() - right).max())
        except spim.SpimError:
            continue
        # Not a number is no row either.
        if error <= WORST:
            good.append((case, error))
    seconds = medians([case[3] for case, _ in good], 15 if quick else 101)
    rows = []
    for label in dict.fromkeys(case[1] for case, _ in good):
        mine = [i for i, (case, _) in enumerate(good) if case[1] == label]
        kept = unbeaten([(good[i][1], seconds[i]) for i in mine])
        rows += [(*good[mine[i]][0], good[mine[i]][1], seconds[mine[i]]) for i in kept]
    cells = (
        [label, setting, f"{error:.1e}", f"{t * 1e6:.1f}", f"{compiling:.2f}" if compiling else "-"]
        for _, label, setting, _, compiling, error, t in rows
    )
    show(["method", "setting", "error", "time, us", "compiling, s"], cells, markdown, width=28)
    print()
    return {
        (kind, bound): min(
            (r[6], f"{r[1]}, {r[2]}") for r in rows if r[0] in kinds and r[5] <= bound
        )
        for kind, kinds in (
            ("heyoka", ("heyoka",)),
            ("spim", ("spim", "spim, drift-free")),
            ("spim, drift-free", ("spim, drift-free",)),
        )
        for bound in BOUNDS
        if any(r[0] in kinds and r[5] <= bound for r in rows)
    }


def read_off(best, markdown):
    """The second table: best times at an error, and ratios."""
    rows = []
    for (kind, bound), (seconds, name) in best.items():
        peer = best.get(("heyoka", bound))
        ratio = f"{peer[0] / seconds:.2f}" if peer and kind != "heyoka" else "-"
        rows.append([f"{bound:.0e}", kind, name, f"{seconds * 1e6:.1f}", ratio])
    rows.sort(key=lambda row: (float(row[0]), row[1]))
    show(["error at most", "", "best", "time, us", "heyoka/spim"], rows, markdown, width=34)
    model = spim.models.CompoundPendulum()
    one = [
        lambda m=m: spim.integrate(model, START, (0.0, 0.1), 0.1, method=m) for m in ("rk4", *GAUSS)
    ]
    found = ", ".join(
        f"{m} {t * 1e6:.1f}" for m, t in zip(("rk4", *GAUSS), medians(one, 101), strict=True)
    )
    print(
        f"\nus of a call that makes one step (the cost of calling and making a method): {found}\n"
    )


def papers(right, quick, markdown):
    """The paper's own comparison."""
    cases = (
        ("spim_explicit", 1000, "-"),
        ("spim_pc", 1000, "0.079"),
        ("rk4", 100_000, "753"),
        ("rk4", 1000, "0.656"),
    )
    runs = [ours(method, steps) for method, steps, _ in cases]
    errors = [float(np.abs(run() - right).max()) for run in runs]
    seconds = medians(runs, 5 if quick else 31)
    rows = [
        [method, f"{SPAN / steps:g}", f"{error:.1e}", f"{t * 1e3:.3f}", paper]
        for (method, steps, paper), error, t in zip(cases, errors, seconds, strict=True)
    ]
    show(["the paper's comparison", "step, s", "error", "time, ms", "paper, s"], rows, markdown, 24)
    print()


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--quick", action="store_true", help="fewer repeats and tolerances")
    given = parser.parse_args()
    if missing("heyoka"):
        print(missing("heyoka") + "\n")
    else:
        forget_compiled()
    right, how = reference()
    print(f"0..{SPAN:g} s; kernels {spim.kernel_level()}; reference: {how}\n")
    best = native(right, given.quick, given.markdown)
    read_off(best, given.markdown)
    papers(right, given.quick, given.markdown)


if __name__ == "__main__":
    main()
