"""Many trajectories of one system in one call."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from spim import _core
from spim._arrays import finite
from spim._integrate import _number, _span, integrate
from spim._solution import Solution
from spim._systems import LinearSystem

# Options that a propagator has as well: such runs share one, as columns of its products.
SHARED = {"correction", "doublings", "every", "method", "order", "pade"}


def ensemble(system, z0, t_span, step, *, loads=None, threads=1, **options):
    """Integrate many initial states, or load cases, of one system.

    Parameters
    ----------
    system : LinearSystem
    z0 : array_like (b, m), or (m,) with `loads`
        Initial states, one a row.
    t_span, step
        As for `integrate`.
    loads : sequence of spim.loads.Load, optional
        A load a case, in place of the system's; as many as there are states, or one state for all.
    threads : int
        Trajectories are divided among so many threads.
    **options
        As for `integrate`, but for ``throw``: a case that fails says so in its ``error``.

    Returns
    -------
    list of Solution
        One a case, in order; ``error`` is None where all went well. On one thread, cases without a
        load share one exponential and go side by side as columns of its products.

    Raises
    ------
    ValueError, TypeError
        As `integrate`; numbers of states and loads that do not match.
    KeyboardInterrupt
        Within 0.1 s of Ctrl-C; cases that are done are lost.
    """
    if not isinstance(system, LinearSystem):
        raise TypeError(f"system: must be a linear spim system, got {type(system).__name__}")
    if "throw" in options:
        raise TypeError("throw: an ensemble returns all cases; look at the error of each")
    states, systems = _cases(system, finite("z0", z0), loads)
    threads = _threads(threads)
    if not states.size:
        return []
    found = None
    free = all(case is system for case in systems) and system.load is None
    if threads == 1 and free and options.keys() <= SHARED:
        found = _as_columns(system, states, t_span, step, options)
    if found is None:
        options = {**options, "throw": False}
        cases = [(case, start, t_span, step) for case, start in zip(systems, states, strict=True)]
        found = _one_by_one(cases, options) if threads == 1 else _at_once(cases, options, threads)
    return found


def _one_by_one(cases, options):
    found = []
    for case in cases:
        found.append(integrate(*case, **options))
        if isinstance(found[-1].error, KeyboardInterrupt):
            raise found[-1].error
    return found


def _at_once(cases, options, threads):
    """On threads, which look every 20 ms whether this one has been interrupted."""
    stopped = threading.Event()
    wanted = options.pop("progress", None)

    def look(fraction, t):
        if stopped.is_set():
            raise KeyboardInterrupt
        if callable(wanted):
            wanted(fraction, t)

    with ThreadPoolExecutor(threads) as pool:
        runs = [pool.submit(integrate, *case, progress=look, **options) for case in cases]
        try:
            return [run.result() for run in runs]
        except BaseException:
            stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _cases(system, z0, loads):
    if z0.ndim not in (1, 2) or z0.shape[-1] != system.size:
        raise ValueError(f"z0: must have shape (b, {system.size}), got {z0.shape}")
    if loads is None:
        states = np.atleast_2d(z0)
        return states, [system] * len(states)
    if not isinstance(loads, list | tuple):
        raise TypeError(f"loads: must be a list of loads, got {type(loads).__name__}")
    systems = [system.with_load(load) for load in loads]
    states = np.broadcast_to(z0, (len(systems), system.size)) if z0.ndim == 1 else z0
    if len(states) != len(systems):
        raise ValueError(f"loads: {len(systems)} for {len(states)} states")
    return states, systems


def _threads(given):
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < 1:
        raise ValueError(f"threads: must be a positive whole number, got {given!r}")
    return int(given)


def _as_columns(system, states, t_span, step, options):
    """All cases side by side, or None where that is not the same as one by one."""
    t0, t1 = _span(t_span)
    h, steps, uneven = _core.grid(t0, t1, _number("step", step))
    options = dict(options)
    every, name = options.pop("every", 1), options.get("method", "auto")
    counts = isinstance(every, int | np.integer) and not isinstance(every, bool) and every >= 1
    # What is wrong with `every` is said one by one.
    if name not in ("auto", "spim", "pim") or uneven or steps == 0 or not counts or steps % every:
        return None
    if name == "pim":
        options.setdefault("correction", "none")
    propagator = _core.Propagator(system, h, **options)
    try:
        z = propagator.trajectory(states, steps, every)
    except (_core.SpimError, OverflowError):
        # One by one, each as far as it comes.
        return None
    t = t0 + h * np.arange(0, steps + 1, every)
    t[-1] = t1
    choice = f"{propagator.correction} correction; one exponential for {len(states)} trajectories"
    run = {"method": name, "choice": choice, "t": t, "h": h, "error": None}
    run["work"] = {"steps": steps, "evaluations": 0, "products": 0}
    return [
        Solution(system, {**run, "z": rows, "last": rows[-1].copy()}, dict(options))
        for rows in np.moveaxis(z, 1, 0)
    ]
