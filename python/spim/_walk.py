"""From a system and a grid to the arrays of a run."""

from spim import _core
from spim._acting import Acting, ActingByInverse, ActingStepByStep
from spim._arrays import finite
from spim._coordinates import Raw, coordinates_of


def walk(system, z0, t0, t1, step, method, every, options, report=None, outputs=None):
    """Run the core; see `spim._core.integrate` for what comes back."""
    chosen = coordinates_of(system, method, options)
    acting = None
    if system.load is not None:
        h, steps, _ = _core.grid(t0, t1, step)
        if h != 0.0:
            kind = Acting
            if method == "modal":
                kind = ActingStepByStep
            elif options.get("forcing") == "inverse":
                kind = ActingByInverse
            acting = kind(chosen.A, chosen.input, system._bound_load, t0, h, steps)
    if not isinstance(chosen, Raw):
        z0 = chosen.into(finite("z0", z0, (system.size,)))
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
    run["last"] = chosen.back(run["last"])
    if outputs is None:
        run["z"] = chosen.back(run["z"])
        if run["error"] is None:
            # One state and many are mapped with other roundings.
            run["last"] = run["z"][-1].copy()
    return run
