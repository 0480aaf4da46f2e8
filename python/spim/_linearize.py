"""The matrix of a system at a state."""

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


def linearize(system, z, t=0.0):
    """The Jacobian of ``z'`` at a state.

    Parameters
    ----------
    system : System
        Any system; a load is left out.
    z : array_like (m,)
        The state.
    t : float
        The time.

    Returns
    -------
    ndarray (m, m)
        ``d z'_i / d z_j``; at an equilibrium its eigenvalues are rates of growth and frequencies,
        in rad per unit of time. In closed form where the system has it: linear systems, and those
        given with a Jacobian or Hessian. Else by central differences of order 8 with the best of
        ten steps for each column: some twelve digits of the largest entry of a column, for
        components that are of the size of 1, or as large as they are.

    Raises
    ------
    ValueError
        A state of another length, or not finite.
    ModelError
        The state is outside of what the model describes, or ``z'`` is not finite there.

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
    A = np.empty((m, m))
    for j in range(m):
        A[:, j] = _column(core, state, float(t), j)[:m]
    return A


def stepped(system):
    """Length of what is stepped: a state, and accounts along with it."""
    return getattr(system._core, "size", system.size)


def _column(core, state, t, j):
    """One column: of all steps the estimate that agrees best with that of lower order."""
    size = abs(state[j]) or 1.0
    found, errors = [], []
    for step in STEPS * size:
        moved = np.tile(state, (8, 1))
        moved[:4, j] += step * np.arange(1, 5)
        moved[4:, j] -= step * np.arange(1, 5)
        # As they are rounded.
        spans = 0.5 * (moved[:4, j] - moved[4:, j]) / np.arange(1, 5)
        rates = _core.rates(core, np.full(8, t), moved)
        slopes = (rates[:4] - rates[4:]) / spans[:, None]
        with np.errstate(invalid="ignore", over="ignore"):
            estimate, lower = WEIGHTS @ slopes, LOWER @ slopes
            error = np.abs(estimate - lower).max()
        if np.isfinite(error):
            found.append(estimate)
            errors.append(error + 1e-16 * np.abs(rates).max() / step)
    if not found:
        raise _core.ModelError(f"linearize: z' is not finite beside component {j} of the state")
    return found[int(np.argmin(errors))]
