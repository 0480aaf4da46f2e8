"""Events and callbacks: what looks on while a run goes."""

import math

import numpy as np


class Watch:
    """Sees each step: finds events in it, then calls back.

    An event is a change of sign of ``g(t, z)`` over a step. It is found by steps of the method
    itself, as long as it takes from the start of that step: nothing is interpolated.
    """

    def __init__(self, events, callback, resumed):
        self.events = [_Event(number, g) for number, g in enumerate(events)]
        if callback is not None and not callable(callback):
            raise TypeError(f"callback: must be a function f(t, z), got {type(callback).__name__}")
        self._callback, self._resumed = callback, resumed
        # Time and state, as stepped, at which a terminal event has ended the run.
        self.end = None
        self._t = None

    def bind(self, within, shown):
        """`within(t, z, time)`: what is stepped at `time`, from z at t; `shown(z)`: for users."""
        self._within, self._shown = within, shown

    def __call__(self, step, t, z):
        """None, or the sentence that ends the run."""
        # What users are given is theirs to change.
        kept, seen, reason = z.copy(), self._shown(z), None
        if self._t is None:
            for event in self.events:
                # Whoever goes on from an event has seen it.
                event.begin(event.value(t, seen), self._resumed)
        else:
            if self.events:
                reason = self._search(t, kept, seen)
            if reason is None and self._callback is not None:
                reason = self._call(t, seen)
        self._t, self._z = t, kept
        return reason

    def _call(self, t, seen):
        answer = self._callback(t, seen)
        if answer is False or (isinstance(answer, np.bool_) and not answer):
            return f"the callback stopped the run at t = {t:g}"
        return None

    def _search(self, t, z, seen):
        found = []
        for event in self.events:
            late = event.value(t, seen)
            if event.is_crossed(late):
                found.append((*self._crossing(event, t, z, late), event))
            event.begin(late, True)
        # In the order in which they come.
        found.sort(key=lambda one: abs(one[0] - self._t))
        for time, state, event in found:
            event.note(time, self._shown(state.copy()))
            if event.is_last():
                self.end = time, state
                return f"event {event.number} ended the run at t = {time:g}"
        return None

    def _crossing(self, event, t, z, late):
        """Time and state of the crossing in this step."""
        if event.last == 0.0:
            return self._t, self._z
        states = {t: z}

        def value(time):
            states[time] = self._within(self._t, self._z, time)
            return event.value(time, self._shown(states[time].copy()))

        time = root(value, self._t, t, event.last, late)
        return time, states[time]

    def times(self):
        """Times of the events found, an array for each function."""
        return [np.array(event.times) for event in self.events]

    def states(self, size):
        """States at these, (k, m) for each function."""
        return [np.array(event.states).reshape(-1, size) for event in self.events]


class _Event:
    """One function, and where it was last."""

    def __init__(self, number, g):
        name = f"events[{number}]"
        if not callable(g):
            raise TypeError(f"{name}: must be a function g(t, z), got {type(g).__name__}")
        self.number, self._name, self._g = number, name, g
        terminal, direction = getattr(g, "terminal", None), getattr(g, "direction", None)
        # True: the first ends the run; False: none does.
        count = False if terminal is None else terminal
        if isinstance(count, float) and count.is_integer():
            # As SciPy takes them.
            count = int(count)
        if not isinstance(count, bool | np.bool_ | int | np.integer) or count < 0:
            raise ValueError(f"{name}.terminal: must be True, False or a count, got {terminal!r}")
        try:
            self._direction = float(direction or 0.0)
        except (TypeError, ValueError):
            raise TypeError(f"{name}.direction: must be a number, got {direction!r}") from None
        self._left = int(count) or math.inf
        self.times, self.states = [], []

    def value(self, t, z):
        """g, which must be a number."""
        value = self._g(t, z)
        if not isinstance(value, float):
            given = np.asarray(value)
            if given.size != 1 or given.dtype.kind not in "biuf":
                raise TypeError(
                    f"{self._name}: must give a real number, gave {value!r} at t = {t:g}"
                )
            value = float(given.reshape(()))
        if math.isnan(value):
            raise ValueError(f"{self._name}: is nan at t = {t:g}")
        return value

    def begin(self, value, seen):
        """At the start of a step; `seen`: a zero there has been counted."""
        self.last, self._seen = value, seen

    def is_crossed(self, late):
        """Whether the step that ends with this value crosses zero in a wanted direction."""
        rising = self.last < 0.0 <= late
        falling = self.last > 0.0 >= late
        if self.last == 0.0 and not self._seen:
            rising, falling = late > 0.0, late < 0.0
        return (rising and self._direction >= 0.0) or (falling and self._direction <= 0.0)

    def note(self, t, z):
        """Keeps one that was found."""
        self.times.append(t)
        self.states.append(np.array(z))
        self._left -= 1

    def is_last(self):
        """Whether the run ends here."""
        return self._left == 0


def root(f, a, b, fa, fb):
    """Where f changes its sign between `a` and `b`, to the rounding of times.

    The point returned is a zero or lies on the side of `b`, and is `b` or one f was evaluated at.
    Inverse quadratic interpolation where that is safe, else bisection: Chandrupatla, Adv. Eng.
    Softw. 28 (1997).
    """
    if fb == 0.0:
        return b
    x1, x2, f1, f2 = b, a, fb, fa
    part = 0.5
    while True:
        width, least = abs(x2 - x1), 2.0 * math.ulp(max(abs(x1), abs(x2)))
        x = x1 + part * (x2 - x1)
        if width <= least or x in (x1, x2):
            return x1 if (f1 > 0.0) == (fb > 0.0) else x2
        fx = f(x)
        if fx == 0.0:
            return x
        if (fx > 0.0) == (f1 > 0.0):
            x3, f3 = x1, f1
        else:
            x3, f3, x2, f2 = x2, f2, x1, f1
        x1, f1 = x, fx
        xi, phi = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
        part = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = f1 / (f2 - f1) * f3 / (f2 - f3)
            part += (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        nearest = min(0.5, 0.5 * least / abs(x2 - x1))
        part = min(1.0 - nearest, max(nearest, part))
