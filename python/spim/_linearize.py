"""The matrix of a system at a state."""

import contextlib
import warnings

import numpy as np

from spim import _core
from spim._arrays import finite
from spim._systems import System

# Central differences of order 8: weights of f(+k d) - f(-k d), times d.
WEIGHTS = np.array([4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0])
# Of order 6, to judge them.
LOWER = np.array([3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0, 0.0])
# Steps that are tried, in parts of a component's size.
STEPS = 0.1 * 0.25 ** np.arange(10)
# Finer ones, at which they must hold.
FINER = 0.1 * 0.25 ** np.arange(10, 25)
# Parts of the rates: what rounding may leave of the finest differences, and of any.
NOISE, FLOOR = 1e-4, 1e-10


def linearize(system, z, t=0.0, *, scale=None):
    """The Jacobian of ``z'`` at a state.

    Parameters
    ----------
    system : System
        Any system; a load is left out.
    z : array_like (m,)
        The state.
    t : float
        The time.
    scale : array_like (m,) or float, optional
        For differences: changes of the components over which rates change their course, such as 1
        for an angle in rad. By default they are as large as components are, 1 where they are 0.

    Returns
    -------
    ndarray (m, m)
        ``d z'_i / d z_j``; at an equilibrium its eigenvalues are rates of growth and frequencies,
        in rad per unit of time. In closed form where the system has it: linear systems, and those
        given with a Jacobian or Hessian. Else by central differences of order 8 with the best of
        ten steps for each column, from a tenth of its scale to 4e-7 of it, or of finer ones where
        differences down to 4e-16 do not agree with those: some twelve digits of the largest entry
        of a column.

    Raises
    ------
    ValueError
        A state of another length, or not finite.
        A scale that is not positive.
    ModelError
        The state is outside of what the model describes, or ``z'`` is not finite there.

    Warns
    -----
    UserWarning
        Differences do not agree: rates that vary on a scale far below the given one, or with fewer
        digits than differences need. In SI units molecules have lengths of 1e-10 m and momenta of
        1e-23 kg m/s: give these, or take units in which they are near 1.

    Examples
    --------
    >>> import numpy as np
    >>> import spim
    >>> A = spim.linearize(spim.models.DoublePendulum(), np.zeros(4))
    >>> np.sort(np.linalg.eigvals(A).imag).round(4)[2:]  # rad/s
    array([2.3968, 5.7864])
    """
    if not isinstance(system, System):
        raise TypeError(f"system: must be a spim system, got {type(system).__name__}")
    z = finite("z", z, (system.size,))
    core = system._core
    m, whole = len(z), stepped(system)
    # What is stepped along with the state changes nothing in it.
    state = np.concatenate([z, np.zeros(whole - m)])
    known = _core.jacobian(core, np.array([float(t)]), state[None])
    if known is not None:
        return known.reshape(whole, whole)[:m, :m]
    here = _core.rates(core, np.array([float(t)]), state[None])
    if not np.isfinite(here).all():
        raise _core.ModelError(f"linearize: z' is not finite at t = {t:g}")
    sizes = np.where(z == 0.0, 1.0, np.abs(z)) if scale is None else _scales(scale, m)
    A = np.empty((m, m))
    for j in range(m):
        A[:, j] = _column(core, state, float(t), j, sizes[j])[:m]
    return A


def _scales(given, m):
    scales = finite("scale", given)
    if scales.shape not in ((), (m,)) or not (scales > 0.0).all():
        raise ValueError(f"scale: must be a positive number or {m} of them, got {given!r}")
    return np.broadcast_to(scales, m)


def stepped(system):
    """Length of what is stepped: a state, and accounts along with it."""
    return getattr(system._core, "size", system.size)


def _column(core, state, t, j, size):
    """One column: of all steps the estimate that agrees best with that of lower order.

    Differences at finer steps, two rates each, must agree with it: rates that vary on scales below
    the steps would pass for others else.
    """
    probes = _probes(core, state, t, j, size * FINER)
    tried = [_Estimate(core, state, t, j, step) for step in size * STEPS]
    found = _trusted(tried[:], probes, 1)
    if found is not None:
        return found.slopes
    tried += [_Estimate(core, state, t, j, probe.step) for probe in probes]
    found = _trusted(tried, probes, len(tried))
    if found is not None:
        return found.slopes
    finite = [estimate for estimate in tried if np.isfinite(estimate.error)]
    if not finite:
        raise _core.ModelError(f"linearize: z' is not finite beside component {j} of the state")
    best = min(finite, key=lambda estimate: estimate.error)
    warnings.warn(
        f"linearize: differences by component {j} of the state do not agree, at steps from "
        f"{best.step:.1e} down: z' varies on scales below them, or has lost its digits; give "
        "scale=, or a Jacobian",
        stacklevel=3,
    )
    return best.slopes


def _rates(core, t, states):
    """Rates, nan where they are no numbers: a step may lead anywhere."""
    with np.errstate(all="ignore"):
        try:
            return _core.rates(core, np.full(len(states), t), states)
        except _core.ModelError:
            rates = np.full(states.shape, np.nan)
        for rate, state in zip(rates, states, strict=True):
            with contextlib.suppress(_core.ModelError):
                rate[:] = _core.rates(core, np.array([t]), state[None])[0]
        return rates


def _trusted(tried, probes, count):
    """The best one, of the `count` best, that finer differences agree with."""
    tried = [estimate for estimate in tried if np.isfinite(estimate.error)]
    tried.sort(key=lambda estimate: estimate.error)
    return next((best for best in tried[:count] if best.agrees(probes)), None)


class _Probe:
    """A difference of rates over twice a step."""

    def __init__(self, step, span, change):
        self.step, self.span, self.change = step, span, change


def _probes(core, state, t, j, steps):
    """Differences at steps that the state can tell from none."""
    steps = steps[steps > 64.0 * np.spacing(abs(state[j]))]
    moved = np.tile(state, (2 * len(steps), 1))
    moved[: len(steps), j] += steps
    moved[len(steps) :, j] -= steps
    rates = _rates(core, t, moved)
    spans = moved[: len(steps), j] - moved[len(steps) :, j]
    with np.errstate(invalid="ignore", over="ignore"):
        changes = rates[: len(steps)] - rates[len(steps) :]
    good = np.isfinite(changes).all(axis=1)
    return [_Probe(*all_of) for all_of in zip(steps[good], spans[good], changes[good], strict=True)]


class _Estimate:
    """A column by differences at one step, and by how much it may be wrong."""

    def __init__(self, core, state, t, j, step):
        moved = np.tile(state, (8, 1))
        moved[:4, j] += step * np.arange(1, 5)
        moved[4:, j] -= step * np.arange(1, 5)
        # As they are rounded.
        spans = 0.5 * (moved[:4, j] - moved[4:, j]) / np.arange(1, 5)
        rates = _rates(core, t, moved)
        with np.errstate(invalid="ignore", over="ignore"):
            slopes = (rates[:4] - rates[4:]) / spans[:, None]
            self.slopes, lower = WEIGHTS @ slopes, LOWER @ slopes
            self.sizes = np.abs(rates).max(axis=0)
            self.error = np.abs(self.slopes - lower).max() + 1e-16 * self.sizes.max() / step
        self.step = step

    def agrees(self, probes):
        """Whether differences at finer steps are its own, but for what rates have of rounding."""
        finer = [probe for probe in probes if probe.step < self.step]
        misses = [np.abs(probe.change - probe.span * self.slopes) for probe in finer]
        # At the finest steps there is hardly more than that.
        noise = np.max(misses[-3:], axis=0, initial=0.0)
        if len(finer) < 4 or (noise > NOISE * self.sizes).any():
            return False
        for probe, miss in zip(finer, misses, strict=True):
            neglected = (probe.step / self.step) ** 3 + FLOOR
            allowed = 10.0 * (noise + probe.span * self.error + neglected * self.sizes)
            if (miss > allowed).any():
                return False
        return True
