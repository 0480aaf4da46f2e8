"""Structure-preserving, high-precision time integration.

Exponentials right to the last bit, steppers that keep the structure of the equations, and runs one
can trust overnight. The numbers are crunched in Rust; a state is ``z = [q; p]`` throughout.

Start with `expm`, `Propagator`, or `integrate` and a system: `LinearSystem`, `StructuralSystem`,
`SeparableSystem`, `SemilinearSystem`, `HamiltonianSystem`, `FlowSystem`, or a model of `models`.
"""

from spim import damping, loads, models, tableau
from spim._calls import cfunc_signature
from spim._checkpoint import Checkpoint
from spim._core import (
    ConvergenceError,
    InternalError,
    ModelError,
    PrecisionWarning,
    Propagator,
    SingularMatrixError,
    SpimError,
    UnsupportedError,
    expm,
    kernel_level,
    phi,
)
from spim._discretize import discretize, discretize_noise
from spim._ensemble import ensemble
from spim._functions import FlowSystem, HamiltonianSystem, SemilinearSystem, SeparableSystem
from spim._integrate import integrate
from spim._linearize import linearize
from spim._methods import methods
from spim._run import Run
from spim._solution import Solution
from spim._structural import StructuralSystem
from spim._sweep import FailedCase, sweep
from spim._symbolic import from_sympy
from spim._systems import LinearSystem
from spim._versions import __version__, show_versions
from spim.tableau import RungeKutta

# Classes for `scipy.integrate.solve_ivp`, made when they are asked for: SciPy is no need.
_SOLVERS = (
    "Gauss2",
    "Gauss4",
    "Gauss6",
    "Gauss8",
    "Gauss16",
    "Verlet",
    "Yoshida4",
    "Yoshida6",
    "Yoshida8",
)


def __getattr__(name):
    if name in _SOLVERS:
        from spim import _solve_ivp

        return getattr(_solve_ivp, name)
    raise AttributeError(f"module 'spim' has no attribute '{name}'")


def __dir__():
    return sorted({*globals(), *_SOLVERS})


__all__ = [
    "Checkpoint",
    "ConvergenceError",
    "FailedCase",
    "FlowSystem",
    "HamiltonianSystem",
    "InternalError",
    "LinearSystem",
    "ModelError",
    "PrecisionWarning",
    "Propagator",
    "Run",
    "RungeKutta",
    "SemilinearSystem",
    "SeparableSystem",
    "SingularMatrixError",
    "Solution",
    "SpimError",
    "StructuralSystem",
    "UnsupportedError",
    "__version__",
    "cfunc_signature",
    "damping",
    "discretize",
    "discretize_noise",
    "ensemble",
    "expm",
    "from_sympy",
    "integrate",
    "kernel_level",
    "linearize",
    "loads",
    "methods",
    "models",
    "phi",
    "show_versions",
    "sweep",
    "tableau",
]
