"""Time of the paper's pendulum over 0-10 s with right sides of one's own.

The pendulum of `spim.models.CompoundPendulum` given as a function, in three ways: numba cfuncs, of
one state or of one and of eight at once ("both"), beside heyoka's Taylor integrator, which compiles
its equations too (compile times told apart, at an error of 2e-12); a Python function of floats,
that returns numbers or writes them, beside SciPy's DOP853 with the same body; one of arrays that
takes many states a call, beside DOP853 with the same body and with floats (at 1e-9). Whole calls
through Python, the state at the end alone; steps and tolerances are scanned for all. Errors are the
largest of the four components, in SI units. Medians over interleaved repeats. A minute or two; it
needs ``pip install heyoka numba scipy``::

    python benches/python/callback_speed.py [--markdown] [--quick]
"""

import argparse
import inspect
import itertools
import math
import time

import numpy as np
from _peers import forget_compiled, medians, missing
from _pendulum import SPAN, START, constants, linear, ours, reference, taylor
from _table import show

import spim

COMPILED, CALLED = 2e-12, 1e-9
INERTIA, M, REST, K, G, ARM = (float(value) for value in constants())
A = linear()
SPIN, WEIGHT = A[1, 3], -A[3, 1]
# Steps in the span.
STEPS = {
    "gauss8": (300, 400, 600, 800),
    "gauss12": (120, 150, 180, 220, 260, 300, 350, 400),
    "gauss16": (80, 90, 100, 110, 120, 130, 140, 150, 160, 170, 180, 200),
    "gauss24": (40, 45, 50, 55, 60, 65, 70, 80),
    "gauss32": (28, 32, 36, 40, 45, 50, 55, 60),
}
DOP853 = (3e-9, 1e-9, 3e-10, 1e-10, 3e-11, 1e-11, 3e-12, 1e-12)


def gradient(t, z):
    """dH/dz, of floats."""
    x, theta, px, ptheta = z.tolist()
    sin, cos = math.sin(theta), math.cos(theta)
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    return (
        K * x + M * G * (1.0 - cos) - moment * rate * rate,
        (ARM + moment) * G * sin,
        px / M,
        rate,
    )


def right_side(t, z):
    """Rates, of floats."""
    x, theta, px, ptheta = z.tolist()
    sin, cos = math.sin(theta), math.cos(theta)
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    return (
        px / M,
        rate,
        moment * rate * rate - K * x - M * G * (1.0 - cos),
        -(ARM + moment) * G * sin,
    )


def remainder(t, z):
    """What the linear part leaves of rates, of floats."""
    x, theta, _, ptheta = z.tolist()
    sin, cos = math.sin(theta), math.cos(theta)
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    return (
        0.0,
        rate - SPIN * ptheta,
        moment * rate * rate - M * G * (1.0 - cos),
        WEIGHT * theta - (ARM + moment) * G * sin,
    )


def remainder_written(t, z, out):
    """The same, written in place."""
    x, theta, _, ptheta = z.tolist()
    sin, cos = math.sin(theta), math.cos(theta)
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    out[0] = 0.0
    out[1] = rate - SPIN * ptheta
    out[2] = moment * rate * rate - M * G * (1.0 - cos)
    out[3] = WEIGHT * theta - (ARM + moment) * G * sin


def right_sides(t, z):
    """Rates of states (4,) or (4, k), of arrays."""
    x, theta, px, ptheta = z
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    out = np.empty_like(z)
    out[0] = px / M
    out[1] = rate
    out[2] = moment * rate * rate - K * x - M * G * (1.0 - np.cos(theta))
    out[3] = -(ARM + moment) * G * np.sin(theta)
    return out


def remainders(t, z):
    """What the linear part leaves of rates of states (4,) or (4, k), of arrays."""
    x, theta, _, ptheta = z
    moment = M * (REST + x)
    rate = ptheta / (INERTIA + moment * moment / M)
    out = np.empty_like(z)
    out[0] = 0.0
    out[1] = rate - SPIN * ptheta
    out[2] = moment * rate * rate - M * G * (1.0 - np.cos(theta))
    out[3] = WEIGHT * theta - (ARM + moment) * G * np.sin(theta)
    return out


def compiled():
    """Cfuncs of numba: gradient, remainder, remainder of eight states; the seconds to compile."""
    import numba

    def slopes(t, z, out):
        x, theta, px, ptheta = z[0], z[1], z[2], z[3]
        sin, cos = math.sin(theta), math.cos(theta)
        moment = M * (REST + x)
        rate = ptheta / (INERTIA + moment * moment / M)
        out[0] = K * x + M * G * (1.0 - cos) - moment * rate * rate
        out[1] = (ARM + moment) * G * sin
        out[2] = px / M
        out[3] = rate

    def rest(t, z, out):
        x, theta, ptheta = z[0], z[1], z[3]
        sin, cos = math.sin(theta), math.cos(theta)
        moment = M * (REST + x)
        rate = ptheta / (INERTIA + moment * moment / M)
        out[0] = 0.0
        out[1] = rate - SPIN * ptheta
        out[2] = moment * rate * rate - M * G * (1.0 - cos)
        out[3] = WEIGHT * theta - (ARM + moment) * G * sin

    def rests(t, z, out):
        for lane in range(8):
            x, theta, ptheta = z[lane], z[8 + lane], z[24 + lane]
            sin, cos = math.sin(theta), math.cos(theta)
            moment = M * (REST + x)
            rate = ptheta / (INERTIA + moment * moment / M)
            out[lane] = 0.0
            out[8 + lane] = rate - SPIN * ptheta
            out[16 + lane] = moment * rate * rate - M * G * (1.0 - cos)
            out[24 + lane] = WEIGHT * theta - (ARM + moment) * G * sin

    one, eight = spim.cfunc_signature(), spim.cfunc_signature(batch=True)
    begin = time.perf_counter()
    # Divisions by zero give infinities, not exceptions.
    made = [
        numba.cfunc(signature, error_model="numpy")(function)
        for signature, function in ((one, slopes), (one, rest), (eight, rests))
    ]
    return *made, time.perf_counter() - begin


def runs_of(system):
    """(method, setting, run) of a system, of every method that is there."""
    for record in spim.methods():
        name = record.name
        exponential = name.startswith("lawson_")
        if name.removeprefix("lawson_") not in STEPS:
            continue
        if exponential and not isinstance(system, spim.SemilinearSystem):
            continue
        endings = ("minimal", "tolerance") if "roundoff" in record.options else (None,)
        for ending, steps in itertools.product(endings, STEPS[name.removeprefix("lawson_")]):
            options = {} if ending is None else {"roundoff": ending}
            label = name if ending is None else f"{name}, {ending}"
            yield label, f"{steps} steps", ours(name, steps, system, **options)


def scipy_runs(function):
    """The same of SciPy's DOP853."""
    from scipy.integrate import solve_ivp

    for tolerance in DOP853:

        def run(tolerance=tolerance):
            found = solve_ivp(
                function,
                (0.0, SPAN),
                START,
                method="DOP853",
                t_eval=[SPAN],
                rtol=tolerance,
                atol=tolerance,
            )
            return found.y[:, -1]

        yield "DOP853", f"tol {tolerance:.0e}", run


def table(groups, bound, right, repeats, markdown):
    """Best of each group at an error.

    Parameters
    ----------
    groups : list of (name, compile seconds or None, iterable of (method, setting, run))
        Peers first; ratios are to each of them.
    """
    kept = []
    for name, compiling, cases in groups:
        for method, setting, run in cases:
            try:
                error = float(np.abs(run() - right).max())
            except spim.SpimError:
                continue
            if error <= bound:
                kept.append((name, compiling, method, setting, error, run))
    seconds = medians([case[-1] for case in kept], repeats)
    peers = [name for name, *_ in groups if not name.startswith("spim")]
    best = {}
    for (name, compiling, method, setting, error, _), taken in zip(kept, seconds, strict=True):
        if name not in best or taken < best[name][0]:
            best[name] = taken, method, setting, error, compiling
    rows = []
    for name, *_ in groups:
        if name not in best:
            rows.append([name, "-", "-", "not reached", "-", "-", *("-" for _ in peers)])
            continue
        taken, method, setting, error, compiling = best[name]
        ratios = (
            f"{best[peer][0] / taken:.2f}" if peer in best and name not in peers else "-"
            for peer in peers
        )
        rows.append(
            [
                name,
                method,
                setting,
                f"{error:.1e}",
                f"{taken * 1e3:.3f}",
                "-" if compiling is None else f"{compiling:.2f}",
                *ratios,
            ]
        )
    head = [f"error at most {bound:.0e}", "method", "setting", "error", "time, ms", "compiling, s"]
    show([*head, *(f"{peer} / spim" for peer in peers)], rows, markdown, width=26)
    print()


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    given = parser.parse_args()
    absent = [peer for peer in ("heyoka", "numba", "scipy") if missing(peer)]
    for peer in absent:
        print(f"{missing(peer)}\n")
    right, how = reference()
    print(f"0..{SPAN:g} s; reference: {how}\n")

    groups = []
    if "heyoka" not in absent:
        forget_compiled()
        for compact in (False, True):
            made = [
                (f"tol {tol:.0e}", taylor("canonical", tol, compact_mode=compact))
                for tol in (1e-10, 3e-11, 1e-11, 3e-12, 1e-12)
            ]
            name = "heyoka, compact" if compact else "heyoka"
            compiling = max(seconds for _, (_, seconds) in made)
            cases = [("Taylor", setting, run) for setting, (run, _) in made]
            groups.append((name, compiling, cases))
    if "numba" not in absent and hasattr(spim, "cfunc_signature"):
        slopes, rest, rests, compiling = compiled()
        groups += [
            ("spim, cfunc, Hamiltonian", compiling, runs_of(spim.HamiltonianSystem(2, slopes))),
            ("spim, cfunc, semilinear", compiling, runs_of(spim.SemilinearSystem(A, rest))),
            ("spim, both", compiling, runs_of(spim.SemilinearSystem(A, (rest, rests)))),
        ]
        table(groups, COMPILED, right, 15 if given.quick else 101, given.markdown)

    groups = []
    if "scipy" not in absent:
        groups += [
            ("SciPy, floats", None, scipy_runs(right_side)),
            ("SciPy, arrays", None, scipy_runs(right_sides)),
        ]
    groups += [
        ("spim, floats, Hamiltonian", None, runs_of(spim.HamiltonianSystem(2, gradient))),
        ("spim, floats, semilinear", None, runs_of(spim.SemilinearSystem(A, remainder))),
        ("spim, floats, written", None, runs_of(spim.SemilinearSystem(A, remainder_written))),
    ]
    if "vectorized" in inspect.signature(spim.SemilinearSystem).parameters:
        many = spim.SemilinearSystem(A, remainders, vectorized=True)
        groups.append(("spim, arrays, vectorized", None, runs_of(many)))
    table(groups, CALLED, right, 3 if given.quick else 9, given.markdown)


if __name__ == "__main__":
    main()
