"""From a system and a grid to the arrays of a run."""

import numpy as np

from spim import _core
from spim._acting import Acting, ActingByInverse, ActingStepByStep, begins_below_doubles
from spim._arrays import finite
from spim._coordinates import Raw, coordinates_of
from spim._core import ModelError


def walk(system, z0, t0, t1, step, method, every, options, report=None, outputs=None):
    """Run the core; see `spim._core.integrate` for what comes back."""
    chosen = coordinates_of(system, method, options)
    acting = None
    if system.load is not None:
        h, steps, _ = _core.grid(t0, t1, step)
        if h != 0.0:
            kind = Acting
            if method == "modal" or begins_below_doubles(system._bound_load, t0, h):
                kind = ActingStepByStep
            elif options.get("forcing") == "inverse":
                kind = ActingByInverse
            acting = kind(chosen.A, chosen.input, system._bound_load, t0, h, steps)
    if not isinstance(chosen, Raw):
        z0 = chosen.into(finite("z0", z0))
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
    )
    if acting is not None and acting.failure is not None and run["error"] is not None:
        run["error"] = acting.failure
    run["last"] = chosen.back(run["last"])
    if outputs is None:
        run["z"] = chosen.back(run["z"])
        if run["error"] is None:
            # One state and many are mapped with other roundings.
            run["last"] = run["z"][-1].copy()
    if outputs is not None or not isinstance(chosen, Raw):
        _end_at_overflow(run)
    return run


def _end_at_overflow(run):
    """What a map of finite states has made of them may exceed doubles."""
    good = np.isfinite(run["z"]).all(axis=1)
    if good.all():
        return
    rows = int(np.argmin(good))
    message = f"the state or an output overflows: exceeds 1.8e308 at t = {run['t'][rows]:g}"
    run["z"], run["t"] = run["z"][:rows], run["t"][:rows]
    run["error"] = ModelError(message)
