"""A load at work on a linear system in one run: what the core asks of it."""

import functools
import math

import numpy as np

from spim._core import SingularMatrixError, expm, phi
from spim.loads import NEAR, _Interpolated, _Pieces

# Different distances of breakpoints from grid points for which exponentials are kept.
MOST_DISTANCES = 4096

# Exponents from which an exponential loses digits to the end of the range of doubles.
SMALLEST = 650.0
LARGEST = 709.0


class Acting:
    """A bound load on ``z' = A z + E f(t)`` over the grid ``t0 + k h``, ``0 <= k < steps``.

    `inputs`, `matrix` and `start` generate what is in closed form, ``f = inputs g``, ``g' = matrix
    g``; `impulses` integrates the rest over each step.
    """

    def __init__(self, A, E, load, t0, h, steps):
        self._A, self._E, self._load, self._t0, self._h = A, E, load, t0, h
        self._steps, self.width = steps, len(A)
        fastest = max((x.real * h for x in load._terms), default=0.0)
        if fastest > LARGEST:
            raise OverflowError(
                f"load: an exponential of rate {fastest / h:g} exceeds 1.8e308 within a step; "
                "shorten the step"
            )
        self._closed = _generator(load._terms, E)
        self.inputs, self.matrix = self._closed
        try:
            self.start = _generated(load._terms, t0)
        except OverflowError:
            raise OverflowError(f"load: exceeds 1.8e308 at the start, t = {t0:g}") from None

    def _step_nothing_along(self):
        """What is in closed form comes as impulses too."""
        self.inputs, self.matrix = np.zeros((self.width, 0)), np.zeros((0, 0))
        self.start = np.zeros(0)

    # What a function raised for a step that has not been taken yet.
    failure = None

    # What follows takes exponentials, which methods that ask for values alone do without.

    @functools.cached_property
    def parts(self):
        """What is not in closed form, each at work in this run."""
        phis = functools.cache(lambda count: phi(self._A, count, tau=self._h))
        kinds = {_Pieces: _PiecesAtWork, _Interpolated: _InterpolatedAtWork}
        parts = []
        for part, factor in self._load._parts:
            along = self._E if part.direction is None else self._E @ part.direction[:, None]
            kind = kinds[type(part)]
            parts.append(kind(self._A, factor * along, part, self._t0, self._h, phis))
        return parts

    @functools.cached_property
    def records(self):
        """Parts with a sample a step, for the core."""
        return [record for part in self.parts if (record := part.record()) is not None]

    @functools.cached_property
    def _called(self):
        """The other parts."""
        return [part for part in self.parts if part.record() is None]

    @property
    def sampled(self):
        """Whether there are impulses beyond those of the records."""
        return bool(self._called)

    @functools.cached_property
    def _theta(self):
        """What a unit state of the generator does in a step."""
        inputs, matrix = self._closed
        m, size = self.width, len(matrix)
        whole = np.block([[self._A, inputs], [np.zeros((size, m)), matrix]])
        return phi(whole, 0, tau=self._h)[0][:m, m:]

    def value(self, t):
        """``E f(t)``."""
        return self._E @ self._load(t)

    def grid_values(self, k, count):
        """``E f`` at grid points k, k + 1, ..: `count` numbers, a row each; zero beyond the run."""
        rows = np.zeros((count // self.width, self.width))
        inside = min(len(rows), self._steps + 1 - k)
        if inside > 0:
            times = self._t0 + self._h * np.arange(k, k + inside)
            rows[:inside] = self._load(times) @ self._E.T
        return rows

    def impulses(self, k, count):
        """Impulses of steps k, k + 1, ..: `count` numbers, a row a step; zero beyond the run."""
        rows = np.zeros((count // self.width, self.width))
        inside = min(len(rows), self._steps - k)
        if inside > 0:
            self._add_called(k, rows[:inside])
        return rows

    def _add_called(self, k, rows):
        """Adds impulses of what is called; a failure shows in the step it belongs to."""
        for part in self._called:
            before = rows.copy()
            try:
                part.add(k, rows)
            except Exception:
                rows[:] = before
                for step in range(len(rows)):
                    try:
                        part.add(k + step, rows[step : step + 1])
                    except Exception as error:
                        if step == 0:
                            raise
                        # The steps before are taken; then this is what ended the run.
                        self.failure = error
                        rows[step:] = np.nan
                        return

    def all_impulses(self, k, count):
        """Impulses of `count` steps from k on, (count, m): closed forms and records included."""
        rows = np.zeros((count, self.width))
        for part in self.parts:
            part.add(k, rows)
        self._add_closed(k, rows)
        return rows

    def _add_closed(self, k, rows):
        if self._load._terms:
            rows += self.generated(k, len(rows)) @ self._theta.T

    def generated(self, k, count):
        """The generator's state at grid points k, k + 1, .., (count, g)."""
        since, late = _product(self._h, np.arange(k, k + count, dtype=float))
        times, rest = _sum(self._t0, since)
        return np.array(
            [_generated(self._load._terms, t, d) for t, d in zip(times, rest + late, strict=True)]
        ).reshape(count, -1)


class ActingStepByStep(Acting):
    """A load of which everything is integrated over each step, closed forms as well."""

    def __init__(self, A, E, load, t0, h, steps):
        super().__init__(A, E, load, t0, h, steps)
        self._step_nothing_along()

    @property
    def sampled(self):
        """Whether there are impulses beyond those of the records."""
        return bool(self._called) or bool(self._load._terms)

    def impulses(self, k, count):
        """Impulses of steps k, k + 1, .. but for records: `count` numbers, a row a step."""
        rows = super().impulses(k, count)
        inside = min(len(rows), self._steps - k)
        if inside > 0:
            self._add_closed(k, rows[:inside])
        return rows


class ActingByInverse(Acting):
    """The paper's eq. 45: loads linear over each step, by the inverse of A in doubles."""

    def __init__(self, A, E, load, t0, h, steps):
        super().__init__(A, E, load, t0, h, steps)
        self._step_nothing_along()
        inverse = _inverse(A)
        grown = expm(h * A) - np.eye(len(A))
        # Of r0 + r1 s: (T A^-1) r0 + (T A^-2 - h A^-1) r1, T the increment.
        self._weights = inverse @ grown @ E, inverse @ (inverse @ grown - h * np.eye(len(A))) @ E

    sampled = False

    @property
    def records(self):
        """One record: the load at all grid points."""
        constant, linear = self._weights
        times = self._t0 + self._h * np.arange(self._steps + 1)
        late = linear / self._h
        return [(np.ascontiguousarray(self._load(times)), 0, constant - late, late)]


def begins_below_doubles(load, t0, h):
    """Whether an exponential grows along the run from less than doubles hold: no state to step."""
    return any(x.real * t0 < -SMALLEST and x.real * h > 0.0 for x in load._terms)


def _inverse(A):
    """Of a matrix that has one whatever the units of its rows and columns."""
    rows = np.abs(A).max(axis=1)
    columns = np.abs(A / np.where(rows > 0.0, rows, 1.0)[:, None]).max(axis=0)
    if (rows > 0.0).all() and (columns > 0.0).all():
        even = A / rows[:, None] / columns
        if np.linalg.cond(even) < 0.01 / np.finfo(float).eps:
            return np.linalg.inv(even) / columns[:, None] / rows
    raise SingularMatrixError(
        'forcing: "inverse" needs a matrix with an inverse; A is singular to rounding (rigid '
        'modes?); forcing="exact" needs none'
    )


def _sum(a, b):
    """The rounded sum, and its error, exactly."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _product(a, b):
    """The rounded product, and its error, exactly (Dekker)."""
    p = a * b
    halves = []
    for x in (a, b):
        large = 134217729.0 * x
        high = large - (large - x)
        halves.append((high, x - high))
    (a1, a2), (b1, b2) = halves
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


def _generated(terms, t, late=0.0):
    """The generator's state: ``t^j/j! exp(exponent t)``, real and imaginary parts, at `t` + `late`.

    Phases far from t = 0 are right to rounding: what their product loses turns them on.
    """
    state = []
    for exponent, coefficients in terms.items():
        phase, lost = _product(exponent.imag, t)
        if not math.isfinite(lost):
            lost = 0.0
        lost += exponent.imag * late
        grown = math.exp(min(exponent.real * t, LARGEST)) * (1.0 + exponent.real * late)
        turned = complex(math.cos(phase), math.sin(phase)) if math.isfinite(phase) else math.nan
        wave = grown * turned * complex(1.0, lost)
        for j in range(len(coefficients)):
            g = wave * (t + late) ** j / math.factorial(j)
            state.extend([g.real] if exponent.imag == 0.0 else [g.real, g.imag])
    return np.array(state)


def _generator(terms, E):
    """Closed form as a linear system of its own, per exponent a chain of powers of time."""
    inputs, blocks = [np.zeros((len(E), 0))], []
    for exponent, coefficients in terms.items():
        real = exponent.imag == 0.0
        degree = len(coefficients) - 1
        width = 1 if real else 2
        block = np.zeros((width * (degree + 1),) * 2)
        rotation = np.array([[exponent.real, -exponent.imag], [exponent.imag, exponent.real]])
        for j, row in enumerate(coefficients):
            here = slice(width * j, width * (j + 1))
            block[here, here] = rotation[:width, :width]
            if j:
                block[here, slice(width * (j - 1), width * j)] = np.eye(width)
            column = math.factorial(j) * np.array([row.real, -row.imag][:width]).T
            inputs.append(E @ column)
        blocks.append(block)
    size = sum(map(len, blocks))
    matrix = np.zeros((size, size))
    at = 0
    for block in blocks:
        matrix[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return np.hstack(inputs), matrix


class _PiecesAtWork:
    """Linear pieces. `inputs` (m, r) is what they act through, `degree` that of a piece."""

    def __init__(self, A, B, pieces, t0, h, phis):
        self._A, self._h, self._pieces, self._phis = A, h, pieces, phis
        self.inputs, self.degree = B, 0 if pieces.held else 1
        x = (pieces.edges - t0) / h
        if h < 0.0:
            x = x[::-1]
        grid = np.round(x)
        # Within rounding on the grid.
        rounding = np.spacing(np.abs(pieces.edges)) + np.spacing(abs(t0))
        slack = 2.0 * rounding[:: 1 if h > 0.0 else -1] / abs(h)
        slack = np.maximum(np.maximum(NEAR, 4.0 * np.finfo(float).eps * np.abs(grid)), slack)
        slack = np.minimum(slack, 0.01)
        self._x = np.where(np.abs(x - grid) <= slack, grid, x)
        self._within = {}

    @functools.cached_property
    def _weights(self):
        """What a value and a slope do in a step, each (r, m)."""
        _, first, second = self._phis(2)
        return self._h * (first @ self.inputs).T, self._h * (second @ self.inputs).T

    def record(self):
        """For the core, if there is one sample a step: samples, first step, weights."""
        begin = round(self._x[0])
        if self._x[0] != begin or (np.diff(self._x) != 1.0).any():
            return None
        samples = self._pieces.samples[:: 1 if self._h > 0.0 else -1]
        constant, linear = self._weights
        if self._pieces.held:
            return samples, begin, constant.T, None
        return samples, begin, (constant - linear).T, linear.T

    @functools.cached_property
    def _lefts(self):
        """Values where pieces begin; zero after the last."""
        pieces = self._pieces
        left = pieces.left if self._h > 0.0 else pieces.right[::-1]
        return np.vstack([left, np.zeros((1, left.shape[1]))])

    @functools.cached_property
    def _rights(self):
        """Values where pieces end."""
        return self._pieces.right if self._h > 0.0 else self._pieces.left[::-1]

    @functools.cached_property
    def _slopes(self):
        """Slopes of pieces, per step; zero after the last."""
        slopes = (self._rights - self._lefts[:-1]) / np.diff(self._x)[:, None]
        return np.vstack([slopes, np.zeros((1, slopes.shape[1]))])

    @functools.cached_property
    def _changes(self):
        """What changes at each edge: jumps of values, bends of slopes."""
        before = np.zeros((1, self._lefts.shape[1]))
        jumps = self._lefts - np.vstack([before, self._rights])
        return jumps, self._slopes - np.vstack([before, self._slopes[:-1]])

    def add(self, k, rows):
        """Adds the impulses of steps k, k + 1, .. to `rows`."""
        value, slope = self._starts(k, len(rows))
        constant, linear = self._weights
        rows += value @ constant + slope @ linear
        jumps, bends = self._changes
        for edge in self._inner(k, len(rows)):
            step = math.floor(self._x[edge])
            jump, bend = self._from(step + 1.0 - self._x[edge])
            rows[step - k] += jumps[edge] @ jump + bends[edge] @ bend

    def polynomials(self, k, count):
        """At the starts of steps k, k + 1, ..: values and, unless held, changes in a step."""
        value, slope = self._starts(k, count)
        return value if self._pieces.held else np.hstack([value, slope])

    def breaks(self, k, count):
        """Within these steps: (place, what `polynomials` changes by there)."""
        jumps, bends = self._changes
        for edge in self._inner(k, count):
            change = [jumps[edge]] if self._pieces.held else [jumps[edge], bends[edge]]
            yield float(self._x[edge]), np.concatenate(change)

    def _starts(self, k, count):
        """Values and slopes per step at the starts of steps."""
        x = np.arange(k, k + count, dtype=float)
        piece = np.searchsorted(self._x, x, side="right") - 1
        inside = piece >= 0
        value, slope = np.zeros((2, count, self.inputs.shape[1]))
        piece, at = piece[inside], x[inside]
        slope[inside] = self._slopes[piece]
        value[inside] = self._lefts[piece] + slope[inside] * (at - self._x[piece])[:, None]
        return value, slope

    def _inner(self, k, count):
        """Edges within these steps, not at their ends."""
        first, last = np.searchsorted(self._x, [k, k + count])
        return [edge for edge in range(first, last) if self._x[edge] % 1.0 != 0.0]

    def _from(self, rest):
        """What a jump and a bend do over the rest of a step."""
        key = round(rest, 12)
        if key not in self._within:
            if len(self._within) >= MOST_DISTANCES:
                self._within.clear()
            tau = rest * self._h
            _, first, second = phi(self._A, 2, tau=tau)
            jump, bend = tau * (first @ self.inputs).T, tau * rest * (second @ self.inputs).T
            self._within[key] = jump, bend
        return self._within[key]


class _InterpolatedAtWork:
    """A function, a polynomial over each step. `inputs` (m, r) is what it acts through."""

    def __init__(self, A, B, part, t0, h, phis):
        self._part, self._t0, self._h, self._phis = part, t0, h, phis
        self.inputs, self.degree = B, part.degree
        count = part.degree + 1
        nodes, _ = np.polynomial.legendre.leggauss(count)
        self._nodes = 0.5 * (1.0 + nodes)
        # Derivatives by s/h at the start from values at the nodes.
        powers = np.linalg.inv(np.vander(self._nodes, count, increasing=True))
        self._derivatives = powers * [[math.factorial(j)] for j in range(count)]

    @functools.cached_property
    def _weights(self):
        """What the value at each node does in a step, (d + 1, r, m)."""
        functions = self._phis(self.degree + 1)
        impulses = [self._h * (phi @ self.inputs).T for phi in functions[1:]]
        return np.einsum("ji,jnm->inm", self._derivatives, impulses)

    def record(self):
        """None: its values are found as the run goes."""

    def add(self, k, rows):
        """Adds the impulses of steps k, k + 1, .. to `rows`."""
        for values, weights in zip(self._values(k, len(rows)), self._weights, strict=True):
            rows += values @ weights

    def polynomials(self, k, count):
        """At the starts of steps k, k + 1, ..: values and derivatives by parts of a step."""
        values = np.array(list(self._values(k, count)))
        return np.einsum("ji,ikr->kjr", self._derivatives, values).reshape(count, -1)

    def breaks(self, k, count):
        """None within a step."""
        return ()

    def _values(self, k, count):
        """At each node of steps k, k + 1, .., (count, r)."""
        steps = np.arange(k, k + count)
        for node in self._nodes:
            times = self._t0 + (steps + node) * self._h
            yield np.array([self._part._value(float(t)) for t in times])
