"""The rotating beam: hub, flexible beam, tip mass (Huang, Deng & Yao 2007, eqs. 1-23)."""

import functools
import math
import warnings
from dataclasses import dataclass

import numpy as np

from spim import _core
from spim._arrays import finite
from spim._choice import Choice
from spim._systems import System, resonance
from spim.models import _finite_elements as fe
from spim.models import _toml
from spim.models import rotation as rotations
from spim.models._applied import Applied
from spim.models._beam_modes import BeamAnalysis
from spim.models._beam_solution import BeamSolution
from spim.models.sections import DistributedSection, TaperedSection

# Where RK4 stops being stable, w_max h.
EXPLICIT_LIMIT = 2.828

COUPLINGS = ("foac", "zoac", "third")


@dataclass(frozen=True)
class BeamMatrices:
    """Eq. 15: ``mass y'' + gyroscopic y' + stiffness y = force`` at a state of motion.

    Attributes
    ----------
    mass, gyroscopic, stiffness : ndarray (N, N)
    force : ndarray (N,)
    """

    mass: np.ndarray
    gyroscopic: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray


class RotatingBeam(BeamAnalysis, System):
    """A flexible beam on a rotating hub, in the plane of rotation.

    The hub turns by ``phi1`` against ground, the beam by ``phi2`` against the hub unless the joint
    is locked. In the frame that turns with the beam each of its n nodes has axial displacement u,
    transverse displacement v and slope theta; the state is ``z = [u1 v1 theta1 .. un vn thetan
    phi1 (phi2); p]`` with the conjugate momenta p, without angles where the rotation is prescribed.

    Parameters
    ----------
    length : float
        m.
    section : TaperedSection or DistributedSection
        Mass and stiffness along the beam.
    elements : int
        n; of equal length.
    hub_inertia : float, optional
        kg m^2; needed where the hub moves freely, positive there.
    hub_radius : float
        m.
    ground_spring : float
        Between ground and hub, N m/rad; 0 leaves the hub free.
    joint_spring : float
        Between hub and beam, N m/rad; infinite locks the joint.
    tip_mass, tip_inertia : float
        kg, kg m^2.
    coupling : {"foac", "zoac", "third"}
        "foac", the paper's: foreshortening to first order, within 1 to 2 % at deflections of 0.15
        to 0.2 of the length. "third": exact kinetic energy and elastic energy to third order, for
        larger ones. "zoac": no foreshortening, softens with spin; for comparison.
    gravity : (float, float)
        Along the axes of the plane at rest, m/s^2.
    damping : (float, float)
        alpha [1/s], beta [s] of ``alpha M + beta K``, on rates in the beam's frame.
    hub_torque, joint_torque : float or callable, optional
        On the hub, and of a motor between hub and beam, N m; ``f(t)`` or ``f(t, z)``.
    tip_force : array_like (2,) or callable, optional
        N.
    distributed_force : array_like (2,) or (n, 2) or callable, optional
        N/m, on the whole beam or on each element.
    follower : bool
        Forces turn with the section they act on; otherwise their directions are fixed in the plane.
    rotation : callable or object, optional
        Prescribes the hub's motion: omega(t) in rad/s, or an object with ``.omega(t)`` and
        ``.angle(t)`` such as `SpinUp`, `Trapezoid`, `RotationTable`.

    Raises
    ------
    ValueError, TypeError
        Lengths, masses or stiffnesses that are not positive, a taper that closes, shapes that do
        not match; the message names the argument.

    Notes
    -----
    Equations and figures: Huang, Deng & Yao, J. Sound Vib. 299 (2007) 229-246. ``foac``: Kane, Ryan
    & Banerjee, J. Guidance 10 (1987) 139-151.
    """

    def __init__(
        self,
        *,
        length,
        section,
        elements,
        hub_inertia=None,
        hub_radius=0.0,
        ground_spring=0.0,
        joint_spring=math.inf,
        tip_mass=0.0,
        tip_inertia=0.0,
        coupling="foac",
        gravity=(0.0, 0.0),
        damping=(0.0, 0.0),
        hub_torque=None,
        joint_torque=None,
        tip_force=None,
        distributed_force=None,
        follower=False,
        rotation=None,
    ):
        given = {k: v for k, v in locals().items() if k not in ("self", "__class__")}
        # Arrays may be written to later.
        self._given = {k: v.copy() if isinstance(v, np.ndarray) else v for k, v in given.items()}
        if not isinstance(section, TaperedSection | DistributedSection):
            raise TypeError(
                "section: must be a spim.models.TaperedSection or DistributedSection, got "
                f"{type(section).__name__}"
            )
        if coupling not in COUPLINGS:
            raise ValueError(f'coupling: must be "foac", "zoac" or "third", got {coupling!r}')
        if isinstance(elements, bool) or not isinstance(elements, int | np.integer):
            raise TypeError(f"elements: must be a whole number, got {elements!r}")
        if elements < 1:
            raise ValueError(f"elements: must be 1 or more, got {elements}")
        self.section, self.coupling, self.elements = section, coupling, int(elements)
        self.length = _number("length", length, positive=True)
        self.hub_inertia = None if hub_inertia is None else _number("hub_inertia", hub_inertia)
        self.hub_radius = _number("hub_radius", hub_radius)
        self.ground_spring = _number("ground_spring", ground_spring)
        self.joint_spring = math.inf
        if joint_spring != math.inf:
            self.joint_spring = _number("joint_spring", joint_spring)
        self.tip_mass = _number("tip_mass", tip_mass)
        self.tip_inertia = _number("tip_inertia", tip_inertia)
        self.gravity = tuple(finite("gravity", gravity, (2,)).tolist())
        self.damping = tuple(finite("damping", damping, (2,)).tolist())
        if min(self.damping) < 0.0:
            raise ValueError(f"damping: must not be negative, got {self.damping}")
        if not isinstance(follower, bool | np.bool_):
            raise TypeError(f"follower: must be true or false, got {follower!r}")
        self.rotation, self.follower = rotation, bool(follower)
        self._native = None if rotation is None else rotations.native(rotation)
        self._check_hub(hub_torque, joint_torque)
        self._applied = None
        loads = (hub_torque, joint_torque, tip_force, distributed_force)
        if any(load is not None for load in loads):
            zero = (0.0, 0.0, (0.0, 0.0), None)
            chosen = [z if load is None else load for load, z in zip(loads, zero, strict=True)]
            self._applied = Applied(self.elements, *chosen)
        self._arrays, self._moments = fe.elements(
            section, self.length, self.elements, self.tip_mass, self.tip_inertia
        )

    def _check_hub(self, hub_torque, joint_torque):
        if self.rotation is not None:
            if math.isfinite(self.joint_spring):
                raise ValueError("joint_spring: with a prescribed rotation the joint is locked")
            for name, value in (("hub_torque", hub_torque), ("ground_spring", self.ground_spring)):
                if value:
                    raise ValueError(
                        f"{name}: has no effect on a prescribed rotation; leave it out"
                    )
        if joint_torque is not None and self.joint_spring == math.inf:
            raise ValueError("joint_torque: the joint is locked; give joint_spring, 0 for a hinge")

    @functools.cached_property
    def _core(self):
        hub = None
        if self.rotation is None:
            if not self.hub_inertia:
                raise ValueError(
                    "hub_inertia: a hub that moves freely needs a positive rotary inertia, got "
                    f"{self.hub_inertia}; with rotation= its motion is prescribed"
                )
            spring = None if self.joint_spring == math.inf else self.joint_spring
            hub = self.hub_inertia, spring
        points, weights = fe.rule()
        return _core.RotatingBeam(
            self._arrays,
            self.length / self.elements,
            [points.tolist(), weights.tolist()],
            self._moments.tolist(),
            self.tip_inertia,
            self.coupling,
            hub,
            self._native,
            self.hub_radius,
            self.ground_spring,
            self.gravity,
            self.damping,
            self._applied,
            self.follower,
        )

    def __reduce__(self):
        return _made, (self._given,)

    def to_toml(self):
        """The model as TOML text, units in comments.

        Returns
        -------
        str
            `from_toml` makes the same model of it, to the last bit.

        Raises
        ------
        ValueError
            An argument that is a function, or an object that TOML has no table for; it is named.
        """
        return _toml.written(self)

    @classmethod
    def from_toml(cls, source):
        """The model of TOML text or of a file.

        Parameters
        ----------
        source : str or Path
            Text of several lines as `to_toml` writes it, with tables ``[beam]``, ``[section]`` and,
            where the rotation is prescribed, ``[rotation]``; or the path of such a file. The tables
            ``[run]`` and ``[output]`` of the command ``spim beam`` may be there and are not read.

        Returns
        -------
        RotatingBeam

        Raises
        ------
        ValueError
            No TOML; a table or key that is missing, not known, or of the wrong type; what the model
            itself refuses. Table and key are named.
        OSError
            The file cannot be read.
        """
        return cls(**_toml.arguments(_toml.read(source)))

    def _matrices(self):
        """None of a linear structure's."""

    def _chosen(self, step):
        return Choice("srk2", "symplectic, any number of elements")

    def _warn_before(self, method, step):
        if method == "rk4":
            phase = self._core.fastest * step
            if phase > EXPLICIT_LIMIT:
                warnings.warn(
                    f"rk4: w_max h = {phase:.2f} exceeds {EXPLICIT_LIMIT}: the run will blow up; "
                    f"take steps below {EXPLICIT_LIMIT / self._core.fastest:.3g} s, or srk2",
                    stacklevel=3,
                )
        words = resonance(method, self._core.fastest, step)
        if words is not None:
            warnings.warn(words, stacklevel=3)

    def _solution(self, run, options, shown):
        return BeamSolution(self, run, options, shown)

    # Sizes

    @property
    def angles(self):
        """Angles in the state: 2 with a joint, 1 with it locked, 0 where prescribed."""
        if self.rotation is not None:
            return 0
        return 1 if self.joint_spring == math.inf else 2

    @property
    def dof(self):
        """Degrees of freedom N, ``3 n`` and the angles."""
        return 3 * self.elements + self.angles

    @property
    def size(self):
        """Length 2 N of the state."""
        return 2 * self.dof

    @property
    def nodes(self):
        """Places of the nodes but the clamped one, (n,), m from the root."""
        return self.length / self.elements * np.arange(1, self.elements + 1)

    @property
    def mass(self):
        """Mass of the beam without that at the tip, kg."""
        return float(self._moments[0] - self.tip_mass)

    @property
    def moments(self):
        """``integral of x dm`` [kg m] and ``of x^2 dm`` [kg m^2] about the root, tip included."""
        return float(self._moments[1]), float(self._moments[2])

    # States

    def state(
        self,
        u=0.0,
        v=0.0,
        theta=0.0,
        phi1=0.0,
        phi2=0.0,
        u_rate=0.0,
        v_rate=0.0,
        theta_rate=0.0,
        omega=0.0,
        joint_rate=0.0,
        t=0.0,
    ):
        """The state of displacements, angles and rates.

        Parameters
        ----------
        u, v, theta : float, array_like (n,) or callable
            Axial and transverse displacement [m] and slope of the nodes, or f(x).
        phi1, phi2 : float
            Angles of hub and joint, rad.
        u_rate, v_rate, theta_rate : float, array_like (n,) or callable
            Rates of the nodes in the beam's frame, m/s and rad/s.
        omega, joint_rate : float
            Rates of the angles, rad/s.
        t : float
            Time, for a prescribed rotation.

        Returns
        -------
        ndarray (2 N,)
        """
        places = [self._nodal(*item) for item in (("u", u), ("v", v), ("theta", theta))]
        rates = [
            self._nodal(*item)
            for item in (("u_rate", u_rate), ("v_rate", v_rate), ("theta_rate", theta_rate))
        ]
        given = {"phi1": phi1, "phi2": phi2, "omega": omega, "joint_rate": joint_rate}
        given = {name: float(finite(name, value, ())) for name, value in given.items()}
        absent = {0: ("phi1", "omega", "phi2", "joint_rate"), 1: ("phi2", "joint_rate"), 2: ()}
        for name in absent[self.angles]:
            if given[name] != 0.0:
                why = "the rotation is prescribed" if self.angles == 0 else "the joint is locked"
                raise ValueError(f"{name}: is not in the state, as {why}")
        angles = [given["phi1"], given["phi2"]][: self.angles]
        speeds = [given["omega"], given["joint_rate"]][: self.angles]
        z = np.concatenate(
            [np.stack(places, 1).ravel(), angles, np.stack(rates, 1).ravel(), speeds]
        )
        return self._mapped("momenta", z, float(t))

    def _nodal(self, name, given):
        if callable(given):
            given = [given(float(x)) for x in self.nodes]
        values = finite(name, given)
        if values.shape not in ((), (self.elements,)):
            raise ValueError(
                f"{name}: must be a number or have shape ({self.elements},), got {values.shape}"
            )
        return np.broadcast_to(values, (self.elements,))

    def _mapped(self, what, z, t):
        """A function of the core over states (..., 2 N) and times."""
        z = finite("z", z)
        if not z.ndim or z.shape[-1] != self.size:
            raise ValueError(f"z: must have shape (..., {self.size}), got {z.shape}")
        flat = z.reshape(-1, self.size)
        flat = np.hstack([flat, np.zeros((len(flat), self._core.size - self.size))])
        times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).reshape(-1)
        found = getattr(self._core, what)(np.ascontiguousarray(times), flat)
        if what in ("momenta", "rate"):
            found = found[:, : self.size]
        return found.reshape(z.shape[:-1] + found.shape[1:])

    def energy(self, z, t=0.0):
        """Energy of states, (..., 2 N) -> (...), J; relative to a prescribed rotation."""
        return self._mapped("energies", z, t).sum(axis=-1)

    def _energy_at(self, z, t):
        return self.energy(z, t)

    def kinetic_energy(self, z, t=0.0):
        """Kinetic part of the energy, (..., 2 N) -> (...), J."""
        return self._mapped("energies", z, t)[..., 0]

    def potential_energy(self, z, t=0.0):
        """Energy of deformation, springs and gravity, (..., 2 N) -> (...), J."""
        return self._mapped("energies", z, t)[..., 1]

    def rates(self, z, t=0.0):
        """``[q'; phi']`` of states, (..., 2 N) -> (..., N)."""
        return self._mapped("rates", z, t)

    def rate(self, z, t=0.0):
        """``z'`` of states by the canonical equations (22, 23), (..., 2 N) -> (..., 2 N)."""
        return self._mapped("rate", z, t)

    def matrices(self, q, rates):
        """The matrices of eq. 15 at coordinates and rates: without gravity, loads and damping.

        Parameters
        ----------
        q, rates : array_like (N,)
            Coordinates with the angles, and their rates. Where the rotation is prescribed, both
            end with its angle and speed.

        Returns
        -------
        BeamMatrices
            Of N degrees of freedom, a prescribed angle among them.

        Raises
        ------
        UnsupportedError
            A joint, or ``coupling="third"``: their matrices are not of this form.
        """
        if self.angles == 2 or self.coupling == "third":
            raise _core.UnsupportedError(
                "matrices: the joint must be locked and elasticity linear, as eq. 15 has it"
            )
        n = 3 * self.elements
        q, rates = finite("q", q, (n + 1,)), finite("rates", rates, (n + 1,))
        M, G, K, Q, a, b = self._linear()
        x, speed = q[:n], rates[n]
        m0, m1, J0 = self._moments
        R = self.hub_radius
        inertia = (self.hub_inertia or 0.0) + J0 + 2.0 * R * m1 + R * R * m0
        c, outward = a + G.T @ x, b + Q @ x
        m = inertia + b @ x + x @ outward
        mass = np.block([[M, c[:, None]], [c[None], np.array([[m]])]])
        gyroscopic, stiffness = np.zeros((2, n + 1, n + 1))
        gyroscopic[:n, :n] = 2.0 * speed * G.T
        gyroscopic[n, :n] = 2.0 * speed * outward
        stiffness[:n, :n] = K - speed**2 * Q
        stiffness[n, n] = self.ground_spring
        return BeamMatrices(mass, gyroscopic, stiffness, np.append(speed**2 * b, 0.0))

    def _linear(self):
        """M, G, K, Q, a, b of BEAM's equations."""
        A, R = self._assembled, self.hub_radius
        shortens = 1.0 if self.coupling == "foac" else 0.0
        Q = A["M"] - shortens * (A["D1"] + R * A["D0"])
        # What turns with its section is not flung outward by the turning.
        Q[-1, -1] -= self.tip_inertia
        return A["M"], A["G"], A["K"], Q, A["a_v"] + R * A["s_v"], A["a_u"] + R * A["s_u"]

    @functools.cached_property
    def _assembled(self):
        return fe.matrices(self._arrays, self.length)

    def __repr__(self):
        hub = "prescribed rotation" if self.angles == 0 else f"{self.angles} angles"
        return f"RotatingBeam({self.elements} elements, {self.coupling}, {hub})"


def _made(given):
    return RotatingBeam(**given)


def _number(name, value, positive=False):
    value = float(finite(name, value, ()))
    if value < 0.0 or (positive and value == 0.0):
        raise ValueError(
            f"{name}: must {'be positive' if positive else 'not be negative'}, got {value:g}"
        )
    return value
