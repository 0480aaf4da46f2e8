"""Loads: what acts on a system from outside, as a function of time.

A load is an object. Polynomials, harmonics, exponentials, their sums and products are known in
closed form and integrated without error; records and functions are integrated exactly as the
piecewise polynomials they are taken for. Loads add with ``+`` and multiply with numbers; a load in
closed form multiplies with another of one component, any load with a function of time.
"""

import functools
import math
import operator
import warnings

import numpy as np

from spim._arrays import finite

__all__ = [
    "Exponential",
    "Function",
    "Gravity",
    "GroundMotion",
    "Harmonic",
    "Load",
    "Polynomial",
    "Sampled",
    "Unbalance",
]


# Breakpoints this near a time, in parts of an interval, are at that time.
NEAR = 1e-9


class Load:
    """Base of all loads, and what sums and products of them are.

    Call a load with a time or an array of times: its values are an array of shape ``t.shape +
    (n,)``. Loads that need the masses of a structure (`GroundMotion`, `Gravity`) can be evaluated
    only within one.
    """

    def __init__(self, terms=(), parts=()):
        # Closed form: exponents to coefficients, f(t) = Re sum of C[j] t^j exp(exponent t).
        self._terms = dict(terms)
        # Everything else: (part, factor).
        self._parts = tuple(parts)

    @property
    def size(self):
        """Number of components; None where the system decides."""
        sizes = [c.shape[1] for c in self._terms.values()] + [p.size for p, _ in self._parts]
        return max((size for size in sizes if size is not None), default=None)

    def __call__(self, t):
        """Values at times `t`."""
        t = np.asarray(t, float)
        if not self._terms and len(self._parts) == 1 and self._parts[0][1] == 1.0:
            return self._parts[0][0].values(t)
        total = np.zeros(t.shape + (self.size or 1,))
        for exponent, coefficients in self._terms.items():
            powers = t[..., None] ** np.arange(len(coefficients))
            total = total + ((powers * np.exp(exponent * t)[..., None]) @ coefficients).real
        for part, factor in self._parts:
            total = total + factor * part.values(t)
        return total

    def __add__(self, other):
        if not isinstance(other, Load):
            return NotImplemented
        sizes = {self.size, other.size} - {None}
        if len(sizes) > 1:
            raise ValueError(f"loads of {self.size} and of {other.size} components do not add")
        terms = dict(self._terms)
        for exponent, coefficients in other._terms.items():
            terms[exponent] = _added(terms.get(exponent), coefficients)
        return Load(terms, self._parts + other._parts)

    def __radd__(self, other):
        # Where sum() starts.
        return self if isinstance(other, int | float) and other == 0 else NotImplemented

    def __truediv__(self, other):
        return self * (1.0 / _finite("divisor", other, 0))

    def __neg__(self):
        return -1.0 * self

    def __sub__(self, other):
        return self + -other if isinstance(other, Load) else NotImplemented

    # NumPy's arrays leave products to the load.
    __array_ufunc__ = None

    def __mul__(self, other):
        if isinstance(other, int | float | np.integer | np.floating):
            factor = _finite("factor", other, 0)
            terms = {exponent: factor * c for exponent, c in self._terms.items()}
            return Load(terms, [(part, factor * f) for part, f in self._parts])
        if isinstance(other, Load) and not (self._parts or other._parts):
            if 1 not in (self.size, other.size):
                raise ValueError("loads multiply where one of them has a single component")
            return Load(_product(self._terms, other._terms))
        if callable(other):
            records = [*self.spans(), *(other.spans() if isinstance(other, Load) else ())]
            if records:
                warnings.warn(
                    "a record times a function of time is taken as a polynomial over each step, "
                    "across its samples: multiply the samples instead, or take steps no longer "
                    "than theirs",
                    stacklevel=2,
                )
            for part in self._unbound() + (other._unbound() if isinstance(other, Load) else []):
                raise ValueError(
                    f"{part} times a load or a function: multiply the record or the function "
                    "within it instead"
                )
            degrees = [self._degree(), other._degree() if isinstance(other, Load) else 0]
            return Function(_Times(self, other), max(degrees) or 3)
        return NotImplemented

    def _unbound(self):
        """Names of what has values only within a structure."""
        return [part.name for part, _ in self._parts if hasattr(part, "name")]

    def _degree(self):
        """Of functions in the load; 0 where there are none."""
        return max((part.degree for part, _ in self._parts if hasattr(part, "degree")), default=0)

    __rmul__ = __mul__

    def __repr__(self):
        return f"{type(self).__name__}({self.size or '?'} components)"

    def spans(self):
        """Begin and end of each record in the load."""
        return [span for part, _ in self._parts for span in part.spans()]

    def _bound(self, size, mass):
        """The load of `size` components it is on a system with these masses, or None."""
        if self.size not in (None, size):
            raise ValueError(f"load: has {self.size} components, the system {size}")
        parts = []
        total = Load(self._terms)
        for part, factor in self._parts:
            bound = part.bound(size, mass)
            if isinstance(bound, Load):
                total = total + factor * bound
            else:
                parts.append((bound, factor))
        return total + Load((), parts)


class _Times:
    """A product, as a function that can be pickled."""

    def __init__(self, load, function):
        self._load, self._function = load, function

    def __call__(self, t):
        return self._load(t) * np.asarray(self._function(t), float)


class Polynomial(Load):
    """``f(t) = sum over k of coefficients[k] t^k``.

    Parameters
    ----------
    coefficients : array_like (d + 1, n)
        One row a power; (d + 1,) for a single component.
    """

    def __init__(self, coefficients):
        coefficients = _finite("coefficients", coefficients, (1, 2))
        if not coefficients.size:
            raise ValueError("coefficients: must not be empty")
        super().__init__({0j: coefficients.reshape(len(coefficients), -1).astype(complex)})


class Harmonic(Load):
    """``f(t) = amplitude cos(frequency t + phase)``.

    Parameters
    ----------
    amplitude : array_like (n,)
    frequency : float
        rad/s.
    phase : float
        rad.
    """

    def __init__(self, amplitude, frequency, phase=0.0):
        amplitude = np.atleast_1d(_finite("amplitude", amplitude, (0, 1)))
        frequency, phase = _finite("frequency", frequency, 0), _finite("phase", phase, 0)
        coefficient = amplitude * complex(math.cos(phase), math.sin(phase))
        super().__init__({complex(0.0, frequency): coefficient[None, :]})


class Exponential(Load):
    """``f(t) = amplitude exp(rate t)``.

    Parameters
    ----------
    amplitude : array_like (n,)
    rate : float
        1/s; negative for decay.
    """

    def __init__(self, amplitude, rate):
        amplitude = np.atleast_1d(_finite("amplitude", amplitude, (0, 1)))
        rate = complex(_finite("rate", rate, 0))
        super().__init__({rate: amplitude[None, :].astype(complex)})


class Sampled(Load):
    """A record: constant or linear between samples, zero before it begins and after it ends.

    Parameters
    ----------
    values : array_like (k, n) or (k,)
        Two samples or more.
    step : float, optional
        Interval between samples, s.
    hold : {"first", "zero"}
        "first": linear from sample to sample, zero after the last. "zero": each sample is held
        until the next, the last as long as the one before it.
    start : float, optional
        Time of the first sample, s; 0 by default.
    times : array_like (k,), optional
        Times of the samples, ascending, instead of `step` and `start`.

    The record's step need not be that of the integration: where it changes within a step, the
    step is integrated exactly piece by piece.
    """

    def __init__(self, values, step=None, hold="first", start=None, *, times=None):
        values = _finite("values", values, (1, 2))
        if len(values) < 2:
            raise ValueError(f"values: two samples or more are needed, got {len(values)}")
        values = values.reshape(len(values), -1)
        if (step is None) == (times is None):
            raise TypeError("a record needs either step= or times=")
        if times is not None and start is not None:
            raise TypeError("start: is the first of times=; leave it out")
        if times is None:
            step, start = _finite("step", step, 0), _finite("start", start or 0.0, 0)
            if step <= 0.0:
                raise ValueError(f"step: must be positive, got {step}")
            times = start + step * np.arange(len(values))
            if not (np.diff(times) > 0.0).all():
                raise ValueError(f"step: {step:g} is lost in the rounding of times near {start:g}")
        else:
            times = _finite("times", times, 1)
            if len(times) != len(values):
                raise ValueError(f"times: {len(times)} times for {len(values)} samples")
            if not (np.diff(times) > 0.0).all():
                at = int(np.argmin(np.diff(times) > 0.0))
                raise ValueError(f"times: must ascend; entry {at + 1} does not exceed entry {at}")
        if isinstance(hold, str) and hold == "first":
            left, right = values[:-1], values[1:]
        elif isinstance(hold, str) and hold == "zero":
            times = np.append(times, 2.0 * times[-1] - times[-2])
            left = right = values
        else:
            raise ValueError(f'hold: must be "first" or "zero", got {hold!r}')
        super().__init__((), [(_Pieces(times, left, right, values, hold == "zero"), 1.0)])


class Function(Load):
    """Any function of time, taken in each step for a polynomial through Gauss points.

    Parameters
    ----------
    f : callable
        ``f(t) -> (n,)`` for a time t.
    degree : int
        Of the polynomial, 0 to 7; the error of a step is of order ``step^(2 degree + 3)`` for the
        slow modes of a smooth f.
    """

    def __init__(self, f, degree=3):
        if not callable(f):
            raise TypeError(f"f: must be callable, got {type(f).__name__}")
        if not isinstance(degree, int | np.integer) or not 0 <= degree <= 7:
            raise ValueError(f"degree: must be an integer from 0 to 7, got {degree!r}")
        super().__init__((), [(_Interpolated(f, int(degree)), 1.0)])


class GroundMotion(Load):
    """The ground's acceleration under a structure, ``f = -M r a(t)``; q is then relative to it.

    Parameters
    ----------
    record : Load
        The acceleration a(t), one component, m/s^2: often a `Sampled`.
    direction : array_like (n,)
        r: how each degree of freedom moves with the ground; ones for a shear building.
    """

    def __init__(self, record, direction):
        if not isinstance(record, Load):
            raise TypeError(
                "record: must be a load such as spim.loads.Sampled(values, step), got "
                f"{type(record).__name__}"
            )
        for part in record._unbound():
            raise TypeError(f"record: must be an acceleration, not {part}")
        if record.size not in (None, 1):
            raise ValueError(f"record: must have one component, has {record.size}")
        super().__init__((), [(_Inertial(record, direction, -1.0), 1.0)])


class Gravity(Load):
    """Weight, ``f = M r g``.

    Parameters
    ----------
    direction : array_like (n,)
        r: the part of each degree of freedom along gravity.
    acceleration : float
        g, m/s^2.
    """

    def __init__(self, direction, acceleration=9.80665):
        weight = Polynomial([_finite("acceleration", acceleration, 0)])
        super().__init__((), [(_Inertial(weight, direction, 1.0), 1.0)])


class Unbalance(Load):
    """A mass off the axis of a rotor at constant speed.

    ``f = moment speed^2 (cos(speed t + phase), sin(speed t + phase))`` on two degrees of freedom.

    Parameters
    ----------
    moment : float
        Mass times distance from the axis, kg m.
    speed : float
        rad/s.
    dofs : (int, int)
        The displacements across the axis it acts on.
    phase : float
        rad.
    """

    def __init__(self, moment, speed, dofs, phase=0.0):
        try:
            x, y = (operator.index(dof) for dof in dofs)
        except (TypeError, ValueError):
            raise TypeError(f"dofs: must be two whole numbers, got {dofs!r}") from None
        if x < 0 or y < 0 or x == y:
            raise ValueError(f"dofs: must be two different indices, got {dofs}")
        speed, phase = _finite("speed", speed, 0), _finite("phase", phase, 0)
        force = _finite("moment", moment, 0) * speed * speed
        if not math.isfinite(force):
            raise OverflowError("speed: the force moment speed^2 exceeds 1.8e308")
        super().__init__((), [(_Rotating(force, speed, (x, y), phase), 1.0)])


# Parts: what is not in closed form, or not before a system is known


class _Pieces:
    """Linear pieces between edges: `left` and `right` values of each, zero outside.

    `samples` are what they were made of, `held` until the next or joined.
    """

    def __init__(self, edges, left, right, samples, held, direction=None):
        self.edges, self.left, self.right, self.direction = edges, left, right, direction
        self.samples, self.held = samples, held

    @property
    def size(self):
        return self.left.shape[1] if self.direction is None else len(self.direction)

    def bound(self, size, mass):
        return self

    def along(self, direction):
        """The same on every degree of freedom in a direction; has one component itself."""
        return _Pieces(self.edges, self.left, self.right, self.samples, self.held, direction)

    @functools.cached_property
    def _lengths(self):
        return np.diff(self.edges)

    @functools.cached_property
    def _begins(self):
        """Where pieces begin, for times within rounding of it, and what that rounding is."""
        shorter = np.minimum(np.append(self._lengths, np.inf), np.insert(self._lengths, 0, np.inf))
        slack = np.maximum(NEAR * shorter, 4.0 * np.spacing(np.abs(self.edges)))
        # Of edges closer than that each keeps its own side.
        slack = np.minimum(slack, 0.25 * shorter)
        return self.edges - slack, slack

    def values(self, t):
        # Times within rounding of an edge lie on it; there the piece that begins counts, and the
        # last one at the end.
        begins, slack = self._begins
        piece = np.searchsorted(begins, t, side="right") - 1
        inside = (piece >= 0) & (t <= self.edges[-1] + slack[-1])
        piece = np.clip(piece, 0, len(self.left) - 1)
        since = t - self.edges[piece]
        found = np.take(self.left, piece, axis=0)
        if (np.abs(since) > slack[piece]).any():
            part = np.clip(since / self._lengths[piece], 0.0, 1.0)
            found += part[..., None] * (self.right[piece] - found)
        if not inside.all():
            found[~inside] = 0.0
        return found if self.direction is None else found * self.direction

    def spans(self):
        return [(self.edges[0], self.edges[-1])]


class _Interpolated:
    def __init__(self, f, degree, direction=None):
        self.f, self.degree, self.direction = f, degree, direction
        self._size = None

    @property
    def size(self):
        return self._size if self.direction is None else len(self.direction)

    def bound(self, size, mass):
        wanted = size if self.direction is None else 1
        bound = _Interpolated(self.f, self.degree, self.direction)
        bound._size = wanted
        return bound

    def along(self, direction):
        return _Interpolated(self.f, self.degree, direction)

    def spans(self):
        return []

    def values(self, t):
        found = np.array([self._value(float(t)) for t in np.ravel(t)])
        found = found.reshape(np.shape(t) + found.shape[1:])
        return found if self.direction is None else found * self.direction

    def _value(self, t):
        value = np.atleast_1d(np.asarray(self.f(t)))
        if value.dtype.kind not in "biuf":
            raise TypeError(f"load: the function gives dtype {value.dtype}, not real numbers")
        value = value.astype(float)
        if value.ndim != 1 or self._size not in (None, value.size):
            raise ValueError(f"load: the function gives shape {value.shape}, not ({self._size},)")
        if not np.isfinite(value).all():
            raise ValueError(f"load: the function gives {value} at t = {t:g}")
        return value


class _Inertial:
    """A scalar load times ``sign M r``, once masses are known."""

    name = "ground motion or gravity"

    def __init__(self, record, direction, sign):
        self.record, self.sign = record, sign
        self.direction = _finite("direction", direction, 1)

    @property
    def size(self):
        return len(self.direction)

    def bound(self, size, mass):
        if mass is None:
            raise ValueError("load: ground motion and gravity need a system with masses")
        direction = self.sign * (mass @ self.direction)
        terms = {exponent: c * direction for exponent, c in self.record._terms.items()}
        parts = [(part.along(direction), factor) for part, factor in self.record._parts]
        return Load(terms, parts)._bound(size, mass)

    def spans(self):
        return self.record.spans()

    def values(self, t):
        raise ValueError("load: ground motion and gravity have values only within a structure")


class _Rotating:
    size = None
    name = "an unbalance"

    def __init__(self, force, speed, dofs, phase):
        self.force, self.speed, self.dofs, self.phase = force, speed, dofs, phase

    def bound(self, size, mass):
        if max(self.dofs) >= size:
            raise ValueError(f"dofs: {self.dofs} of a system with {size} degrees of freedom")
        across = np.zeros((2, size))
        across[0, self.dofs[0]] = across[1, self.dofs[1]] = self.force
        x = Harmonic(across[0], self.speed, self.phase)
        return x + Harmonic(across[1], self.speed, self.phase - 0.5 * math.pi)

    def spans(self):
        return []

    def values(self, t):
        raise ValueError("load: unbalance has values only within a structure")


def _finite(name, given, ndim):
    """Real, finite numbers with one of some numbers of axes; a float for none."""
    array = finite(name, given)
    allowed = (ndim,) if isinstance(ndim, int) else ndim
    if array.ndim not in allowed:
        axes = " or ".join(map(str, allowed))
        raise ValueError(f"{name}: must have {axes} axes, got shape {array.shape}")
    return array if array.ndim else float(array)


def _added(one, other):
    """Sum of two arrays of coefficients that may differ in degree."""
    if one is None:
        return other
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total


def _product(one, other):
    """Closed form of a product: Re(a) Re(b) = Re(a b + a conj(b)) / 2."""
    terms = {}
    for p, a in one.items():
        for q, b in other.items():
            pairs = [(p + q, b)] if q.imag == 0.0 else [(p + q, 0.5 * b)]
            if q.imag != 0.0:
                pairs.append((p + q.conjugate(), 0.5 * b.conjugate()))
            for exponent, b_part in pairs:
                product = np.zeros((len(a) + len(b) - 1, max(a.shape[1], b.shape[1])), complex)
                for i, row in enumerate(a):
                    product[i : i + len(b_part)] += row * b_part
                terms[exponent] = _added(terms.get(exponent), product)
    return terms
