"""Torques and forces on a beam, as the core asks for them."""

import inspect

import numpy as np

from spim._arrays import finite


def takes_state(function):
    """Whether a function of time takes the state as well: f(t) or f(t, z)."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters if p.kind in kinds and p.default is inspect.Parameter.empty]
    return len(needed) >= 2


class _Value:
    """One torque or force: a number or an array, f(t), or f(t, z)."""

    def __init__(self, name, given, shapes):
        self.name, self.shapes = name, shapes
        self.constant = None if callable(given) else self._checked(given, "")
        self.function = given if callable(given) else None
        self.of_state = callable(given) and takes_state(given)

    def _checked(self, value, where):
        value = finite(f"{self.name}{where}", value)
        if value.shape not in self.shapes:
            wanted = " or ".join(map(str, self.shapes))
            raise ValueError(f"{self.name}: must have shape {wanted}, got {value.shape}{where}")
        return value

    def __call__(self, t, z):
        if self.function is None:
            return self.constant
        value = self.function(t, z) if self.of_state else self.function(t)
        return self._checked(value, f" at t = {t:g} s")


class Applied:
    """All that acts on a beam of so many elements, together.

    Called as ``f(t, z)``; gives hub torque, joint torque, tip force (2,), and forces on the
    elements (n, 2) or None.
    """

    def __init__(self, elements, hub_torque, joint_torque, tip_force, distributed_force):
        self._elements = elements
        self._hub = _Value("hub_torque", hub_torque, [()])
        self._joint = _Value("joint_torque", joint_torque, [()])
        self._tip = _Value("tip_force", tip_force, [(2,)])
        shapes = [(2,), (elements, 2)]
        self._spread = None
        if distributed_force is not None:
            self._spread = _Value("distributed_force", distributed_force, shapes)

    def __call__(self, t, z):
        spread = None
        if self._spread is not None:
            spread = np.broadcast_to(self._spread(t, z), (self._elements, 2))
            spread = np.ascontiguousarray(spread)
        tip = self._tip(t, z)
        return float(self._hub(t, z)), float(self._joint(t, z)), [tip[0], tip[1]], spread
