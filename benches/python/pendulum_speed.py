"""Time of the paper's pendulum over 0-10 s, beside heyoka and the paper's own comparison.

`spim.models.CompoundPendulum`, the state at the end alone, through Python: whole calls of
`spim.integrate`, set-up included, beside `propagate_until` of heyoka's Taylor integrator, which was
compiled before (told apart). Steps and tolerances are scanned for both, and heyoka's equations are
taken in the canonical variables and with velocities, in compact mode and not; rows are those that
nothing of their kind beats. Errors are the largest of the four components, in SI units, against
heyoka in the longest floats of the machine. Then the paper's own schemes at its steps. Medians over
interleaved repeats. Half a minute; needs ``pip install heyoka`` for the peer::

    python benches/python/pendulum_speed.py [--markdown] [--quick]
"""

import argparse
import itertools

import numpy as np
from _peers import forget_compiled, medians, missing, unbeaten
from _pendulum import FORMS, SPAN, START, ours, reference, taylor
from _table import show

import spim

# Steps in the span, by stages.
STEPS = {
    3: (2000, 3000, 4000, 6000),
    4: (600, 800, 1000, 1200, 1600, 2000),
    6: (250, 300, 350, 400, 450, 500, 600),
    8: (110, 120, 130, 140, 150, 160, 170, 180, 190, 200, 220, 250, 300),
    12: (50, 56, 60, 62, 65, 68, 70, 75, 80, 90, 100, 110, 120),
    16: (36, 38, 40, 42, 44, 46, 48, 50, 52, 55, 58, 60, 65, 70, 75, 80, 90, 100),
}
GAUSS = ("gauss16", "gauss24", "gauss32")
# When iterations end.
ENDINGS = ("minimal", "tolerance", *(("tolerance", 10.0**k) for k in (-15, -14, -13, -12, -11)))
TOLERANCES = (*(m * 10.0**-k for k in range(9, 15) for m in (1.0, 0.5, 0.2)), 1e-15, 2.0**-52)
BOUNDS = (2e-14, 1e-12)
# Larger errors are no rows.
WORST = 1e-8


def stages(name):
    """Half the order that a name ends with."""
    return int(name[name.index("gauss") + len("gauss") :]) // 2


def said(ending):
    """An ending in words, but for that of the label."""
    if ending in (None, "minimal"):
        return ""
    return f", {ending}" if isinstance(ending, str) else f", {ending[0]} {ending[1]:.0e}"


def own_cases():
    """(kind, label, setting, run, seconds to compile) of spim's methods."""
    for record in spim.methods():
        name = record.name
        if name not in GAUSS and not name.startswith("lawson_gauss"):
            continue
        # Fewer stages never get there.
        if stages(name) not in STEPS:
            continue
        endings = ENDINGS if "roundoff" in record.options else (None,)
        for ending, steps in itertools.product(endings, STEPS[stages(name)]):
            options = {} if ending is None else {"roundoff": ending}
            label = f"{name}, minimal" if ending == "minimal" else name
            setting = f"{steps} steps{said(ending)}"
            kind = "spim, drift-free" if ending == "minimal" else "spim"
            yield kind, label, setting, ours(name, steps, **options), 0.0


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
    """The first table; the best (seconds, name) by kind and bound of the error."""
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
