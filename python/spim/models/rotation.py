"""Prescribed rotation of a hub: speed over time."""

import threading

import numpy as np

from spim._arrays import finite

__all__ = ["RotationTable", "SpinUp", "Trapezoid"]


class SpinUp:
    """From rest to a speed, without a jump of the acceleration.

    ``omega = speed/duration (t - duration/(2 pi) sin(2 pi t/duration))``, then constant: the
    spin-up of Kane, Ryan & Banerjee (1987).

    Parameters
    ----------
    speed : float
        rad/s, reached at `duration`.
    duration : float
        s, positive.
    """

    def __init__(self, speed, duration):
        self.speed = float(finite("speed", speed, ()))
        self.duration = float(finite("duration", duration, ()))
        if self.duration <= 0.0:
            raise ValueError(f"duration: must be positive, got {self.duration:g} s")

    def omega(self, t):
        """Speed, rad/s."""
        T, t = self.duration, np.clip(t, 0.0, self.duration)
        return self.speed / T * (t - T / (2.0 * np.pi) * np.sin(2.0 * np.pi * t / T))

    def angle(self, t):
        """Angle since t = 0, rad."""
        t = np.asarray(t, float)
        T, inside = self.duration, np.clip(t, 0.0, self.duration)
        wave = T / (2.0 * np.pi)
        turned = 0.5 * inside**2 + wave**2 * (np.cos(inside / wave) - 1.0)
        return self.speed / T * turned + self.speed * np.maximum(t - T, 0.0)

    def _native(self):
        return "spin-up", self.speed, self.duration

    def __repr__(self):
        return f"SpinUp(speed={self.speed:g}, duration={self.duration:g})"


class RotationTable:
    """Speeds at times, linear between them and constant outside.

    Parameters
    ----------
    t : array_like (k,)
        s, ascending.
    omega : array_like (k,)
        rad/s.
    """

    def __init__(self, t, omega):
        self.t, self._omega = finite("t", t), finite("omega", omega)
        if self.t.ndim != 1 or self.t.shape != self._omega.shape or not self.t.size:
            raise ValueError(
                f"t, omega: must have one shape (k,), got {self.t.shape} and {self._omega.shape}"
            )
        if not (np.diff(self.t) > 0.0).all():
            at = int(np.argmin(np.diff(self.t) > 0.0))
            raise ValueError(f"t: must ascend; entry {at + 1} does not exceed entry {at}")
        steps = 0.5 * np.diff(self.t) * (self._omega[1:] + self._omega[:-1])
        self._angles = np.concatenate([[0.0], np.cumsum(steps)])

    def omega(self, t):
        """Speed, rad/s."""
        return np.interp(t, self.t, self._omega)

    def angle(self, t):
        """Angle since the first time, rad."""
        t = np.asarray(t, float)
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)
        since = t - self.t[k]
        # Of a linear speed the mean is that in the middle.
        inside = np.clip(t, self.t[0], self.t[-1])
        mean = 0.5 * (self.omega(inside) + self._omega[k])
        beyond = t - inside
        return self._angles[k] + mean * (since - beyond) + self.omega(t) * beyond

    def _native(self):
        return "table", self.t, self._omega

    def __repr__(self):
        return f"RotationTable({len(self.t)} speeds, t = {self.t[0]:g} .. {self.t[-1]:g})"


class Trapezoid(RotationTable):
    """From rest to a speed at a constant rate, held, and back to rest.

    Parameters
    ----------
    speed : float
        rad/s.
    rise, hold, fall : float
        Durations, s; positive but for `hold`. ``fall=None`` keeps the speed for ever.
    start : float
        Time it begins, s.
    """

    def __init__(self, speed, rise, hold=0.0, fall=None, start=0.0):
        spans = {"rise": rise, "hold": hold} | ({} if fall is None else {"fall": fall})
        spans = {name: float(finite(name, value, ())) for name, value in spans.items()}
        for name, value in spans.items():
            if value < 0.0 or (value == 0.0 and name != "hold"):
                raise ValueError(f"{name}: must be positive, got {value:g} s")
        self.speed = float(finite("speed", speed, ()))
        self.rise, self.hold, self.fall = spans["rise"], spans["hold"], spans.get("fall")
        self.start = float(finite("start", start, ()))
        speeds = [0.0, speed] + ([speed] if hold > 0.0 else []) + ([] if fall is None else [0.0])
        if hold == 0.0:
            del spans["hold"]
        times = np.concatenate([[0.0], np.cumsum(list(spans.values()))]) + start
        super().__init__(times[: len(speeds)], speeds)


class Called:
    """A function omega(t), or an object with .omega(t) and .angle(t), as the core calls it."""

    # Step of the difference that gives the acceleration, and cells of the quadrature, s.
    APART = 1e-5
    CELL = 0.05
    DEEPEST = 24

    def __init__(self, given):
        self.given = given
        self.omega = given.omega if hasattr(given, "omega") else given
        self._angle = getattr(given, "angle", None)
        # Angles at the ends of cells, forward and backward from t = 0.
        self._sums = {1: [0.0], -1: [0.0]}
        self._rule = np.polynomial.legendre.leggauss(8)
        self._lock = threading.Lock()

    def angle(self, t):
        """Angle since t = 0, rad: by quadrature where there is no function."""
        if self._angle is not None:
            return self._angle(t)
        t = np.asarray(t, float)
        return np.array([self._integrated(float(x)) for x in t.ravel()]).reshape(t.shape)

    def _integrated(self, t):
        sign = 1 if t >= 0.0 else -1
        sums, cell = self._sums[sign], sign * self.CELL
        whole = int(abs(t) / self.CELL)
        # The same sums whoever asks first: results do not depend on the order of calls.
        with self._lock:
            while len(sums) <= whole:
                k = len(sums)
                sums.append(sums[k - 1] + self._area((k - 1) * cell, k * cell))
        return sums[whole] + self._area(whole * cell, t)

    def _area(self, begin, end):
        return self._halved(begin, end, self._gauss(begin, end), self.DEEPEST)

    def _halved(self, begin, end, whole, deep):
        """Halves taken until they agree with the whole: for ripples and jumps."""
        middle = 0.5 * (begin + end)
        left, right = self._gauss(begin, middle), self._gauss(middle, end)
        off = abs(left + right - whole)
        if deep == 0 or off <= 1e-13 * (1.0 + abs(left) + abs(right)):
            return left + right
        return self._halved(begin, middle, left, deep - 1) + self._halved(
            middle, end, right, deep - 1
        )

    def _gauss(self, begin, end):
        nodes, weights = self._rule
        points = begin + 0.5 * (end - begin) * (1.0 + nodes)
        values = [float(self.omega(float(x))) for x in points]
        return 0.5 * (end - begin) * float(np.dot(weights, values))

    def __call__(self, t):
        speed = float(self.omega(t))
        return float(self.angle(t)), speed, self._rate(t, speed)

    def _rate(self, t, speed):
        """By differences, to one side where the function does not reach to the other."""
        d, known = self.APART, {}
        for side in (1.0, -1.0):
            try:
                known[side] = float(self.omega(t + side * d))
            except Exception:
                continue
        if len(known) == 2:
            return (known[1.0] - known[-1.0]) / (2.0 * d)
        for side, value in known.items():
            return side * (value - speed) / d
        return 0.0


def native(rotation):
    """What the core takes."""
    if isinstance(rotation, type):
        raise TypeError(f"rotation: must be made first, as {rotation.__name__}(...)")
    if hasattr(rotation, "_native"):
        return rotation._native()
    if not (callable(rotation) or callable(getattr(rotation, "omega", None))):
        raise TypeError(
            "rotation: must be a function omega(t) or an object with .omega(t), such as "
            f"spim.models.SpinUp, got {type(rotation).__name__}"
        )
    return Called(rotation)
