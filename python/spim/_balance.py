"""What a structure dissipates and what its load does, step by step.

Both are integrals of quadratic forms along the exact motion: over a step from the state X of
system and load together, ``X^T N X`` with ``N`` = integral of ``exp(A s)^T Q exp(A s)``, which
the core works out as it does the motion itself. Nothing here knows the energy, so that a balance of
the three tests them all.
"""

import numpy as np

from spim._acting import Acting, _generated
from spim._core import UnsupportedError, flows

# Steps that are worked on at once.
PIECE = 4096


def dissipated_and_work(solution):
    """Energy dissipated, and work of the load, from the start to each stored state: (k,), (k,)."""
    system = solution.system
    if len(solution.t) != solution.stats["steps"] + 1:
        raise UnsupportedError(
            "dissipated, work: need every step; integrate with every=1, without t_eval"
        )
    n, A, h = system.dof, system.A, solution.step
    velocity = np.hstack([-0.5 * system._inverse @ system.gyroscopic, system._inverse])
    damping = 0.5 * (system.damping + system.damping.T)
    whole, force, states = A, np.zeros((n, 2 * n)), _States(solution.z)
    if system.load is not None:
        acting = Acting(A, system._input, system._bound_load, solution.t[0], h, len(solution.t))
        if acting.sampled:
            raise UnsupportedError(
                "dissipated, work: need loads in closed form or records with a sample a step; take "
                "the record's step for the run, or interpolate the record to the run's"
            )
        states = _States(solution.z, acting, system._bound_load._terms, solution.t)
        whole, force = _together(A, system, acting, h)
    width = len(whole)
    v = np.zeros((n, width))
    v[:, : 2 * n] = velocity
    forms = [v.T @ damping @ v, 0.5 * (v.T @ force + force.T @ v)]
    # In units of energy: stiff and limp coordinates then weigh alike. Powers of two round nothing.
    scale = np.ones(width)
    scale[:n] = _power_of_two(1.0 / np.sqrt(np.abs(np.diag(system.stiffness)) + 1e-300))
    scale[n : 2 * n] = _power_of_two(np.sqrt(np.diag(system.mass)))
    forms = [form * scale * scale[:, None] for form in forms]
    forms = flows(whole * scale / scale[:, None], h, np.array(forms))
    totals = np.zeros((2, len(solution.t)))
    for first in range(0, len(solution.t) - 1, PIECE):
        X = states.piece(first, min(first + PIECE, len(solution.t) - 1)) / scale
        for total, form in zip(totals, forms, strict=True):
            total[first + 1 : first + 1 + len(X)] = np.einsum("ki,ki->k", X @ form, X)
    found = np.cumsum(totals, axis=1)
    if not np.isfinite(found).all():
        raise OverflowError("dissipated, work: exceed 1.8e308")
    return found


def _power_of_two(x):
    return 2.0 ** np.clip(np.round(np.log2(x)), -200, 200)


class _States:
    """States of system and load together, at the starts of steps."""

    def __init__(self, z, acting=None, terms=(), t=None):
        self._z, self._acting, self._terms, self._t = z, acting, dict(terms), t

    def piece(self, first, last):
        """Those of steps first .. last - 1."""
        parts = [self._z[first:last]]
        if self._acting is not None:
            if self._acting.start.size:
                generated = [_generated(self._terms, t) for t in self._t[first:last]]
                parts.append(np.array(generated))
            for samples, begin, _, late in self._acting.records:
                steps = np.arange(first, last) - begin
                count = len(samples) - (late is not None)
                inside = ((steps >= 0) & (steps < count))[:, None]
                steps = np.clip(steps, 0, count - 1)
                parts.append(np.where(inside, samples[steps], 0.0))
                if late is not None:
                    change = samples[steps + 1] - samples[steps]
                    parts.append(np.where(inside, change, 0.0))
        return np.hstack(parts)


def _together(A, system, acting, h):
    """The matrix of system and load, and the load's forces as a map of their state."""
    n, m = system.dof, len(A)
    columns, blocks = [acting.inputs], [acting.matrix]
    parts = system._bound_load._parts
    for (part, factor), (samples, _, _, late) in zip(parts, acting.records, strict=True):
        r = samples.shape[1]
        direction = np.eye(n) if part.direction is None else part.direction[:, None]
        columns.append(factor * system._input @ direction)
        block = np.zeros((r, r))
        if late is not None:
            # Linear over the step: value and change.
            columns.append(np.zeros((m, r)))
            block = np.block([[block, np.eye(r) / h], [np.zeros((r, 2 * r))]])
        blocks.append(block)
    inputs = np.hstack(columns)
    size = inputs.shape[1]
    whole = np.zeros((m + size, m + size))
    whole[:m, :m], whole[:m, m:] = A, inputs
    at = m
    for block in blocks:
        whole[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    force = np.zeros((n, m + size))
    force[:, m:] = inputs[n:]
    return whole, force
