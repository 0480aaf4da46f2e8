"""From a system and a grid to the arrays of a run."""

import numpy as np

from spim import _core
from spim._acting import Acting, ActingByInverse, ActingStepByStep, begins_below_doubles
from spim._arrays import finite
from spim._checkpoint import Checkpoint
from spim._coordinates import Raw, coordinates_of
from spim._core import ModelError


def walk(
    system,
    z0,
    t0,
    t1,
    step,
    method,
    every,
    options,
    report=None,
    outputs=None,
    resume=None,
    watch=None,
):
    """Run the core; see `spim._core.integrate` for what comes back.

    `resume`: a `Checkpoint`; `z0` is of no matter then. `watch`: a `Watch` that looks on.
    """
    chosen = coordinates_of(system, method, options)
    asked, given, from_step = step, None, 0
    if resume is not None:
        t0, z0 = resume.t, resume._whole
        if resume._reached > 0:
            t0, step, given, from_step = resume._t0, resume.step, resume._core, resume._reached
    elif not isinstance(chosen, Raw):
        z0 = chosen.into(finite("z0", z0))
    acting = acting_on(system, chosen, method, options, t0, t1, step, from_step)
    if watch is not None:
        watch.bind(
            lambda t, z, time: state_within(system, chosen, z, t, time, method, options),
            (lambda z: z) if isinstance(chosen, Raw) else chosen.shown,
        )
    run = _core.integrate(
        chosen.core,
        chosen.matrices,
        acting,
        z0,
        t0,
        t1,
        step,
        method,
        every,
        None if outputs is None else chosen.outputs(outputs),
        options,
        report,
        given,
        watch,
    )
    if acting is not None and acting.failure is not None and run["error"] is not None:
        run["error"] = acting.failure
    stepped = run["last"]
    t = t1 if run["error"] is None and run["stopped"] is None else t0 + run["steps"] * run["h"]
    state, begin = run["state"], t0
    run["taken"] = run["steps"] - from_step
    run["last"] = chosen.back(stepped)
    if watch is not None and watch.end is not None:
        t, stepped = watch.end
        if t != t0 + run["steps"] * run["h"]:
            # Between the points of the grid: whoever goes on begins anew there.
            state, begin = (stepped, np.zeros_like(state[1]), 0, 0, False), t
        _end_at_event(run, chosen, outputs, *watch.end)
    elif outputs is None:
        run["z"] = chosen.back(run["z"])
        if run["error"] is None:
            # One state and many are mapped with other roundings.
            run["last"] = run["z"][-1].copy()
    if outputs is not None or not isinstance(chosen, Raw):
        _end_at_overflow(run)
    shown = run["last"][: system.size].copy()
    asked = resume._asked if resume is not None and from_step > 0 else asked
    kept = begin, state, stepped
    run["state"] = Checkpoint(t, shown, run["method"], options, run["h"], asked, system, kept)
    return run


def acting_on(system, chosen, method, options, t0, t1, step, from_step=0):
    """The system's load at work on a run, or None."""
    if system.load is None:
        return None
    h, steps, _ = _core.grid(t0, t1, step, from_step or None)
    if h == 0.0:
        return None
    kind = Acting
    if method == "modal" or begins_below_doubles(system._bound_load, t0, h):
        kind = ActingStepByStep
    elif options.get("forcing") == "inverse":
        kind = ActingByInverse
    return kind(chosen.A, chosen.input, system._bound_load, t0, h, steps)


def state_within(system, chosen, z, t, time, method, options):
    """What is stepped, at `time`, by one step of the method from `z` at `t`."""
    if time == t:
        return z
    h = abs(time - t)
    acting = acting_on(system, chosen, method, options, t, time, h)
    run = _core.integrate(
        chosen.core, chosen.matrices, acting, z, t, time, h, method, 1, None, options, None
    )
    if run["error"] is not None:
        raise run["error"] if acting is None or acting.failure is None else acting.failure
    return run["z"][-1]


def _end_at_event(run, chosen, outputs, t, z):
    """The last row is that of the event in its step."""
    run["last"] = chosen.back(z)
    rows = run["z"] if outputs is not None else chosen.back(run["z"])
    if len(run["t"]) > 1 and run["t"][-2] == t:
        run["t"], run["z"] = run["t"][:-1], rows[:-1]
        return
    run["t"][-1] = t
    rows[-1] = run["last"] if outputs is None else chosen.outputs(outputs) @ z
    run["z"] = rows


def _end_at_overflow(run):
    """What a map of finite states has made of them may exceed doubles."""
    good = np.isfinite(run["z"]).all(axis=1)
    if good.all():
        return
    rows = int(np.argmin(good))
    message = f"the state or an output overflows: exceeds 1.8e308 at t = {run['t'][rows]:g}"
    run["z"], run["t"] = run["z"][:rows], run["t"][:rows]
    run["error"] = ModelError(message)
