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


class Acting:
    """A bound load on ``z' = A z + E f(t)`` over the grid ``t0 + k h``, ``0 <= k < steps``.

    `inputs`, `matrix` and `start` generate what is in closed form, ``f = inputs g``, ``g' = matrix
    g``; `impulses` integrates the rest over each step.
    """

    def __init__(self, A, E, load, t0, h, steps):
        self._A, self._E, self._load, self._t0, self._h = A, E, load, t0, h
        self._steps, self.width = steps, len(A)
        self._closed = _generator(load._terms, E)
        self.inputs, self.matrix = self._closed
        self.start = _generated(load._terms, t0)

    def _step_nothing_along(self):
        """What is in closed form comes as impulses too."""
        self.inputs, self.matrix = np.zeros((self.width, 0)), np.zeros((0, 0))
        self.start = np.zeros(0)

    # What follows takes exponentials, which methods that ask for values alone do without.

    @functools.cached_property
    def _parts(self):
        phis = functools.cache(lambda count: phi(self._A, count, tau=self._h))
        return [
            _at_work(self._A, self._E, part, factor, self._t0, self._h, phis)
            for part, factor in self._load._parts
        ]

    @functools.cached_property
    def records(self):
        """Parts with a sample a step, for the core."""
        return [record for part in self._parts if (record := part.record()) is not None]

    @functools.cached_property
    def _called(self):
        """The other parts."""
        return [part for part in self._parts if part.record() is None]

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
            for part in self._called:
                part.add(k, rows[:inside])
        return rows

    def all_impulses(self, k, count):
        """Impulses of `count` steps from k on, (count, m): closed forms and records included."""
        rows = np.zeros((count, self.width))
        for part in self._parts:
            part.add(k, rows)
        self._add_closed(k, rows)
        return rows

    def _add_closed(self, k, rows):
        if self._load._terms:
            times = self._t0 + self._h * np.arange(k, k + len(rows))
            rows += np.array([_generated(self._load._terms, t) for t in times]) @ self._theta.T


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


def _generated(terms, t):
    """The generator's state: ``t^j/j! exp(exponent t)``, real and imaginary parts."""
    state = []
    for exponent, coefficients in terms.items():
        for j in range(len(coefficients)):
            g = np.exp(exponent * t) * t**j / math.factorial(j)
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


def _at_work(A, E, part, factor, t0, h, phis):
    B = factor * (E if part.direction is None else E @ part.direction[:, None])
    kinds = {_Pieces: _PiecesAtWork, _Interpolated: _InterpolatedAtWork}
    return kinds[type(part)](A, B, part, t0, h, phis)


class _PiecesAtWork:
    def __init__(self, A, B, pieces, t0, h, phis):
        self._A, self._B, self._h, self._pieces = A, B, h, pieces
        x = (pieces.edges - t0) / h
        if h < 0.0:
            x = x[::-1]
        grid = np.round(x)
        # Within rounding on the grid.
        slack = np.maximum(NEAR, 4.0 * np.finfo(float).eps * np.abs(grid))
        self._x = np.where(np.abs(x - grid) <= slack, grid, x)
        _, first, second = phis(2)
        self._constant, self._linear = h * (first @ B).T, h * (second @ B).T
        self._within = {}

    def record(self):
        """For the core, if there is one sample a step: samples, first step, weights."""
        begin = round(self._x[0])
        if self._x[0] != begin or (np.diff(self._x) != 1.0).any():
            return None
        samples = self._pieces.samples[:: 1 if self._h > 0.0 else -1]
        if self._pieces.held:
            return samples, begin, self._constant.T, None
        return samples, begin, (self._constant - self._linear).T, self._linear.T

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
        x = np.arange(k, k + len(rows), dtype=float)
        piece = np.searchsorted(self._x, x, side="right") - 1
        inside = piece >= 0
        piece, at = piece[inside], x[inside]
        slope = self._slopes[piece]
        value = self._lefts[piece] + slope * (at - self._x[piece])[:, None]
        rows[inside] += value @ self._constant + slope @ self._linear
        jumps, bends = self._changes
        first, last = np.searchsorted(self._x, [k, k + len(rows)])
        for edge in range(first, last):
            step = math.floor(self._x[edge])
            if step == self._x[edge]:
                continue
            jump, bend = self._from(step + 1.0 - self._x[edge])
            rows[step - k] += jumps[edge] @ jump + bends[edge] @ bend

    def _from(self, rest):
        """What a jump and a bend do over the rest of a step."""
        key = round(rest, 12)
        if key not in self._within:
            if len(self._within) >= MOST_DISTANCES:
                self._within.clear()
            tau = rest * self._h
            _, first, second = phi(self._A, 2, tau=tau)
            jump, bend = tau * (first @ self._B).T, tau * rest * (second @ self._B).T
            self._within[key] = jump, bend
        return self._within[key]


class _InterpolatedAtWork:
    def __init__(self, A, B, part, t0, h, phis):
        self._part, self._t0, self._h = part, t0, h
        count = part.degree + 1
        nodes, _ = np.polynomial.legendre.leggauss(count)
        self._nodes = 0.5 * (1.0 + nodes)
        # Coefficients of powers of s/h from values at the nodes.
        powers = np.linalg.inv(np.vander(self._nodes, count, increasing=True))
        functions = phis(count)
        impulses = [h * math.factorial(j) * (functions[j + 1] @ B).T for j in range(count)]
        self._weights = np.einsum("ji,jnm->inm", powers, impulses)

    def record(self):
        """None: its values are found as the run goes."""

    def add(self, k, rows):
        """Adds the impulses of steps k, k + 1, .. to `rows`."""
        steps = np.arange(k, k + len(rows))
        for node, weights in zip(self._nodes, self._weights, strict=True):
            times = self._t0 + (steps + node) * self._h
            values = np.array([self._part._value(float(t)) for t in times])
            rows += values @ weights
