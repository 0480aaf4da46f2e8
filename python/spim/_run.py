"""One step at a time, for control and co-simulation."""

import operator

import numpy as np

from spim import _core
from spim._acting import Acting
from spim._arrays import finite
from spim._coordinates import coordinates_of
from spim._core import UnsupportedError
from spim._integrate import _number
from spim._systems import LinearSystem, System

# Steps for which the impulses of the system's own load are fetched at once.
AHEAD = 256


class Run:
    """A system that is stepped one call at a time.

    Parameters
    ----------
    system : System
        A linear one, with a load of its own or without, or any other.
    z0 : array_like (m,)
        State at `t0`.
    step : float
        Positive.
    t0 : float
        Time of `z0`.
    method : str, optional
        As for `integrate`. A linear system without one is stepped exactly, for a force that is held
        and for its own load as `integrate` takes it: such a run equals `integrate` but for
        rounding. With a method, and of other systems, whose default is "auto", a run is `integrate`
        to the last bit; it takes no force.
    **options
        Options of the method.

    Raises
    ------
    UnsupportedError
        A method for a linear system under a load; a method that cannot treat the system.

    Examples
    --------
    >>> import spim
    >>> cart = spim.StructuralSystem([[2.0]], [[0.0]])
    >>> run = spim.Run(cart, cart.state(q=[1.0]), step=0.01)
    >>> for _ in range(1000):
    ...     q, p = run.state
    ...     state = run.step(force=[-4.0 * q - 2.0 * p])
    """

    def __init__(self, system, z0, *, step, t0=0.0, method=None, **options):
        if not isinstance(system, System):
            raise TypeError(f"system: must be a spim system, got {type(system).__name__}")
        step, self._t0 = _number("step", step), _number("t0", t0)
        if not (0.0 < step < np.inf):
            raise ValueError(f"step: must be positive and finite, got {step}")
        if not np.isfinite(self._t0):
            raise ValueError(f"t0: must be finite, got {t0}")
        self.system, self._h, self._k = system, step, 0
        z0 = finite("z0", z0, (system.size,))
        self._acting, self._ahead, self._from, self._walker = None, None, 0, None
        self._method, self._options = method, options
        if method is not None or not isinstance(system, LinearSystem):
            self._bind(z0)
            return
        if options:
            raise TypeError(
                f"{next(iter(options))}: is an option of a method; give method= as well"
            )
        W, first = _core.phi(system.A, 1, tau=step)
        self._stepper = _core.Stepper(W, step * (first @ system._input), z0)
        self._advance = self._stepper.step
        if system.load is not None:
            load = system._bound_load
            self._acting = Acting(system.A, system._input, load, self._t0, step, 2**62)

    def _bind(self, z0):
        """Binds a method, which goes its own way."""
        system, method = self.system, self._method
        if method in (None, "auto"):
            choice = system._chosen(self._h)
            method = "auto" if choice is None else choice.method
        if system.load is not None:
            raise UnsupportedError(
                "method: a linear system under a load is stepped exactly; leave method out"
            )
        chosen = self._chosen = coordinates_of(system, method, self._options)
        z0 = chosen.into(z0)
        self._walker = _core.Walker(
            chosen.core, chosen.matrices, None, z0, self._t0, self._h, method, self._options
        )

    @property
    def t(self):
        """Time."""
        return self._t0 + self._k * self._h

    @property
    def state(self):
        """State z, (m,): a copy. Set it, or `restore` a checkpoint, to redo steps."""
        if self._walker is None:
            return self._stepper.state
        return self._shown(self._walker.state)

    def _shown(self, z):
        return self._chosen.back(z)[: self.system.size]

    @state.setter
    def state(self, z):
        if self._walker is None:
            self._stepper.state = z
        else:
            z = finite("state", z, (self.system.size,))
            self._walker.restart(self.t, self._chosen.into(z))

    def step(self, force=None):
        """One step.

        Parameters
        ----------
        force : array_like, optional
            Held over the step, in addition to the system's load: (n,) for a structure, (m,) for a
            `LinearSystem`; for these alone, and without a method.

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
        UnsupportedError
            A force on what takes none.

        Of a method: what `integrate` raises. The state is then as it was.
        """
        if self._walker is not None:
            return self._walk(force)
        if self._acting is None:
            state = self._advance(force, None)
        else:
            state = self._advance(force, self._impulse())
        self._k += 1
        return state

    def _walk(self, force):
        if force is not None:
            raise UnsupportedError(
                "force: acts on linear systems without a method alone; give the system a function"
            )
        state = self._shown(self._walker.step())
        self._k += 1
        return state

    def checkpoint(self):
        """What `restore` takes: time and state."""
        return self._k, self.state if self._walker is None else self._walker.checkpoint()

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
        if self._walker is None:
            self.state = state
        elif isinstance(state, tuple) and len(state) == 4:
            self._walker.restore(*state)
        else:
            raise TypeError("checkpoint: is that of a run without a method")
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
        given = self.system, self.state, self._h, self._t0, self._method, self._options
        return _resumed, (*given, self.checkpoint())

    def __repr__(self):
        return f"Run({self.system!r}, t = {self.t:g}, step {self._h:g})"


def _resumed(system, state, step, t0, method, options, checkpoint):
    run = Run(system, state, step=step, t0=t0, method=method, **options)
    run.restore(checkpoint)
    return run
