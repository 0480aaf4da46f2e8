"""Structures: ``M q'' + (C + G) q' + K q = f(t)``."""

import operator
from dataclasses import dataclass

import numpy as np

from spim import _core
from spim._arrays import cholesky, degrees, finite, in_pieces, matrix, mode_shapes, symmetric
from spim._core import SingularMatrixError
from spim._systems import LinearSystem

# Amplification from which a response is rounding.
NO_DIGIT = 1e13


def _in_doubles(name, result):
    if not np.isfinite(result).all():
        raise OverflowError(f"{name}: exceeds 1.8e308, or the state is not finite")
    return result


@dataclass(frozen=True)
class Modes:
    """Modes of a structure without damping and gyroscopic terms.

    Attributes
    ----------
    frequencies : ndarray (k,)
        rad/s, ascending; 0 for rigid modes.
    shapes : ndarray (n, k)
        Columns, mass-normalised: ``shapes^T M shapes = I``.
    damping_ratios : ndarray (k,)
        Of the diagonal of ``shapes^T C shapes``; nan for rigid modes.
    participation : ndarray (k,)
        ``shapes^T M r``, r all ones: what each mode takes from a common acceleration.
    """

    frequencies: np.ndarray
    shapes: np.ndarray
    damping_ratios: np.ndarray
    participation: np.ndarray


class StructuralSystem(LinearSystem):
    """A linear structure, ``M q'' + (C + G) q' + K q = f(t)``.

    As a system of first order its state is ``z = [q; p]`` with the momenta ``p = M q' + G q / 2``;
    `state` makes it of displacements and velocities.

    Parameters
    ----------
    mass : array_like (n, n)
        M, symmetric positive definite. All matrices may be sparse.
    stiffness : array_like (n, n)
        K, symmetric; singular where there are rigid modes.
    damping : array_like (n, n), optional
        C; see `spim.damping`.
    gyroscopic : array_like (n, n), optional
        G, skew-symmetric.
    load : spim.loads.Load, optional
        f(t), n components.

    Raises
    ------
    ValueError
        A mass that is not positive definite (the degree of freedom is named), a matrix that is not
        symmetric or skew to 1e-10 of its largest entry, sizes that do not match, entries that are
        not finite.
    TypeError
        Not real numbers; a load that is none.
    """

    def __init__(self, mass, stiffness, damping=None, gyroscopic=None, load=None):
        M = symmetric("mass", matrix("mass", mass))
        n = len(M)
        K = symmetric("stiffness", matrix("stiffness", stiffness, n))
        C = np.zeros((n, n)) if damping is None else matrix("damping", damping, n)
        G = np.zeros((n, n))
        if gyroscopic is not None:
            G = symmetric("gyroscopic", matrix("gyroscopic", gyroscopic, n), -1.0)
        cholesky("mass", M)
        try:
            inverse = _core.solve(M, np.eye(n))
        except SingularMatrixError:
            raise ValueError(
                "mass: cannot be inverted in doubles; take other units, or leave out degrees of "
                "freedom that have next to no mass"
            ) from None
        inverse = 0.5 * (inverse + inverse.T)
        self._given = M, C, G, K
        self._inverse = inverse
        # Lumped masses are divided by, one by one.
        diagonal = np.diag(inverse).copy()
        self._lumped = diagonal if np.array_equal(inverse, np.diag(diagonal)) else None
        for array in (M, K, C, G):
            array.flags.writeable = False
        across = C + 0.5 * G
        A = np.zeros((2 * n, 2 * n))
        with np.errstate(over="ignore", invalid="ignore"):
            A[:n, :n] = -0.5 * inverse @ G
            A[:n, n:] = inverse
            A[n:, :n] = 0.5 * across @ inverse @ G - K
            A[n:, n:] = -across @ inverse
        if not np.isfinite(A).all():
            raise ValueError("damping: over the mass, or with G, it exceeds 1.8e308; change units")
        super().__init__(A, load=None)
        self._set_load(load, n, M)

    def _matrices(self):
        return self._given

    @property
    def mass(self):
        """M, (n, n); read-only, as all matrices of a system."""
        return self._given[0]

    @property
    def damping(self):
        """C, (n, n)."""
        return self._given[1]

    @property
    def gyroscopic(self):
        """G, (n, n)."""
        return self._given[2]

    @property
    def stiffness(self):
        """K, (n, n)."""
        return self._given[3]

    @property
    def _input(self):
        return np.vstack([np.zeros((self.dof, self.dof)), np.eye(self.dof)])

    @property
    def dof(self):
        """Number n of degrees of freedom."""
        return len(self.mass)

    def state(self, q=None, v=None):
        """The state of displacements and velocities.

        Parameters
        ----------
        q, v : array_like (n,), optional
            Displacements and velocities; zero by default.

        Returns
        -------
        ndarray (2 n,)
        """
        n = self.dof
        q = np.zeros(n) if q is None else finite("q", q, (n,))
        v = np.zeros(n) if v is None else finite("v", v, (n,))
        with np.errstate(over="ignore", invalid="ignore"):
            z = np.concatenate([q, self.mass @ v + 0.5 * self.gyroscopic @ q])
        return _in_doubles("momenta", z)

    def velocity(self, z):
        """Velocities q' of states, (..., 2 n) -> (..., n)."""
        z = self._states(z)
        return _in_doubles("velocity", in_pieces(self.dof, z, self._velocities))

    def acceleration(self, z, t=None):
        """Accelerations q'' of states, (..., 2 n) -> (..., n), under the load at times `t`."""
        z = self._states(z)
        loaded = self._bound_load is not None and t is not None
        times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).reshape(-1) if loaded else None

        def accelerations(rows, z):
            force = z @ self.A[self.dof :].T
            if loaded:
                force += self._bound_load(times[rows])
            if self.gyroscopic.any():
                force -= 0.5 * self._velocities(rows, z) @ self.gyroscopic.T
            return self._over_mass(force)

        return _in_doubles("acceleration", in_pieces(self.dof, z, accelerations))

    def _states(self, z):
        """States as doubles; their length checked."""
        z = np.asarray(z)
        if z.dtype.kind not in "biuf":
            raise TypeError(f"z: needs real numbers, got dtype {z.dtype}")
        z = z.astype(float, copy=False)
        if not z.ndim or z.shape[-1] != self.size:
            raise ValueError(f"z: must have shape (..., {self.size}), got {z.shape}")
        return z

    def _velocities(self, _, z):
        momenta = z[..., self.dof :]
        if self.gyroscopic.any():
            momenta = momenta - 0.5 * z[..., : self.dof] @ self.gyroscopic.T
        return self._over_mass(momenta)

    def _over_mass(self, rows):
        return rows @ self._inverse if self._lumped is None else rows * self._lumped

    def kinetic_energy(self, z):
        """``q'^T M q' / 2`` of states, (..., 2 n) -> (...), in pairs of doubles."""
        return _core.quadratic(self.mass, self.velocity(z))

    def strain_energy(self, z):
        """``q^T K q / 2`` of states, (..., 2 n) -> (...), in pairs of doubles."""
        return _core.quadratic(self.stiffness, self._states(z)[..., : self.dof])

    def energy(self, z):
        """Kinetic and strain energy of states, (..., 2 n) -> (...), in pairs of doubles."""
        return self.kinetic_energy(z) + self.strain_energy(z)

    def modal(self, count=None):
        """The lowest modes.

        Parameters
        ----------
        count : int, optional
            How many; all n by default.

        Returns
        -------
        Modes
        """
        count = self.dof if count is None else operator.index(count)
        if not 1 <= count <= self.dof:
            raise ValueError(f"count: must be 1 to {self.dof}, got {count}")
        squares, shapes = mode_shapes(self.mass, self.stiffness)
        if (squares < 0.0).any():
            raise ValueError("stiffness: has a negative mode; the structure is unstable")
        squares, shapes = squares[:count], shapes[:, :count]
        w = np.sqrt(squares)
        damping = np.einsum("ik,ij,jk->k", shapes, self.damping, shapes)
        ratios = np.divide(damping, 2.0 * w, out=np.full(count, np.nan), where=w > 0.0)
        return Modes(w, shapes, ratios, shapes.T @ self.mass.sum(axis=1))

    def frequency_response(self, frequencies, force=None, outputs=None):
        """Displacements under harmonic forces, ``(K - w^2 M + i w (C + G))^-1 force``.

        Parameters
        ----------
        frequencies : array_like (k,)
            rad/s.
        force : array_like (n,) or (n, r), optional
            Amplitudes, complex where phases differ; by default unit forces, one on each degree of
            freedom.
        outputs : sequence of int, optional
            Degrees of freedom wanted; all by default.

        Returns
        -------
        ndarray (k, n) or (k, n, r), complex

        Raises
        ------
        ValueError
            A force or an output the structure does not have; frequencies that are not finite.
        LinAlgError
            An undamped structure at resonance; the frequency is named.
        """
        w = np.atleast_1d(finite("frequencies", frequencies))
        if w.ndim != 1:
            raise ValueError(f"frequencies: must have shape (k,), got {w.shape}")
        if force is None:
            force = np.eye(self.dof)
        elif np.iscomplexobj(force):
            force = finite("force", np.real(force)) + 1j * finite("force", np.imag(force))
        else:
            force = finite("force", force)
        if force.ndim not in (1, 2) or len(force) != self.dof:
            raise ValueError(f"force: must have shape ({self.dof},) or ({self.dof}, r)")
        outputs = slice(None) if outputs is None else degrees("outputs", outputs, self.dof)
        rate, found = self.damping + self.gyroscopic, []
        for s in w:
            dynamic = self.stiffness - s * s * self.mass + 1j * s * rate
            if not np.isfinite(dynamic).all():
                raise OverflowError(f"frequencies: w^2 M exceeds 1.8e308 at {s:g} rad/s")
            try:
                x = np.linalg.solve(dynamic, force + 0j)
            except np.linalg.LinAlgError:
                x = None
            size = (np.abs(self.stiffness) + s * s * np.abs(self.mass)).max()
            if x is None or np.abs(x).max() * size > NO_DIGIT * np.abs(force).max():
                raise np.linalg.LinAlgError(
                    f"frequencies: {s:g} rad/s is a resonance of the undamped structure"
                )
            found.append(x[outputs])
        return np.array(found)
