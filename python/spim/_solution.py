"""What a run gives back."""

import functools

import numpy as np

from spim._arrays import finite
from spim._balance import dissipated_and_work
from spim._core import UnsupportedError
from spim._save import save
from spim._tangent import tangent
from spim._walk import walk


class Solution:
    """States of a run, and how it came about.

    Attributes
    ----------
    system : System
        What was integrated.
    t : ndarray (k,)
        Times of the stored states.
    outputs : ndarray (k, r)
        What was asked for with ``outputs=``.
    last : ndarray (m,)
        The state the run has reached, whatever `t_eval` asked for.
    step : float
        The step taken, signed: that asked for, or the next smaller one that divides the span.
    method : str
        The method, and the reason of what was chosen for it.
    stats : dict
        Work: "steps", "evaluations" of the right side, "products" of a matrix and a block of
        states.
    success : bool
    status : int
        0: the end was reached; 1: an event or the callback ended the run; -1: it failed, or was
        interrupted.
    message : str
        The reason, as a sentence.
    error : Exception or None
        What ended a run that failed.
    t_events : list of ndarray (k,), or None
        Times of the events found, an array for each function; None where none were given.
    y_events : list of ndarray (k, m), or None
        States at these times.
    """

    t_events = y_events = None

    def __init__(self, system, run, options, shown=False):
        self.system = system
        self._options = options
        self._name = run["method"]
        self.t, self.last = run["t"], self._shown(run["last"])
        if shown:
            self.outputs = run["z"]
        else:
            self._rows = run["z"]
            if len(self.t):
                self._start = float(self.t[0]), self._rows[0].copy()
        self._every_step = len(self.t) == run.get("taken", run["work"]["steps"]) + 1
        self._checkpoint = run.get("state")
        self.step = run["h"]
        self.method = f"{run['method']} ({run['choice']})" if run["choice"] else run["method"]
        self.stats = dict(run["work"])
        self.error = error = run["error"]
        self.success = error is None
        stopped = run.get("stopped")
        self.status = -1 if error is not None else 0 if stopped is None else 1
        self.message = stopped or "the end of the span was reached"
        if error is not None:
            self.message = _sentence(error)

    def __getattr__(self, name):
        # Asked for only where the attribute is not there.
        # A property that needs states ends here as well.
        if "outputs" in self.__dict__ and (name in ("z", "_rows") or hasattr(type(self), name)):
            raise AttributeError(_only_outputs("z" if name == "_rows" else name))
        if name == "outputs":
            raise AttributeError("outputs: none were asked for; integrate(..., outputs=...) does")
        raise AttributeError(f"a Solution has no attribute '{name}'")

    @property
    def state(self):
        """The `Checkpoint` the run has come to, whatever ended it, for ``integrate(..., resume=)``.

        After a terminal event it lies at the event, where whoever goes on begins a grid of their
        own; anywhere else the grid goes on, and the run is the uninterrupted one to the last bit.
        """
        if self._checkpoint is None:
            raise UnsupportedError(
                "state: trajectories that go side by side, as those of an ensemble, have none"
            )
        return self._checkpoint

    def jacobian(self, t=None):
        """The tangent map of the run, d z(t) / d z(start): the monodromy matrix, over a period.

        Parameters
        ----------
        t : float, optional
            Within the run; its end by default.

        Returns
        -------
        ndarray (m, m)
            Of linear systems: their own steps from unit states, without the load, as exact as the
            method. Of others: the product of the tangent maps of single steps, each by central
            differences of order 8 of the step from a fresh start, which leave 1e-14 to 1e-13 of
            the largest entry a step; 8 m steps a step, or more where the distance of differences
            must shrink.

        Raises
        ------
        ValueError
            `t` outside the run.
        UnsupportedError
            A method whose steps go on from several states, as those with an ``approximation`` other
            than "linear" do.
        ModelError, ConvergenceError
            A step beside the run fails.
        """
        self._demand_states("jacobian")
        start, end = self._start[0], self.t[-1] if self._checkpoint is None else self._checkpoint.t
        t = end if t is None else float(finite("t", t, ()))
        if not min(start, end) <= t <= max(start, end):
            raise ValueError(f"t: {t} is outside the run, from {start} to {end}")
        return tangent(self, t)

    def _show(self, matrix):
        """Keeps outputs in place of states."""
        self.outputs = self.z @ matrix.T
        del self._rows

    @property
    def z(self):
        """States, time first, (k, m)."""
        return self._shown(self._rows)

    def _shown(self, rows):
        """States of what is stepped, (..., m): the same, but for systems that step more."""
        return rows

    @property
    def y(self):
        """States as SciPy lays them out, (m, k); a view of `z`."""
        return self.z.T

    @property
    def q(self):
        """Coordinates, (k, m/2); a view of `z`."""
        return self.z[:, : self._half()]

    @property
    def p(self):
        """Momenta, (k, m/2); a view of `z`."""
        return self.z[:, self._half() :]

    @property
    def v(self):
        """Velocities q', (k, n), of a structure."""
        return self._structure("velocities").velocity(self.z)

    @property
    def a(self):
        """Accelerations q'', (k, n), of a structure under its load."""
        return self._structure("accelerations").acceleration(self.z, self.t)

    @functools.cached_property
    def _flows(self):
        self._structure("energy flows")
        return dissipated_and_work(self)

    @property
    def dissipated(self):
        """Energy a structure has dissipated since the start, (k,): its own exact integral.

        Where not every step is stored, those between are taken again.
        """
        return self._flows[0]

    @property
    def work(self):
        """Work the load of a structure has done since the start, (k,); as `dissipated`."""
        return self._flows[1]

    @property
    def balance_error(self):
        """Change of energy + dissipated - work, (k,): 0 but for rounding if all is well.

        Rounding leaves 1e-12 of the energy on chains; on damped beams, where ``C M^-1`` is rounded,
        1e-11 at tau w = 10 and 1e-9 at 1e4.
        """
        gone = self.dissipated - self.work
        if not len(self.t):
            return gone
        return self.energy - self.system.energy(self._start[1]) + gone

    def _structure(self, what):
        if not hasattr(self.system, "velocity"):
            raise UnsupportedError(f"{type(self.system).__name__} has no {what}; structures have")
        return self.system

    @property
    def nfev(self):
        """Evaluations of the right side."""
        return self.stats["evaluations"]

    @property
    def energy(self):
        """Energies of the stored states at their times, (k,).

        Raises
        ------
        UnsupportedError
            The system has none.
        """
        return self.system._energy_at(self.z, self.t)

    def save(self, path):
        """Write what is stored to a file, by its suffix.

        Parameters
        ----------
        path : str or Path
            ``.npz``: t, z (or outputs), of a rotating beam every array there is, and
            ``spim_version``, ``method``, ``step`` and ``model``: TOML text, empty where the model
            cannot be expressed so; `numpy.load` reads it. ``.csv``: a line a time, below a line of
            names, with units where they are known; 17 digits. A file that is there is overwritten.

        Raises
        ------
        ValueError
            Another suffix.
        OSError
            The file cannot be written.
        ModelError
            A beam's state without an energy, where a run has left what its coupling describes.
        """
        save(self, path)

    def _saved_arrays(self):
        """Arrays by name, time first."""
        name = "outputs" if self._only_outputs else "z"
        return {"t": self.t, name: getattr(self, name)}

    def _saved_columns(self):
        """Columns (k,) by their headings; the units of a state are its system's."""
        name, rows = ("output", self.outputs) if self._only_outputs else ("z", self.z)
        return {"t": self.t} | {f"{name}{i}": x for i, x in enumerate(rows.T, 1)}

    def _model_text(self):
        """The system as TOML, or nothing."""
        return ""

    def _demand_states(self, what):
        if self._only_outputs:
            raise AttributeError(_only_outputs(what))

    @property
    def _only_outputs(self):
        return "outputs" in self.__dict__

    def __call__(self, t):
        """State at any time of the run.

        A step of the method from the stored state before `t`, or several where the next stored
        state is further than a step away: exact for linear systems by their exponential.

        Parameters
        ----------
        t : float or array_like (j,)
            Within the run.

        Returns
        -------
        ndarray (m,) or (m, j)
            As SciPy's dense output.

        Raises
        ------
        ValueError
            `t` outside the run, or not finite.
        """
        self._demand_states("states at any time")
        times = finite("t", t)
        if times.ndim > 1:
            raise ValueError(f"t: must be a number or have shape (j,), got {times.shape}")
        backward = self.step < 0
        first, last = (self.t[-1], self.t[0]) if backward else (self.t[0], self.t[-1])
        flat = times.reshape(-1)
        outside = ~((flat >= first) & (flat <= last))
        if outside.any():
            at = flat[int(np.argmax(outside))]
            raise ValueError(f"t: {at} is outside the run, from {first} to {last}")
        states = self._shown(self._states(flat)).T
        return states[:, 0] if times.ndim == 0 else states

    def _states(self, flat):
        """What is stepped, at times within the run: (j, m)."""
        backward = self.step < 0
        states = np.empty((flat.size, self._rows.shape[1]))
        ascending = -self.t if backward else self.t
        # Within rounding of a stored time it is that time.
        slack = 4.0 * np.spacing(np.abs(flat))
        rows = np.searchsorted(ascending, (-flat if backward else flat) + slack, side="right") - 1
        for at, (row, time) in enumerate(zip(rows, flat, strict=True)):
            states[at] = self._state(row, float(time))
        return states

    def _state(self, row, t):
        if abs(t - self.t[row]) <= 4.0 * np.spacing(abs(t)):
            return self._rows[row]
        run = walk(
            self.system,
            self._rows[row],
            float(self.t[row]),
            t,
            # One step of its own where it is shorter than those of the run.
            min(abs(self.step), abs(t - float(self.t[row]))),
            self._name,
            1,
            self._options,
        )
        if run["error"] is not None:
            raise run["error"]
        return run["z"][-1]

    def _restrict(self, times):
        """Keeps the states at some times alone, as far as the run has come."""
        reached = times[(times <= self.t[-1]) if self.step >= 0.0 else (times >= self.t[-1])]
        self._rows = self._states(reached)
        self.t, self._every_step = reached, False

    def _half(self):
        half, odd = divmod(self.z.shape[1], 2)
        if odd:
            raise ValueError(f"a state of odd size, {self.z.shape[1]}, has no halves q and p")
        return half

    def __repr__(self):
        # None at all where a run has failed before the first time of t_eval.
        span = f"t = {self.t[0]:g} .. {self.t[-1]:g}, " if len(self.t) else ""
        if "outputs" in self.__dict__:
            kind = f"rows of {self.outputs.shape[1]} outputs"
        else:
            kind = f"states of {self.z.shape[1]} components"
        return (
            f"Solution({len(self.t)} {kind}, "
            f"{span}step {self.step:g}, {self.method}: "
            f"{self.message})"
        )


def _only_outputs(name):
    return f"{name}: only outputs were stored, as outputs= asked; the last state is .last"


def _sentence(error):
    text = str(error)
    return text if text else f"stopped by {type(error).__name__}"
