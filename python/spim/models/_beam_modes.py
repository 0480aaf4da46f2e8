"""Modes of a rotating beam: at rest, spinning, and over a range of speeds."""

from dataclasses import dataclass, field

import numpy as np

from spim._arrays import finite, mode_shapes
from spim.models import _beam_plots as plots
from spim.models import _finite_elements as fe

UNITS = {"rad/s": 1.0, "Hz": 2.0 * np.pi, "rpm": 2.0 * np.pi / 60.0}


@dataclass(frozen=True)
class BeamModes:
    """Modes of small vibrations.

    Attributes
    ----------
    frequencies : ndarray (k,)
        rad/s, ascending; 0 for rigid modes.
    shapes : ndarray (N, k)
        Columns; complex for a spinning beam, whose modes are not in phase.
    labels : list of str
        "axial", "lag" (in the plane of rotation), "flap" (across it) or "rigid", numbered.
    """

    frequencies: np.ndarray
    shapes: np.ndarray
    labels: list = field(repr=False)


@dataclass(frozen=True)
class SteadyState:
    """Equilibrium of a beam at constant speed, in its own frame.

    Attributes
    ----------
    u, v, theta : ndarray (n,)
        Axial and transverse displacement [m] and slope of the nodes.
    speed : float
        rad/s.
    """

    u: np.ndarray
    v: np.ndarray
    theta: np.ndarray
    speed: float


@dataclass(frozen=True)
class Campbell:
    """Frequencies over speeds, each mode followed by the likeness of its shapes.

    Attributes
    ----------
    speeds : ndarray (s,)
        rad/s.
    frequencies : ndarray (s, k)
        rad/s, a column a mode.
    labels : list of str
    unit : str
        Of the plot.
    """

    speeds: np.ndarray
    frequencies: np.ndarray
    labels: list
    unit: str

    def plot(self, ax=None, orders=(1, 2, 3, 4)):
        """Draw frequencies over speed, with lines of engine orders.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        orders : sequence of int
            Multiples of the speed to draw.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = plots.axes(ax)
        unit = UNITS[self.unit]
        along = self.speeds / unit
        for column, label in zip(self.frequencies.T, self.labels, strict=True):
            dashed = label.startswith("flap")
            ax.plot(along, column / unit, ls="--" if dashed else "-", label=label)
        top = 1.05 * self.frequencies.max() / unit
        for order in orders:
            ax.plot(along, order * along, color="0.8", lw=0.8, zorder=0)
            end = min(along[-1], top / order)
            if end > 0.0:
                ax.annotate(f"{order}P", (end, order * end), color="0.5", fontsize=8)
        ax.set(xlabel=f"speed, {self.unit}", ylabel=f"frequency, {self.unit}", ylim=(0.0, top))
        ax.legend(frameon=False)
        return ax


class BeamAnalysis:
    """What a `RotatingBeam` tells without being integrated."""

    def sketch(self, ax=None, what="model"):
        """Draw the model as the paper's Figs. 1 to 3 do.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        what : {"model", "elements"}
            Hub, beam and tip mass in the plane, or the elements with the taper.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return plots.sketch(self, ax, what)

    def modal(self, hub="free"):
        """Modes of the whole system about its static equilibrium under gravity.

        Torques, loads, damping and a prescribed rotation are left out; `spinning_modes` has
        rotation.

        Parameters
        ----------
        hub : {"free", "clamped"}
            "free": hub and beam, rigid mode included, of N degrees of freedom. "clamped": of the
            beam alone.

        Returns
        -------
        BeamModes

        Raises
        ------
        ValueError
            No equilibrium is found, or it is unstable; a free hub without inertia.
        """
        if hub not in ("free", "clamped"):
            raise ValueError(f'hub: must be "free" or "clamped", got {hub!r}')
        if hub == "clamped" or self.angles == 0:
            M, _, K, _, _, _ = self._linear()
            if self.gravity != (0.0, 0.0):
                beam = self._without_loads(rotation=lambda t: 0.0)
                K = beam._tangent(beam._equilibrium())
        else:
            beam = self._without_loads()
            y = beam._equilibrium()
            M, K = beam._mass(y), beam._tangent(y)
        squares, shapes = mode_shapes(0.5 * (M + M.T), 0.5 * (K + K.T))
        small = 1e-9 * squares.max() / len(squares) ** 2 * np.finfo(float).eps ** 0.5
        squares = np.where(np.abs(squares) <= small, 0.0, squares)
        if (squares < 0.0).any():
            raise ValueError(
                "modal: the equilibrium is unstable; gravity or a spring pushes it away"
            )
        return BeamModes(np.sqrt(squares), shapes, self._labels(squares, shapes))

    def steady_state(self, speed):
        """Equilibrium in the beam's frame at a constant speed of the hub.

        Without gravity and loads: ``(K - speed^2 Q) q = speed^2 b``, for ``coupling="third"`` by
        Newton's method.

        Parameters
        ----------
        speed : float
            rad/s.

        Returns
        -------
        SteadyState

        Raises
        ------
        ValueError
            No equilibrium is found: the beam spins too fast for its coupling.
        """
        speed = float(finite("speed", speed, ()))
        u, v, theta = self._spun(speed).reshape(-1, 3).T
        return SteadyState(u, v, theta, speed)

    def spinning_modes(self, speed, plane="chord"):
        """Modes of small vibrations about the steady state at a speed.

        ``M q'' + 2 speed G^T q' + (K - speed^2 Q) q = 0`` in the plane of rotation, Coriolis forces
        and the coupling of axial and transverse motion included; ``M q'' + (K + speed^2 (D1 +
        radius D0)) q = 0`` across it.

        Parameters
        ----------
        speed : float
            rad/s.
        plane : {"chord", "flap"}

        Returns
        -------
        BeamModes
            Of 3 n degrees of freedom, (u, v, theta) by nodes; of 2 n, (w, slope), for "flap".

        Raises
        ------
        ValueError
            The beam is unstable at this speed.
        """
        speed = float(finite("speed", speed, ()))
        if plane == "flap":
            return self._flap(speed)
        if plane != "chord":
            raise ValueError(f'plane: must be "chord" or "flap", got {plane!r}')
        M, G, K, Q, _, _ = self._linear()
        if self.coupling == "third":
            stiffness = self._tangent_spun(self._spun(speed), speed)
        else:
            stiffness = K - speed**2 * Q
        # With the momenta of the frame, p = M (q' + speed M^-1 G^T q), the problem is Hamiltonian;
        # as one of a Hermitian matrix its frequencies are real to the last bit.
        try:
            frequencies, shapes = _gyroscopic_modes(M, 2.0 * speed * G.T, stiffness)
        except np.linalg.LinAlgError:
            raise ValueError(
                f"spinning_modes: the beam is unstable at {speed:g} rad/s with coupling "
                f'"{self.coupling}"'
            ) from None
        return BeamModes(frequencies, shapes, self._labels(frequencies**2, shapes))

    def campbell(self, speeds, unit="rad/s", planes=("flap", "chord"), count=4):
        """Frequencies over a range of speeds.

        Parameters
        ----------
        speeds : array_like (s,)
            In `unit`, ascending; neighbours near enough for shapes to be alike.
        unit : {"rad/s", "Hz", "rpm"}
        planes : sequence of {"flap", "chord"}
        count : int
            Modes of each plane.

        Returns
        -------
        Campbell
            Frequencies are followed from speed to speed by the modal assurance criterion, so that
            lines cross where modes do.
        """
        if unit not in UNITS:
            raise ValueError(f"unit: must be one of {', '.join(map(repr, UNITS))}, got {unit!r}")
        speeds = np.atleast_1d(finite("speeds", speeds)) * UNITS[unit]
        if speeds.ndim != 1 or not speeds.size or (np.diff(speeds) <= 0.0).any():
            raise ValueError(f"speeds: must ascend, shape (s,), got shape {speeds.shape}")
        planes = (planes,) if isinstance(planes, str) else planes
        columns, labels = [], []
        for plane in planes:
            followed, last = [], None
            for speed in speeds:
                modes = self.spinning_modes(float(speed), plane)
                if last is None:
                    order = np.arange(min(count, len(modes.frequencies)))
                    labels += [modes.labels[k] for k in order]
                else:
                    order = _likest(last, modes.shapes)
                last = modes.shapes[:, order]
                followed.append(modes.frequencies[order])
            columns.append(np.array(followed))
        return Campbell(speeds, np.hstack(columns), labels, unit)

    # Parts

    def _flap(self, speed):
        A = fe.matrices(
            self._arrays, self.length, flap=self.section.flap(self._points, self.length)
        )
        bending = np.arange(3 * self.elements) % 3 != 0
        here = np.ix_(bending, bending)
        K = A["K"][here] + speed**2 * (A["D1"] + self.hub_radius * A["D0"])[here]
        squares, shapes = mode_shapes(A["M"][here], K)
        labels = [f"flap {k + 1}" for k in range(len(squares))]
        return BeamModes(np.sqrt(squares), shapes, labels)

    @property
    def _points(self):
        l = self.length / self.elements
        return l * (np.arange(self.elements)[:, None] + fe.rule()[0])

    def _labels(self, squares, shapes):
        """By the kinetic energy of axial and transverse motion."""
        M, count = self._assembled["M"], 3 * self.elements
        axial = np.arange(count) % 3 == 0
        names, seen = [], {}
        for square, shape in zip(squares, shapes.T, strict=True):
            x = np.abs(shape[:count])
            parts = [x[rows] @ np.abs(M[np.ix_(rows, rows)]) @ x[rows] for rows in (axial, ~axial)]
            kind = "rigid" if square == 0.0 else ("axial" if parts[0] > parts[1] else "lag")
            seen[kind] = seen.get(kind, 0) + 1
            names.append(f"{kind} {seen[kind]}")
        return names

    def _forces(self, y):
        """Generalised forces at rest."""
        z = self._mapped("momenta", np.concatenate([y, np.zeros(self.dof)]), 0.0)
        return self._mapped("rate", z, 0.0)[self.dof :]

    def _mass(self, y):
        """M(y), (N, N): momenta of unit rates."""
        N = self.dof
        states = np.hstack([np.broadcast_to(y, (N, N)), np.eye(N)])
        return self._mapped("momenta", states, 0.0)[:, N:]

    def _tangent(self, y):
        """``-dF/dy`` by central differences, exact but for rounding where forces are cubic."""
        N, found = len(y), []
        for k in range(N):
            # Slopes and angles bend more than displacements of the same size.
            d = np.zeros(N)
            d[k] = 1e-4 * self.length if k % 3 < 2 and k < 3 * self.elements else 1e-4
            near = self._forces(y - d) - self._forces(y + d)
            far = self._forces(y - 2.0 * d) - self._forces(y + 2.0 * d)
            found.append((8.0 * near - far) / (12.0 * d[k]))
        return np.array(found).T

    def _without_loads(self, rotation=None):
        """The same beam under gravity and springs alone; clamped where a rotation is given."""
        left_out = ("hub_torque", "joint_torque", "tip_force", "distributed_force", "damping")
        given = {name: value for name, value in self._given.items() if name not in left_out}
        if rotation is not None:
            clamped = ("hub_inertia", "ground_spring", "joint_spring")
            given = {name: value for name, value in given.items() if name not in clamped}
            given["rotation"] = rotation
        return type(self)(**given)

    def _equilibrium(self):
        """Coordinates at which nothing accelerates, by Newton's method from rest."""
        y = np.zeros(self.dof)
        if self.gravity == (0.0, 0.0):
            return y
        for _ in range(50):
            change = np.linalg.lstsq(self._tangent(y), self._forces(y), rcond=1e-13)[0]
            y += change
            if np.abs(change).max() <= 1e-12 * max(self.length, np.abs(y).max()):
                return y
        raise ValueError("modal: no static equilibrium found under this gravity")

    def _spun(self, speed):
        """Displacements at a constant speed, (3 n,)."""
        _, _, K, Q, _, b = self._linear()
        if self.coupling != "third":
            try:
                np.linalg.cholesky(K - speed**2 * Q)
            except np.linalg.LinAlgError:
                raise ValueError(
                    f'steady_state: "{self.coupling}" has none at {speed:g} rad/s; the beam spins '
                    "too fast for its coupling"
                ) from None
        # For third-order coupling this is stretched, not bent: where Newton's method starts.
        q = np.linalg.solve(K - speed**2 * Q, speed**2 * b)
        if self.coupling != "third":
            return q
        for _ in range(50):
            force = self._force_spun(q, speed)
            change = np.linalg.solve(self._tangent_spun(q, speed), force)
            q = q + change
            if np.abs(change).max() <= 1e-14 * self.length:
                return q
        raise ValueError(f"steady_state: no equilibrium found at {speed:g} rad/s")

    @property
    def _still(self):
        """The same beam with its elastic forces alone: clamped, without gravity, loads, damping."""
        if "_clamped" not in self.__dict__:
            given = {
                name: self._given[name]
                for name in ("length", "section", "elements", "tip_mass", "tip_inertia", "coupling")
            }
            self._clamped = type(self)(**given, rotation=lambda t: 0.0)
        return self._clamped

    def _force_spun(self, q, speed):
        _, _, _, Q, _, b = self._linear()
        return self._still._forces(q) + speed**2 * (b + Q @ q)

    def _tangent_spun(self, q, speed):
        _, _, _, Q, _, _ = self._linear()
        K = self._still._tangent(q)
        return 0.5 * (K + K.T) - speed**2 * Q


def _gyroscopic_modes(M, C, K):
    """Frequencies and shapes of ``M q'' + C q' + K q = 0``, C skew, K positive definite.

    With ``q = L^-T x`` and ``K = R R^T`` in these coordinates, ``i [[0, R^T], [-R, -C]]`` of
    ``(R^T x, x')`` is Hermitian.
    """
    L = np.linalg.cholesky(M)
    inverse = np.linalg.inv(L)
    turned, stiffness = inverse @ C @ inverse.T, inverse @ K @ inverse.T
    R = np.linalg.cholesky(0.5 * (stiffness + stiffness.T))
    n = len(M)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:], A[n:, :n], A[n:, n:] = R.T, -R, -0.5 * (turned - turned.T)
    values, vectors = np.linalg.eigh(1j * A)
    positive = values > 0.0
    frequencies, rates = values[positive], vectors[n:, positive]
    return frequencies, inverse.T @ rates / frequencies


def _likest(last, shapes):
    """For each of the last modes the one whose shape is likest, none taken twice."""
    likeness = np.abs(last.conj().T @ shapes) ** 2
    likeness /= np.sum(np.abs(last) ** 2, 0)[:, None] * np.sum(np.abs(shapes) ** 2, 0)
    order = np.empty(last.shape[1], int)
    for _ in range(last.shape[1]):
        i, j = np.unravel_index(np.argmax(likeness), likeness.shape)
        order[i] = j
        likeness[i, :] = likeness[:, j] = -1.0
    return order
