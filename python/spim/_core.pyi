from collections.abc import Callable
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

__all__ = [
    "InternalError",
    "Linear",
    "ModelError",
    "PrecisionWarning",
    "Propagator",
    "SingularMatrixError",
    "SpimError",
    "UnsupportedError",
    "build_info",
    "caught_panics",
    "expm",
    "integrate",
    "kernel_level",
    "methods",
    "phi",
]

class SpimError(Exception): ...
class ModelError(SpimError): ...
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
def methods() -> list[dict[str, Any]]: ...
def integrate(
    system: Linear,
    z0: ArrayLike,
    t0: float,
    t1: float,
    step: float,
    method: str,
    every: int,
    options: dict[str, Any],
    progress: Callable[[float, float], object] | None,
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
