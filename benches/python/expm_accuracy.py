"""Accuracy of matrix exponentials: spim beside SciPy's real and complex path.

Prints a table per class of ``tests/data/expm.npz`` (references to about 32 digits). Two
paths of SciPy, because ``scipy.linalg.expm`` loses digits for real input alone.

error
    Largest error of an entry, divided by the largest entry of the exponential, evaluated as
    ``(X - hi) - lo``; the worst case and the geometric mean, where an error below 2^-60
    counts as 2^-60.
ulps
    Largest error of an entry in units in the last place of the largest entry.
to SciPy
    Error divided by that of the better SciPy path, or by 2^-53 if that is larger; the worst.
defect
    Largest entry of ``X^T J X - J``, evaluated exactly, Hamiltonian matrices only; the worst
    of it, and of it divided by the square of the largest entry of the exponential.
misrounded
    Entries that are not the double nearest to the exact one.
warned, failed
    Cases with a `spim.PrecisionWarning`, and with an exception or a result not finite.

Run ``python benches/python/expm_accuracy.py [--cases] [--markdown]``.
"""

import argparse
import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg

import spim

REFERENCE = Path(__file__).parents[2] / "tests" / "data" / "expm.npz"
UNIT_ROUNDOFF = 2.0**-53
SMALLEST_ERROR = 2.0**-60
ACCURATE_SIZE = 16  # up to here "exact" is to round every entry correctly
METHODS = {
    "exact": lambda A: spim.expm(A, method="exact"),
    "sid": lambda A: spim.expm(A, method="sid"),
    "spim": lambda A: spim.expm(A, method="spim"),
    "SciPy real": scipy.linalg.expm,
    "SciPy complex": lambda A: scipy.linalg.expm(A + 0j).real,
}


@dataclass
class Case:
    """A matrix, its exponential ``hi + lo``, and what is known of it."""

    name: str
    label: str
    hamiltonian: bool
    A: np.ndarray
    hi: np.ndarray
    lo: np.ndarray

    @property
    def size(self):
        return len(self.A)


@dataclass
class Score:
    """What one method made of one case; see the columns above."""

    error: float = math.nan
    ulps: float = math.nan
    defect: float = math.nan
    relative_defect: float = math.nan
    misrounded: int = 0
    warned: bool = False
    failure: str = ""


def load_cases():
    with np.load(REFERENCE) as data:
        keys = zip(*(data[key].tolist() for key in ("names", "labels", "hamiltonian")), strict=True)
        return [Case(name, *known, *data[name]) for name, *known in keys]


def exact_products(x, y):
    """Products of two arrays as sums ``high + low`` without error (Dekker 1971)."""

    def halves(x):
        shifted = (2.0**27 + 1.0) * x
        upper = shifted - (shifted - x)
        return upper, x - upper

    high = x * y
    (x1, x2), (y1, y2) = halves(x), halves(y)
    return high, ((x1 * y1 - high) + x1 * y2 + x2 * y1) + x2 * y2


def symplectic_defect(X):
    """Largest entry of ``X^T J X - J``, correctly rounded; the matrix is skew."""
    n = len(X) // 2
    rotated = np.vstack([X[n:], -X[:n]])  # J X
    worst = 0.0
    for i in range(2 * n):
        for j in range(i + 1, 2 * n):
            terms = np.concatenate(exact_products(X[:, i], rotated[:, j]))
            worst = max(worst, abs(math.fsum([*terms, -float(j == i + n)])))
    return worst


def score(case, exponential):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            X = exponential(case.A)
        except Exception as error:  # whatever a method raises belongs in the table
            return Score(failure=f"{type(error).__name__}: {error}", misrounded=case.hi.size)
    warned = any(issubclass(warning.category, spim.PrecisionWarning) for warning in caught)
    if not np.isfinite(X).all():
        return Score(failure="result not finite", misrounded=case.hi.size, warned=warned)
    largest = np.abs(case.hi).max()
    error = np.abs((X - case.hi) - case.lo).max()
    defect = symplectic_defect(X) if case.hamiltonian else math.nan
    return Score(
        error=error / largest,
        ulps=error / np.spacing(largest),
        defect=defect,
        relative_defect=defect / largest**2,
        misrounded=np.count_nonzero(X != case.hi),
        warned=warned,
    )


def worst(values):
    return max((value for value in values if not math.isnan(value)), default=math.nan)


def geometric_mean(values):
    logs = [math.log(max(value, SMALLEST_ERROR)) for value in values if not math.isnan(value)]
    return math.exp(sum(logs) / len(logs)) if logs else math.nan


def number(value):
    return "-" if math.isnan(value) else f"{value:.1e}"


def show(title, header, rows, markdown):
    """Print a table; the first column is left-aligned."""
    print(f"\n### {title}\n" if markdown else f"\n{title}")
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    edge, between = ("| ", " | ") if markdown else ("  ", "  ")
    for index, row in enumerate([header, *rows]):
        cells = [
            cell.rjust(width) if column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        print((edge + between.join(cells) + edge[::-1]).rstrip())
        if markdown and index == 0:
            rules = ["-" * (width - 1) + (":" if i else "-") for i, width in enumerate(widths)]
            print(edge + between.join(rules) + edge[::-1].rstrip())


def class_rows(cases, scores):
    """One row per method for the cases of a class."""
    scipy = [
        min(scores["SciPy real"][case.name].error, scores["SciPy complex"][case.name].error)
        for case in cases
    ]
    entries = sum(case.hi.size for case in cases)
    for method, results in scores.items():
        own = [results[case.name] for case in cases]
        to_scipy = worst(s.error / max(b, UNIT_ROUNDOFF) for s, b in zip(own, scipy, strict=True))
        yield [
            method,
            number(worst(s.error for s in own)),
            number(geometric_mean([s.error for s in own])),
            f"{worst(s.ulps for s in own):.3g}",
            f"{to_scipy:.2g}",
            number(worst(s.defect for s in own)),
            number(worst(s.relative_defect for s in own)),
            f"{sum(s.misrounded for s in own)}/{entries}",
            str(sum(s.warned for s in own)),
            str(sum(bool(s.failure) for s in own)),
        ]


def print_classes(cases, scores, markdown):
    header = (
        "method, worst error, geo-mean, ulps, to SciPy, defect, relative, misrounded, "
        "warned, failed"
    ).split(", ")
    for label in dict.fromkeys(case.label for case in cases):
        members = [case for case in cases if case.label == label]
        sizes = sorted({case.size for case in members})
        title = f"{label} ({len(members)} cases, m = {', '.join(map(str, sizes))})"
        show(title, header, list(class_rows(members, scores)), markdown)


def print_misrounded(cases, scores, markdown):
    """Entries of "exact" that are not correctly rounded, by class and size."""

    def share(members):
        wrong = sum(scores["exact"][case.name].misrounded for case in members)
        return f"{wrong}/{sum(case.hi.size for case in members)}" if members else "-"

    rows = []
    for label in [*dict.fromkeys(case.label for case in cases), "all"]:
        members = [case for case in cases if label in (case.label, "all")]
        small = [case for case in members if case.size <= ACCURATE_SIZE]
        large = [case for case in members if case.size > ACCURATE_SIZE]
        ulps = worst(scores["exact"][case.name].ulps for case in members)
        rows.append([label, share(small), share(large), f"{ulps:.3f}"])
    header = ["class", f"m <= {ACCURATE_SIZE}", f"m > {ACCURATE_SIZE}", "worst ulps"]
    show("exact: entries not correctly rounded", header, rows, markdown)


def print_paper_beam(cases, scores, markdown):
    """Geometric means where increments are worth most: the slow modes dominate.

    They do when bending out of plane (flap: ``tau w_low`` at most 1.9), and only in part
    in the paper's plane (chord: ``tau w_low`` up to 34).
    """

    def of_interest(case, label):
        elements, *_, tau_w = case.name.split(": ")[1].split()
        return case.label == label and int(elements) <= 4 and float(tau_w) >= 100

    beams = [case for case in cases if case.label.startswith("beam")]
    planes = {"flap": "beam flap normalised", "chord": "beam normalised"}
    chosen = [[c for c in beams if of_interest(c, label)] for label in planes.values()]
    rows = [
        [
            method,
            *(number(geometric_mean([results[c.name].error for c in group])) for group in chosen),
        ]
        for method, results in scores.items()
    ]
    title = "paper's beam, 1-4 elements, mass-normalised, tau w_max = 100, 1000, 1e4: geo-mean"
    show(title, ["method", *planes], rows, markdown)


def print_cases(cases, scores, markdown):
    header = ["case: error", "m", "norm1", *scores, "misrounded by exact"]
    rows = [
        [
            case.name,
            str(case.size),
            number(np.abs(case.A).sum(axis=0).max()),
            *(number(results[case.name].error) for results in scores.values()),
            str(scores["exact"][case.name].misrounded),
        ]
        for case in cases
    ]
    show("every case", header, rows, markdown)


def print_notes(scores):
    print()
    for method, results in scores.items():
        warned = [name for name, s in results.items() if s.warned]
        if warned:
            print(f"- {method}: PrecisionWarning at {'; '.join(warned)}")
        for name, s in results.items():
            if s.failure:
                print(f"- {method}: {name}: {s.failure}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", action="store_true", help="also every case")
    parser.add_argument("--markdown", action="store_true", help="markdown tables")
    options = parser.parse_args()

    if options.markdown:
        print("```")
    spim.show_versions()
    print(f"scipy {scipy.__version__}, numpy {np.__version__}")
    if options.markdown:
        print("```")
    cases = load_cases()
    scores = {
        method: {case.name: score(case, exponential) for case in cases}
        for method, exponential in METHODS.items()
    }
    print_classes(cases, scores, options.markdown)
    print_paper_beam(cases, scores, options.markdown)
    print_misrounded(cases, scores, options.markdown)
    if options.cases:
        print_cases(cases, scores, options.markdown)
    print_notes(scores)


if __name__ == "__main__":
    main()
