"""From a system and a grid to the arrays of a run."""

from spim import _core
from spim._acting import Acting


def walk(system, z0, t0, t1, step, method, every, options, report=None):
    """Run the core; see `spim._core.integrate` for what comes back."""
    acting = None
    if system.load is not None:
        h, steps, _ = _core.grid(t0, t1, step)
        if h != 0.0:
            acting = Acting(system.A, system._input, system._bound_load, t0, h, steps)
    return _core.integrate(
        system._core,
        system._matrices(),
        acting,
        z0,
        t0,
        t1,
        step,
        method,
        every,
        options,
        report,
    )
