"""Sections of beams: mass and stiffness along the length."""

from dataclasses import dataclass

import numpy as np

from spim._arrays import finite

__all__ = ["DistributedSection", "TaperedSection"]


def _positive(name, value):
    value = float(finite(name, value, ()))
    if value <= 0.0:
        raise ValueError(f"{name}: must be positive, got {value:g}")
    return value


@dataclass(frozen=True)
class TaperedSection:
    """A rectangular section that tapers linearly from root to tip.

    Parameters
    ----------
    root, tip : (float, float)
        Width in the plane of rotation, and thickness across it, m.
    density : float
        kg/m^3.
    youngs_modulus : float
        N/m^2.

    Raises
    ------
    ValueError
        A dimension, density or modulus that is not positive: a taper that closes among them.
    """

    root: tuple[float, float]
    tip: tuple[float, float]
    density: float
    youngs_modulus: float

    def __post_init__(self):
        for name in ("root", "tip"):
            size = finite(name, getattr(self, name))
            if size.shape != (2,):
                raise ValueError(f"{name}: must be (width in plane, thickness), got {size!r}")
            for what, value in zip(("width", "thickness"), size, strict=True):
                if value <= 0.0:
                    raise ValueError(
                        f"{name}: the {what} must be positive, got {value:g} m"
                        + ("; the taper closes" if name == "tip" else "")
                    )
            object.__setattr__(self, name, (float(size[0]), float(size[1])))
        for name in ("density", "youngs_modulus"):
            object.__setattr__(self, name, _positive(name, getattr(self, name)))

    def _sides(self, part):
        """Width and thickness at a part of the length."""
        return [a + (b - a) * part for a, b in zip(self.root, self.tip, strict=True)]

    def mass(self, x, length):
        """Mass a length, kg/m, at x."""
        width, thickness = self._sides(x / length)
        return self.density * width * thickness

    def axial(self, x, length):
        """EA, N, at x."""
        width, thickness = self._sides(x / length)
        return self.youngs_modulus * width * thickness

    def bending(self, x, length):
        """EI in the plane of rotation, N m^2, at x."""
        width, thickness = self._sides(x / length)
        return self.youngs_modulus * thickness * width**3 / 12.0

    def flap(self, x, length):
        """EI across the plane of rotation, N m^2, at x."""
        width, thickness = self._sides(x / length)
        return self.youngs_modulus * width * thickness**3 / 12.0


@dataclass(frozen=True)
class DistributedSection:
    """Mass and stiffness as numbers, or as functions of the place along the beam.

    Parameters
    ----------
    mass_per_length : float or callable
        kg/m; ``f(x)`` for x in m from the root.
    axial_stiffness : float or callable
        EA, N.
    bending_stiffness : float or callable
        EI in the plane of rotation, N m^2.
    flap_stiffness : float or callable, optional
        EI across it; as in the plane by default.

    Raises
    ------
    ValueError
        A number that is not positive; functions are looked at when a beam is made.
    """

    mass_per_length: float
    axial_stiffness: float
    bending_stiffness: float
    flap_stiffness: float | None = None

    def __post_init__(self):
        for name in ("mass_per_length", "axial_stiffness", "bending_stiffness", "flap_stiffness"):
            value = getattr(self, name)
            if value is not None and not callable(value):
                object.__setattr__(self, name, _positive(name, value))

    def _values(self, name, x):
        given = getattr(self, name)
        if not callable(given):
            return np.full(np.shape(x), given)
        values = np.array([float(given(float(x))) for x in np.ravel(x)]).reshape(np.shape(x))
        bad = ~(np.isfinite(values) & (values > 0.0))
        if bad.any():
            at = np.ravel(x)[int(np.argmax(np.ravel(bad)))]
            raise ValueError(
                f"{name}: must be positive and finite, got {np.ravel(values)[np.ravel(bad)][0]:g} "
                f"at x = {at:g} m"
            )
        return values

    def mass(self, x, length):
        """Mass a length, kg/m, at x."""
        return self._values("mass_per_length", x)

    def axial(self, x, length):
        """EA, N, at x."""
        return self._values("axial_stiffness", x)

    def bending(self, x, length):
        """EI in the plane of rotation, N m^2, at x."""
        return self._values("bending_stiffness", x)

    def flap(self, x, length):
        """EI across the plane of rotation, N m^2, at x."""
        name = "bending_stiffness" if self.flap_stiffness is None else "flap_stiffness"
        return self._values(name, x)
