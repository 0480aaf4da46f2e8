"""Systems: what can be integrated."""

import copy
import functools
import warnings

import numpy as np

from spim import _core
from spim._solution import Solution
from spim.loads import Load

# Methods whose steps resonate with fast oscillations, and the phase w h from which they can.
RESONANT = "strang", "impulse", "deuflhard", "mclachlan84"
RESONANCE_LIMIT = 2.0


def resonates(method):
    """Whether steps of a method along a fast flow can resonate with it."""
    return method in RESONANT or method.startswith("lawson_gauss")


def resonance(method, fastest, step):
    """What to say of a step that is too large for a method along a fast flow, or None."""
    phase = fastest * abs(step)
    if phase < RESONANCE_LIMIT or not resonates(method):
        return None
    return (
        f"{method}: w_max h = {phase:.3g} is beyond {RESONANCE_LIMIT:g}: steps can resonate with "
        "the fastest oscillations, near multiples of pi; take steps below "
        f"{RESONANCE_LIMIT / fastest:.3g}, or mollified_impulse or eavf"
    )


class System:
    """Base of all systems that `integrate` takes."""

    load = None

    @property
    def size(self):
        """Length m of the state."""
        raise NotImplementedError

    def _warn_before(self, method, step):
        """Warns of a method that cannot be right with this step."""
        # Frequencies are eigenvalues, which may take long.
        words = resonance(method, self._fastest(), step) if resonates(method) else None
        if words is not None:
            warnings.warn(words, stacklevel=3)

    def _chosen(self, step):
        """What method="auto" takes for a step, a `Choice`; None leaves it to the core."""
        return

    @functools.cached_property
    def _spectrum(self):
        """Eigenvalues of a linear part beside a nonlinear one, none where there is none."""
        return np.zeros(0, complex)

    def _fastest(self):
        """Largest frequency of that part."""
        return float(np.abs(self._spectrum.imag).max(initial=0.0))

    def _energy_at(self, z, t):
        """Energies of states at their times, which matter where an energy depends on them."""
        return self.energy(z)

    def _solution(self, run, options, shown):
        """What a run gives back."""
        return Solution(self, run, options, shown)


class LinearSystem(System):
    """A linear system with constant coefficients, ``z' = A z + f(t)``.

    Parameters
    ----------
    A : array_like (m, m)
        Real, finite. Per unit of time.
    load : spim.loads.Load, optional
        f(t), m components.

    Raises
    ------
    ValueError
        Not square, empty, or an entry that is not finite.
    TypeError
        Not real numbers.
    """

    def __init__(self, A, load=None):
        self._core = _core.Linear(A)
        self._A = self._core.A
        self._A.flags.writeable = False
        self._set_load(load, len(self._A), None)

    def _set_load(self, load, size, mass):
        self._load = load
        self._bound_load = None
        if isinstance(load, Load):
            self._bound_load = load._bound(size, mass)
        elif load is not None:
            raise TypeError(
                f"load: must be a load from spim.loads, got {type(load).__name__}; "
                "spim.loads.Function(f) makes one of a function"
            )

    def with_load(self, load):
        """The same system under another load, or None."""
        other = copy.copy(self)
        matrices = self._matrices()
        mass = None if matrices is None else matrices[0]
        other._set_load(load, self._input.shape[1], mass)
        return other

    @property
    def _input(self):
        """What a load acts on: (m, n) ones and zeros."""
        return np.eye(len(self._A))

    @property
    def load(self):
        """The load, or None."""
        return self._load

    @property
    def A(self):
        """The matrix, (m, m); read-only."""
        return self._A

    @property
    def size(self):
        """Length m of the state."""
        return len(self._A)

    @property
    def hamiltonian(self):
        """Whether J A is symmetric to rounding for ``z = [q; p]``, so that there is an energy."""
        return self._core.hamiltonian

    def energy(self, z):
        """Energy ``z^T S z / 2``, ``S = J^-1 A``, of the free system, in pairs of doubles.

        Parameters
        ----------
        z : array_like (..., m)

        Returns
        -------
        ndarray (...)

        Raises
        ------
        UnsupportedError
            `A` is not Hamiltonian.
        ValueError
            A state of the wrong length, or not finite.
        OverflowError
            An energy exceeds 1.8e308; the message numbers the state.
        """
        return self._core.energy(z)

    def _matrices(self):
        """Mass, damping, gyroscopic matrix, stiffness, where there are any."""

    def __setstate__(self, state):
        self.__dict__.update(state)
        for value in state.values():
            # Copies are as read-only as what they are copies of.
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __repr__(self):
        kind = "Hamiltonian, " if self.hamiltonian else ""
        return f"{type(self).__name__}({kind}{self.size} states)"
