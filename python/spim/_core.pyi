from collections.abc import Callable
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

__all__ = [
    "Called",
    "ConvergenceError",
    "Flows",
    "InternalError",
    "Linear",
    "Model",
    "ModelError",
    "PrecisionWarning",
    "Propagator",
    "RotatingBeam",
    "SingularMatrixError",
    "SpimError",
    "Stepper",
    "UnsupportedError",
    "Walker",
    "apply",
    "build_info",
    "caught_panics",
    "energy_coordinates",
    "expm",
    "grid",
    "integrate",
    "kernel_level",
    "methods",
    "phi",
    "quadratic",
    "solve",
]

class SpimError(Exception): ...
class ModelError(SpimError): ...
class ConvergenceError(SpimError): ...
class SingularMatrixError(SpimError): ...
class UnsupportedError(SpimError): ...
class InternalError(SpimError): ...
class PrecisionWarning(UserWarning): ...

def expm(
    A: ArrayLike,
    *,
    method: str = "auto",
    pade: int | tuple[int, int] | None = None,
    order: int | None = None,
    doublings: int | None = None,
) -> np.ndarray: ...
def phi(A: ArrayLike, k: int, *, tau: float = 1.0) -> list[np.ndarray]: ...
def kernel_level(level: str | None = None) -> str: ...
def build_info() -> tuple[str, str, str]: ...
def caught_panics() -> int: ...
def grid(
    t0: float, t1: float, step: float, resumed: int | None = None
) -> tuple[float, int, bool]: ...
def quadratic(S: ArrayLike, x: ArrayLike) -> np.ndarray: ...
def solve(D: ArrayLike, B: ArrayLike) -> np.ndarray: ...
def energy_coordinates(M: ArrayLike, K: ArrayLike) -> list[tuple[np.ndarray, np.ndarray]]: ...
def apply(hi: ArrayLike, lo: ArrayLike, x: ArrayLike) -> np.ndarray: ...
def methods() -> list[dict[str, Any]]: ...
def integrate(
    system: Linear | RotatingBeam | Model | Called,
    matrices: Any,
    load: Any,
    z0: ArrayLike,
    t0: float,
    t1: float,
    step: float,
    method: str,
    every: int,
    outputs: ArrayLike | None,
    options: dict[str, Any],
    progress: Callable[[float, float], object] | None,
    resume: tuple[ArrayLike, ArrayLike, int, int, bool] | None = None,
    watch: Callable[[int, float, np.ndarray], str | None] | None = None,
) -> dict[str, Any]: ...

@final
class Linear:
    def __new__(cls, A: ArrayLike) -> Linear: ...
    @property
    def A(self) -> np.ndarray: ...
    @property
    def hamiltonian(self) -> bool: ...
    def energy(self, z: ArrayLike) -> np.ndarray: ...

@final
class Propagator:
    def __new__(
        cls,
        A: Any,
        tau: float,
        *,
        method: str = "auto",
        correction: str = "auto",
        pade: int | tuple[int, int] | None = None,
        order: int | None = None,
        doublings: int | None = None,
    ) -> Propagator: ...
    @property
    def matrix(self) -> np.ndarray: ...
    @property
    def increment(self) -> np.ndarray: ...
    @property
    def symplectic_defect(self) -> float: ...
    @property
    def order(self) -> int | None: ...
    @property
    def doublings(self) -> int: ...
    @property
    def tau(self) -> float: ...
    @property
    def method(self) -> str: ...
    @property
    def correction(self) -> str: ...
    def step(self, z: ArrayLike) -> np.ndarray: ...
    def trajectory(self, z0: ArrayLike, steps: int, every: int | None = None) -> np.ndarray: ...

@final
class RotatingBeam:
    def __new__(
        cls,
        arrays: dict[str, np.ndarray],
        length: float,
        rule: list[list[float]],
        moments: list[float],
        tip_inertia: float,
        coupling: str,
        hub: tuple[float, float | None] | None,
        rotation: Any,
        radius: float,
        ground_spring: float,
        gravity: tuple[float, float],
        damping: tuple[float, float],
        loads: Callable[..., Any] | None,
        follow: bool,
    ) -> RotatingBeam: ...
    @property
    def size(self) -> int: ...
    @property
    def fastest(self) -> float: ...
    def energies(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...
    def rates(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...
    def momenta(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...
    def rate(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...

@final
class Called:
    def __new__(
        cls,
        kind: str,
        function: Callable[..., Any],
        len: int,
        writes: bool,
        matrix: ArrayLike | None = None,
        velocity: Callable[..., Any] | None = None,
    ) -> Called: ...
    @property
    def size(self) -> int: ...

@final
class Model:
    def __new__(cls, name: str, parameters: ArrayLike) -> Model: ...
    @property
    def size(self) -> int: ...
    def energies(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...
    def rate(self, t: ArrayLike, z: ArrayLike) -> np.ndarray: ...

@final
class Flows:
    def __new__(cls, A: ArrayLike, tau: float, forms: ArrayLike) -> Flows: ...
    def totals(self, states: ArrayLike) -> np.ndarray: ...

@final
class Stepper:
    def __new__(cls, W: ArrayLike, B: ArrayLike, z: ArrayLike) -> Stepper: ...
    @property
    def state(self) -> np.ndarray: ...
    @state.setter
    def state(self, z: ArrayLike) -> None: ...
    def step(self, u: ArrayLike | None, v: ArrayLike | None) -> np.ndarray: ...

@final
class Walker:
    def __new__(
        cls,
        system: Linear | RotatingBeam | Model | Called,
        matrices: Any,
        load: Any,
        z: ArrayLike,
        t: float,
        h: float,
        method: str,
        options: dict[str, Any],
    ) -> Walker: ...
    @property
    def t(self) -> float: ...
    @property
    def state(self) -> np.ndarray: ...
    @property
    def evaluations(self) -> int: ...
    def step(self) -> np.ndarray: ...
    def restart(self, t: float, z: ArrayLike) -> None: ...
    def checkpoint(self) -> tuple[float, int, np.ndarray, np.ndarray]: ...
    def restore(self, t0: float, k: int, z: ArrayLike, carried: ArrayLike) -> None: ...
    def tangent(self, t: ArrayLike, z: ArrayLike, product: ArrayLike) -> np.ndarray: ...
