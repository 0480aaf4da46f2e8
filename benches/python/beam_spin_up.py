"""Time of the spin-up of Kane, Ryan & Banerjee, beside exudyn's at the best settings found.

A beam of 10 m is brought from rest to 6 rad/s within 15 s; 0 to 20 s, the tip's deflection kept at
every step. A step of srk2 solves two implicit systems, one of exudyn's generalized alpha solves
one. exudyn's settings are searched first, each in a process of its own that is ended after some
seconds: with tight tolerances its Newton iteration stalls and its steps shrink. "Best" is the
fastest whose peak is within 1e-3 of that of its own equations solved tightly. Times are medians
over interleaved repeats of whole runs, models made before. Needs ``pip install exudyn``::

    python benches/python/beam_spin_up.py [--markdown] [--quick]

``--quick`` takes the settings that were best before in place of the search.
"""

import argparse
import importlib.util
import json
import pathlib
import subprocess
import sys
import time

import numpy as np
from _exudyn import ELEMENTS, END, SETTINGS, spin_up
from _table import show

import spim

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tests" / "python"))
from beams import kane

REPEATS, LIMIT = 5, 15.0
STEP = SETTINGS["step"]
FULL = {"useModifiedNewton": False}
TIGHT = {**FULL, "relativeTolerance": 1e-8, "absoluteTolerance": 1e-4}
# One change after another from the defaults of exudyn but for the linear solver.
SEARCHED = [
    {},
    *({"relativeTolerance": r} for r in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)),
    *({"relativeTolerance": r, "absoluteTolerance": 1e-7} for r in (1e-4, 1e-3)),
    *({**FULL, "relativeTolerance": r} for r in (1e-6, 1e-4, 1e-3)),
    *({"absoluteTolerance": a} for a in (1e-4, 1e-2, 1.0)),
    *({**FULL, "absoluteTolerance": a} for a in (1e-6, 1e-4, 1e-2, 1.0)),
    {"modifiedNewtonJacUpdatePerStep": True, "absoluteTolerance": 1.0},
    *({**FULL, "absoluteTolerance": 1.0, "spectralRadius": r} for r in (0.5, 0.8, 1.0)),
    {**FULL, "absoluteTolerance": 1.0, "solverType": "EXUdense"},
    {**FULL, "absoluteTolerance": 1.0, "reuseAnalyzedPattern": False},
    *({**FULL, "absoluteTolerance": a, "element": "cable"} for a in (1e-3, 1.0)),
    *({**FULL, "absoluteTolerance": a, "step": 1e-2} for a in (1e-4, 1.0)),
    *({**FULL, "absoluteTolerance": a, "step": 2e-2} for a in (1e-4, 1.0)),
]
BEST = {**FULL, "absoluteTolerance": 1.0}


def peak(t, v):
    """Time and size of the largest deflection, by the parabola through three samples."""
    k = min(max(int(np.argmin(v)), 1), len(v) - 2)
    before, middle, after = v[k - 1 : k + 2]
    slope, bend = 0.5 * (after - before), after - 2.0 * middle + before
    part = -slope / bend
    return t[k] + part * (t[k + 1] - t[k]), middle + 0.5 * part * slope


def ours(coupling, elements, step):
    """A run with spim as a function: seconds, times and deflections."""
    beam = kane(elements=elements, coupling=coupling)
    z = beam.state()

    def run():
        begin = time.perf_counter()
        solution = spim.integrate(
            beam, z, (0.0, END), step, method="srk2", outputs=[3 * elements - 2]
        )
        return time.perf_counter() - begin, solution.t, solution.outputs[:, 0]

    return run


def apart(changes):
    """Seconds, time of the peak and peak of exudyn in a process of its own, or what went wrong."""
    command = [sys.executable, __file__, "--one", json.dumps(changes)]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=True)
    except subprocess.TimeoutExpired:
        return f"not done after {LIMIT:g} s"
    except subprocess.CalledProcessError as error:
        return f"failed: {error.stderr.splitlines()[-1]}"
    found = json.loads(found.stdout.splitlines()[-1])
    return "failed" if found is None else found


def one(changes):
    """Print a run of exudyn, the faster of two."""
    seconds, t, v = spin_up(**changes)
    if seconds is not None and seconds < 2.0:
        seconds = min(seconds, spin_up(**changes)[0])
    print(json.dumps(None if seconds is None else [seconds, *peak(t, v)]))


def words(changes):
    """Settings as text."""
    return ", ".join(f"{name}={value}" for name, value in changes.items()) or "defaults"


def search(markdown):
    """The best settings; prints all."""
    tight = apart(TIGHT)
    if isinstance(tight, str):
        sys.exit(f"exudyn, {words(TIGHT)}: {tight}")
    tight = tight[2]
    best, least, rows = BEST, np.inf, []
    for changes in SEARCHED:
        found = apart(changes)
        if isinstance(found, str):
            rows.append([words(changes), found, "-", "-"])
            continue
        seconds, when, most = found
        right = abs(most / tight - 1.0) <= 1e-3
        rows.append(
            [words(changes), f"{seconds:.3f}", f"{most:.5f} at {when:.4f} s", "" if right else "no"]
        )
        if right and seconds < least and changes.get("step", STEP) == STEP:
            best, least = changes, seconds
    print(f"exudyn, {ELEMENTS} elements, h = {STEP:g} s; solved tightly its peak is {tight:.5f}\n")
    show(["settings", "time, s", "peak, m", "peak right?"], rows, markdown, width=74)
    print()
    return best


def rows(best):
    """Cells of the table."""
    cases = [
        (f"spim {coupling}, n = {n}, h = {h:g}", ours(coupling, n, h))
        for n in (8, ELEMENTS)
        for coupling in ("foac", "third")
        for h in (STEP, 2.0 * STEP, 4.0 * STEP)
    ]
    if best is not None:
        peers = [("best", best), ("tight", TIGHT), ("tight, h = 0.01", {**TIGHT, "step": 1e-2})]
        cases += [
            (f"exudyn, n = {ELEMENTS}, {name}", lambda changes=changes: spin_up(**changes))
            for name, changes in peers
        ]
    measured = [[] for _ in cases]
    peaks = [peak(*run()[1:]) for _, run in cases]
    for _ in range(REPEATS):
        for (_, run), seconds in zip(cases, measured, strict=True):
            seconds.append(run()[0])
    medians = dict(zip((name for name, _ in cases), np.median(measured, axis=1), strict=True))
    references = [medians.get(f"exudyn, n = {ELEMENTS}, {name}") for name in ("best", "tight")]
    for (name, seconds), (when, most) in zip(medians.items(), peaks, strict=True):
        ratios = [f"{peer / seconds:.1f}x" if peer else "-" for peer in references]
        yield [name, f"{seconds * 1e3:.2f}", *ratios, f"{most:.5f}", f"{when:.4f}"]


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--one", type=json.loads, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one is not None:
        one(given.one)
        return
    best = None
    if importlib.util.find_spec("exudyn") is None:
        print("left out: pip install exudyn", file=sys.stderr)
    else:
        best = BEST if given.quick else search(given.markdown)
        print(f"exudyn's best: {words(SETTINGS | best)}\n")
    head = ["run", "median, ms", "exudyn's best/this", "exudyn's tight/this", "peak, m", "at, s"]
    show(head, rows(best), given.markdown, width=32)


if __name__ == "__main__":
    main()
