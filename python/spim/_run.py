"""One step at a time, for control and co-simulation."""

import operator

import numpy as np

from spim import _core
from spim._acting import Acting
from spim._arrays import finite
from spim._integrate import _number
from spim._systems import LinearSystem

# Steps for which the impulses of the system's own load are fetched at once.
AHEAD = 256


class Run:
    """A linear system that is stepped one call at a time.

    Parameters
    ----------
    system : LinearSystem
        With a load of its own or without.
    z0 : array_like (m,)
        State at `t0`.
    step : float
        Positive.
    t0 : float
        Time of `z0`.

    Each step is exact for its force held, and for the system's own load as `integrate` takes it. A
    run equals `integrate` but for rounding.

    Examples
    --------
    >>> import spim
    >>> cart = spim.StructuralSystem([[2.0]], [[0.0]])
    >>> run = spim.Run(cart, cart.state(q=[1.0]), step=0.01)
    >>> for _ in range(1000):
    ...     q, p = run.state
    ...     state = run.step(force=[-4.0 * q - 2.0 * p])
    """

    def __init__(self, system, z0, *, step, t0=0.0):
        if not isinstance(system, LinearSystem):
            raise TypeError(f"system: must be a linear spim system, got {type(system).__name__}")
        step, self._t0 = _number("step", step), _number("t0", t0)
        if not (0.0 < step < np.inf):
            raise ValueError(f"step: must be positive and finite, got {step}")
        if not np.isfinite(self._t0):
            raise ValueError(f"t0: must be finite, got {t0}")
        self.system, self._h, self._k = system, step, 0
        z0 = finite("z0", z0, (system.size,))
        W, first = _core.phi(system.A, 1, tau=step)
        self._stepper = _core.Stepper(W, step * (first @ system._input), z0)
        self._advance = self._stepper.step
        self._acting, self._ahead, self._from = None, None, 0
        if system.load is not None:
            load = system._bound_load
            self._acting = Acting(system.A, system._input, load, self._t0, step, 2**62)

    @property
    def t(self):
        """Time."""
        return self._t0 + self._k * self._h

    @property
    def state(self):
        """State z, (m,): a copy. Set it, or `restore` a checkpoint, to redo steps."""
        return self._stepper.state

    @state.setter
    def state(self, z):
        self._stepper.state = z

    def step(self, force=None):
        """One step.

        Parameters
        ----------
        force : array_like, optional
            Held over the step, in addition to the system's load: (n,) for a structure, (m,) for a
            `LinearSystem`.

        Returns
        -------
        ndarray (m,)
            The new state.

        Raises
        ------
        ValueError
            A force of the wrong length, or not finite: the state is then as it was.
        OverflowError
            The state would exceed 1.8e308.
        """
        if self._acting is None:
            state = self._advance(force, None)
        else:
            state = self._advance(force, self._impulse())
        self._k += 1
        return state

    def checkpoint(self):
        """What `restore` takes: time and state."""
        return self._k, self.state

    def restore(self, checkpoint):
        """Goes back to where `checkpoint` was called."""
        try:
            k, state = checkpoint
            k = operator.index(k)
            if not 0 <= k < 2**62:
                raise ValueError
        except (TypeError, ValueError):
            raise TypeError(
                f"checkpoint: must be what checkpoint() gave, got {checkpoint!r}"
            ) from None
        self.state = state
        self._k = k

    def _impulse(self):
        at = self._k - self._from
        if self._ahead is None or not 0 <= at < len(self._ahead):
            self._from, at = self._k, 0
            # A function may know of what has happened by now alone.
            count = 1 if self._acting.sampled else AHEAD
            with np.errstate(over="ignore", invalid="ignore"):
                self._ahead = self._acting.all_impulses(self._k, count)
        return self._ahead[at]

    def __reduce__(self):
        return _resumed, (self.system, self.state, self._h, self._t0, self._k)

    def __repr__(self):
        return f"Run({self.system!r}, t = {self.t:g}, step {self._h:g})"


def _resumed(system, state, step, t0, k):
    run = Run(system, state, step=step, t0=t0)
    run._k = k
    return run
