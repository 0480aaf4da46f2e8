"""What a structure dissipates and what its load does, step by step.

Both are integrals of quadratic forms along the exact motion: over a step from the state X of
system and load together, ``X^T N X`` with ``N`` = integral of ``exp(A s)^T Q exp(A s)``, which
the core works out as it does the motion itself. Nothing here knows the energy, so that a balance of
the three tests them all.
"""

import functools
import math

import numpy as np

from spim._acting import MOST_DISTANCES, Acting, begins_below_doubles
from spim._core import Flows, UnsupportedError, expm
from spim._walk import walk
from spim.loads import NEAR

# Steps that are worked on at once.
PIECE = 4096


def dissipated_and_work(solution):
    """Energy dissipated, and work of the load, from the start to each stored state: (k,), (k,)."""
    if not len(solution.t):
        return np.zeros((2, 0))
    places = _places(solution)
    motion = _Motion(solution)
    # On the grid, or within a step.
    steps = np.floor(places).astype(int)
    marks = places != steps
    found, gone = np.zeros((2, len(places))), np.zeros((2, 1))
    for first, states in _pieces(solution, math.ceil(places[-1])):
        gains, within = motion.gains(first, states, places[marks])
        here = np.hstack([gone, gone + np.cumsum(gains, axis=1)])
        inside = (steps >= first) & (steps <= first + len(states))
        found[:, inside] = here[:, steps[inside] - first]
        gone = here[:, -1:]
        for place, part in within.items():
            found[:, places == place] += part[:, None]
    if not np.isfinite(found).all():
        raise OverflowError("dissipated, work: exceed 1.8e308")
    return found


def _places(solution):
    """The stored times in steps from the start; within rounding on the grid."""
    h = solution.step
    if h == 0.0:
        return np.zeros(len(solution.t))
    places = (solution.t - solution._start[0]) / h
    grid = np.round(places)
    slack = np.maximum(NEAR, 4.0 * np.finfo(float).eps * np.abs(solution.t / h))
    return np.where(np.abs(places - grid) <= slack, grid, places)


def _pieces(solution, count):
    """First step and states at the starts of steps 0 .. count - 1, some at a time."""
    if solution._every_step:
        for first in range(0, count, PIECE):
            yield first, solution.z[first : min(first + PIECE, count)]
        return
    # Those between stored states are stepped again.
    (t0, z), h = solution._start, solution.step
    for first in range(0, count, PIECE):
        steps = min(PIECE, count - first)
        begin, end = t0 + first * h, t0 + (first + steps) * h
        run = walk(solution.system, z, begin, end, abs(h), solution._name, 1, solution._options)
        if run["error"] is not None:
            raise run["error"]
        yield first, run["z"][:-1]
        z = run["z"][-1]


class _Motion:
    """System and load together, ``X' = whole X``, and its energy flows."""

    def __init__(self, solution):
        system, h = solution.system, solution.step
        self._h, self._acting = h, None
        blocks, inputs = [], [np.zeros((system.size, 0))]
        if system.load is not None and h != 0.0:
            t0 = solution._start[0]
            if begins_below_doubles(system._bound_load, t0, h):
                raise UnsupportedError(
                    "dissipated, work: the load grows from less than doubles hold; start later"
                )
            steps = solution.stats["steps"] + 1
            acting = Acting(system.A, system._input, system._bound_load, t0, h, steps)
            self._acting = acting
            blocks.append(acting.matrix)
            inputs.append(acting.inputs)
            for part in acting.parts:
                # Value and derivatives by parts of a step, each fed by the next.
                r, count = part.inputs.shape[1], part.degree + 1
                blocks.append(np.eye(r * count, k=r) / h)
                inputs.append(np.pad(part.inputs, [(0, 0), (0, r * (count - 1))]))
        self._assemble(system, blocks, np.hstack(inputs))

    def _assemble(self, system, blocks, inputs):
        n, m = system.dof, system.size
        width = m + inputs.shape[1]
        whole = np.zeros((width, width))
        whole[:m, :m], whole[:m, m:] = system.A, inputs
        at = m
        for block in blocks:
            whole[at : at + len(block), at : at + len(block)] = block
            at += len(block)
        velocity, force = np.zeros((2, n, width))
        velocity[:, :m] = np.hstack([-0.5 * system._inverse @ system.gyroscopic, system._inverse])
        force[:, m:] = inputs[n:]
        damping = 0.5 * (system.damping + system.damping.T)
        work = velocity.T @ force
        forms = np.array([velocity.T @ damping @ velocity, 0.5 * (work + work.T)])
        # In units of energy: stiff and limp coordinates then weigh alike. Powers of two round
        # nothing.
        scale = np.ones(width)
        stiffness = np.abs(np.diag(system.stiffness))
        scale[:n] = _power_of_two(1.0 / np.sqrt(stiffness + 1e-300))
        scale[n:m] = _power_of_two(np.sqrt(np.diag(system.mass)))
        self._scale = scale
        self._whole = whole * scale / scale[:, None]
        forms = forms * scale * scale[:, None]

        @functools.lru_cache(MOST_DISTANCES)
        def flows(part):
            return Flows(self._whole, part * self._h, forms)

        @functools.lru_cache(MOST_DISTANCES)
        def ahead(part):
            return expm(part * self._h * self._whole)

        # Over a part of a step: energy flows, and the exponential.
        self._flows, self._ahead = flows, ahead

    def gains(self, first, states, marks):
        """Flows of steps from `first` on, (2, k), and up to each mark within one of them."""
        count = len(states)
        parts, breaks = [states], {}
        if self._acting is not None:
            parts.append(self._acting.generated(first, count))
            at = states.shape[1] + parts[-1].shape[1]
            for part in self._acting.parts:
                parts.append(part.polynomials(first, count))
                for place, change in part.breaks(first, count):
                    whole = breaks.setdefault(math.floor(place), {}).setdefault(place, 0.0)
                    breaks[math.floor(place)][place] = whole + self._change(at, change)
                at += parts[-1].shape[1]
        for place in marks[(marks > first) & (marks < first + count)]:
            breaks.setdefault(math.floor(place), {}).setdefault(place, 0.0)
        X = np.hstack(parts) / self._scale
        gains = self._flows(1.0).totals(X)
        within = {}
        for step, changes in breaks.items():
            gains[:, step - first] = self._piecewise(X[step - first], step, changes, within)
        return gains, within

    def _change(self, at, change):
        whole = np.zeros(len(self._scale))
        whole[at : at + len(change)] = change
        return whole

    def _piecewise(self, X, step, changes, within):
        """Flows of a step in which something changes; notes those up to each place of a change."""
        total, last = np.zeros(2), float(step)
        for place in [*sorted(changes), step + 1.0]:
            part = round(place - last, 12)
            total = total + self._flows(part).totals(X[None])[:, 0]
            if place in changes:
                within[place] = total
                X = self._ahead(part) @ X + changes[place]
            last = place
        return total


def _power_of_two(x):
    return 2.0 ** np.clip(np.round(np.log2(x)), -200, 200)
