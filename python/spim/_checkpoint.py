"""What a run can go on from."""

import functools
import zlib

import numpy as np

# Values of options that change nothing, of those that have one in all methods.
DEFAULTS = {
    "roundoff": "minimal",
    "approximation": "linear",
    "newton": "constant",
    "coordinates": "raw",
    "nodes": 8,
}


class Checkpoint:
    """Where a run has come to: all that ``integrate(..., resume=)`` needs to go on from there.

    ``solution.state`` is one; nobody makes them by hand. The resumed run is the uninterrupted one,
    to the last bit. A checkpoint can be pickled, as it does not hold the system: the same must be
    given to the run that goes on, and kind, size and numbers of it are compared, functions are not.
    Its size is that of the state and of what the method carries from step to step.

    Attributes
    ----------
    t : float
        Time.
    z : ndarray (m,)
        State.
    method : str
        Name of the method.
    step : float
        Signed, as it was taken.
    """

    def __init__(self, t, z, method, options, step, asked, system, core):
        self.t, self.z, self.method, self.step = t, z, method, step
        self._options, self._asked, self._of = options, asked, system
        # Start of the grid; state as stepped, what is carried, step, steps to take again, whether
        # outputs alone were stepped; the whole state as stepped.
        self._t0, self._core, self._whole = core

    @functools.cached_property
    def _system(self):
        """What tells the system from others."""
        return _print_of(self._of)

    def __getstate__(self):
        rest = {name: value for name, value in self.__dict__.items() if name != "_of"}
        return rest | {"_system": self._system}

    @property
    def _reached(self):
        """The number of the step."""
        return self._core[2] + self._core[3]

    def _agree(self, system, t, method, step, options):
        """Method, step and options of the run that goes on; ValueError if others were asked for."""
        for what, mine, other in zip(
            ("a system", "a size", "parameters"), self._system, _print_of(system), strict=True
        ):
            if mine != other:
                if what == "parameters":
                    raise ValueError("resume: the state is that of a system of other parameters")
                raise ValueError(f"resume: the state is that of {what} {mine}, not {other}")
        if method not in ("auto", self.method):
            raise ValueError(f"resume: the state is that of method '{self.method}', not '{method}'")
        if options and not _same(options, self._options):
            raise ValueError(
                f"resume: the state is that of a run with options {self._options}, not {options}"
            )
        if step is not None and self.step != 0.0 and step not in (self._asked, abs(self.step)):
            raise ValueError(
                f"resume: the state is that of a run with steps of {abs(self.step)}, not {step}"
            )
        if not abs(t - self.t) <= 1e-9 * abs(self.step) + 4.0 * np.spacing(abs(self.t)):
            raise ValueError(f"t_span: must begin where the state is, at {self.t}, not at {t}")
        step = self._asked if step is None else step
        return self.method, step, self._options

    def __repr__(self):
        size = len(self.z)
        return f"Checkpoint(t = {self.t:g}, {size} components, {self.method}, step {self.step:g})"


def _print_of(system):
    """Kind, size and, where they are numbers, parameters of a system."""
    numbers = (getattr(system, name, None) for name in ("A", "_parameters", "_linear_part"))
    numbers = next((given for given in numbers if given is not None), None)
    mark = None if numbers is None else zlib.crc32(np.ascontiguousarray(numbers).tobytes())
    return type(system).__name__, system.size, mark


def _is_default(name, value):
    default = DEFAULTS.get(name)
    return type(value) is type(default) and value == default


def _same(one, other):
    """Whether options are alike: those that are what they are by default are as good as none."""
    given = [
        {k: v for k, v in o.items() if v is not None and not _is_default(k, v)}
        for o in (one, other)
    ]
    return given[0].keys() == given[1].keys() and all(
        np.array_equal(value, given[1][name]) for name, value in given[0].items()
    )
