"""Tangent maps of runs: how the state at one time depends on the first."""

import numpy as np

from spim import _core
from spim._coordinates import coordinates_of
from spim._core import UnsupportedError
from spim._walk import walk

# Steps whose states are held at once.
PIECE = 4096
NEVER = 2**62


def tangent(solution, t):
    """The derivative of z(t) by z(start), (m, m)."""
    system, h = solution.system, solution.step
    start, z = solution._start
    size = system.size
    count, rest = _steps(start, t, h)
    if hasattr(system, "with_load"):
        return _columns(solution, system.with_load(None), start, start + count * h, t, rest)
    if solution._options.get("approximation") not in (None, "linear"):
        raise UnsupportedError(
            f"jacobian: steps of {solution._name} with this approximation go on from several "
            'states before them, so that there is no map of one; take "linear", or another method'
        )
    product = np.eye(len(z))[:, :size]
    for first, states in _states(solution, count + (rest != 0.0)):
        whole = min(len(states), count - first)
        times = start + h * np.arange(first, first + whole)
        if whole:
            product = _walker(solution, z, start, h).tangent(times, states[:whole], product)
        if whole < len(states):
            product = _walker(solution, z, start, rest).tangent(
                [start + count * h], states[whole:], product
            )
    return product[:size]


def _steps(start, t, h):
    """Whole steps from `start` to `t`, and what is left, 0 within rounding."""
    if h == 0.0:
        return 0, 0.0
    places = (t - start) / h
    count = round(places)
    slack = max(1e-9, 8.0 * np.spacing(max(abs(t), abs(start))) / abs(h))
    if abs(places - count) <= slack:
        return count, 0.0
    count = int(np.floor(places))
    return count, t - (start + count * h)


def _columns(solution, free, start, end, t, rest):
    """Of a linear system without its load: its runs from unit states."""
    name, options, h = solution._name, solution._options, abs(solution.step)
    columns = np.eye(free.size)
    for column in columns:
        if end != start:
            column[:] = _last(walk(free, column, start, end, h, name, NEVER, options))
        if rest:
            column[:] = _last(walk(free, column, end, t, abs(rest), name, NEVER, options))
    return columns.T


def _last(run):
    if run["error"] is not None:
        raise run["error"]
    return run["last"]


def _walker(solution, z, t, h):
    # Differences would divide what early ends of iterations leave.
    loose = "roundoff", "tolerance"
    options = {name: value for name, value in solution._options.items() if name not in loose}
    chosen = coordinates_of(solution.system, solution._name, options)
    return _core.Walker(chosen.core, chosen.matrices, None, z, t, h, solution._name, options)


def _states(solution, count):
    """Number of a step, and states at its start and those of the next ones, some at a time."""
    if solution._every_step:
        for first in range(0, count, PIECE):
            yield first, np.ascontiguousarray(solution._rows[first : min(first + PIECE, count)])
        return
    # Those between stored states are stepped again.
    (start, z), h = solution._start, solution.step
    for first in range(0, count, PIECE):
        steps = min(PIECE, count - first)
        begin, end = start + first * h, start + (first + steps) * h
        run = walk(solution.system, z, begin, end, abs(h), solution._name, 1, solution._options)
        _last(run)
        yield first, np.ascontiguousarray(run["z"][:-1])
        z = run["z"][-1]
