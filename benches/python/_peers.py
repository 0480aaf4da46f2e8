"""Peers of the benches of nonlinear models: their right sides and runs.

Each maker returns a function that runs and returns the last state, and the seconds to compile.
Peers are imported where they are used; `missing` says which are not there.
"""

import importlib.util
import time

import numpy as np

HOW = {
    "diffrax": "pip install diffrax",
    "heyoka": "pip install heyoka",
    "numba": "pip install numba",
}


def missing(name):
    """What to say of a peer that is not installed, or None."""
    if importlib.util.find_spec(name) is not None:
        return None
    return f"{name} is left out: {HOW.get(name, f'pip install {name}')}"


def forget_compiled():
    """Makes heyoka compile anew, whatever it has kept of former runs."""
    import heyoka

    for name, arguments in (("set_diskcache_enabled", (False,)), ("clear_memcache", ())):
        if hasattr(heyoka.llvm_state, name):
            getattr(heyoka.llvm_state, name)(*arguments)


def longest():
    """The longest floats heyoka has here."""
    import heyoka

    more = "taylor_adaptive_ldbl" in dir(heyoka) and np.finfo(np.longdouble).eps < 2e-16
    return np.longdouble if more else float


def heyoka_run(system, start, span, tolerance, back=None, real=float, **options):
    """A run of heyoka's Taylor integrator.

    Parameters
    ----------
    system : list
        For `heyoka.taylor_adaptive`.
    start : array_like
        In the variables of the system.
    span : float
        From 0.
    tolerance : float
    back : callable, optional
        From its state to ours, within the time that is measured.
    real : type
        Of its floats.
    """
    import heyoka

    first = np.asarray(start, real)
    begin = time.perf_counter()
    machine = heyoka.taylor_adaptive(system, first, tol=real(tolerance), fp_type=real, **options)
    compiling = time.perf_counter() - begin

    def run():
        machine.time = real(0.0)
        machine.state[:] = first
        outcome = machine.propagate_until(real(span))
        assert outcome[0] == heyoka.taylor_outcome.time_limit, outcome
        return machine.state.copy() if back is None else back(machine.state)

    return run, compiling


def medians(runs, repeats, at_most=8.0):
    """Median seconds of runs, interleaved.

    Parameters
    ----------
    runs : list of callable
        Called once before, to warm up.
    repeats : int
    at_most : float
        Seconds that the repeats of one may take; fewer are taken of slow ones, one at least.
    """
    times = []
    for run in runs:
        begin = time.perf_counter()
        run()
        times.append([time.perf_counter() - begin])
    for repeat in range(repeats):
        for run, found in zip(runs, times, strict=True):
            if repeat * found[0] > at_most:
                continue
            begin = time.perf_counter()
            run()
            found.append(time.perf_counter() - begin)
    return [float(np.median(found[1:])) for found in times]


def unbeaten(points):
    """Numbers of the points (error, seconds) that none of the others beats in both."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    kept, least = [], np.inf
    for i in order:
        if points[i][1] < least:
            kept.append(i)
            least = points[i][1]
    return kept
