"""What a run of a rotating beam gives back."""

import functools

import numpy as np

from spim._solution import Solution
from spim.models import _beam_files as files
from spim.models import _beam_plots as plots


class BeamSolution(Solution):
    """A `Solution` with a beam's quantities by name.

    Attributes
    ----------
    u, v, theta : ndarray (k, n)
        Axial and transverse displacement [m] and slope of the nodes, in the beam's frame.
    tip_u, tip_v : ndarray (k,)
        Of the last node.
    tip_xy : ndarray (k, 2)
        Place of the tip in the plane, m.
    phi1, phi2 : ndarray (k,)
        Angles of hub and joint, rad.
    omega : ndarray (k,)
        Speed of the hub, rad/s.
    p_phi : ndarray (k,) or (k, 2)
        Momenta of the angles, N m s.
    rates : ndarray (k, N)
        ``[q'; phi']``.
    energy, kinetic_energy, potential_energy, work, dissipated : ndarray (k,)
        J. ``energy - work + dissipated`` stays as it was.
    """

    def _shown(self, rows):
        return rows[..., : self.system.size]

    @property
    def _nodal(self):
        n = self.system.elements
        return self.z[:, : 3 * n].reshape(-1, n, 3)

    @property
    def u(self):
        """Axial displacements, (k, n), m."""
        return self._nodal[:, :, 0]

    @property
    def v(self):
        """Transverse displacements, (k, n), m."""
        return self._nodal[:, :, 1]

    @property
    def theta(self):
        """Slopes, (k, n)."""
        return self._nodal[:, :, 2]

    @property
    def tip_u(self):
        """Axial displacement of the tip, (k,), m."""
        return self.u[:, -1]

    @property
    def tip_v(self):
        """Transverse displacement of the tip, (k,), m."""
        return self.v[:, -1]

    def _angle(self, index):
        at = 3 * self.system.elements + index
        return self.z[:, at]

    @property
    def phi1(self):
        """Angle of the hub, (k,), rad; the prescribed one where it is."""
        if self.system.angles == 0:
            return _over(self._rotation.angle, self.t)
        return self._angle(0)

    @property
    def phi2(self):
        """Angle of the joint, (k,), rad; 0 where it is locked."""
        return self._angle(1) if self.system.angles == 2 else np.zeros(len(self.t))

    @property
    def omega(self):
        """Speed of the hub, (k,), rad/s."""
        if self.system.angles == 0:
            return _over(self._rotation.omega, self.t)
        return self.rates[:, 3 * self.system.elements]

    @property
    def _rotation(self):
        native = self.system._native
        return self.system.rotation if isinstance(native, tuple) else native

    @property
    def p_phi(self):
        """Momenta of the angles, (k,), or (k, 2) with a joint, (k, 0) where prescribed; N m s."""
        momenta = self.z[:, self.system.dof + 3 * self.system.elements :]
        return momenta[:, 0] if self.system.angles == 1 else momenta

    @functools.cached_property
    def rates(self):
        """``[q'; phi']``, (k, N)."""
        return self.system.rates(self.z, self.t)

    def frames(self):
        """Places of the root and all nodes in the plane, (k, n + 1, 2), m."""
        beam = self.system
        x = np.concatenate([[0.0], beam.nodes]) + np.pad(self.u, [(0, 0), (1, 0)])
        if beam.coupling == "foac":
            x = x + np.pad(self._shortening(), [(0, 0), (1, 0)])
        y = np.pad(self.v, [(0, 0), (1, 0)])
        phi, angle = self.phi1[:, None], (self.phi1 + self.phi2)[:, None]
        return np.stack(
            [
                beam.hub_radius * np.cos(phi) + x * np.cos(angle) - y * np.sin(angle),
                beam.hub_radius * np.sin(phi) + x * np.sin(angle) + y * np.cos(angle),
            ],
            -1,
        )

    def to_vtk(self, folder, every=1):
        """Write the moving beam for ParaView: lines in the plane, a file a stored state.

        Parameters
        ----------
        folder : str or Path
            Made if need be; gets ``beam.pvd``, which names files and times, and ``beam_0000.vtu``
            and so on. Points are those of `frames`, m, with z = 0; their data u, v [m], theta
            [rad] in the beam's frame, and velocity [m/s] in the plane.
        every : int
            Only each `every`-th stored state is written, and the last one.

        Returns
        -------
        Path
            Of ``beam.pvd``.

        Raises
        ------
        ValueError, TypeError
            `every` that is no whole number above 0.
        ImportError
            meshio is not installed; the extra ``vtk`` brings it.
        OSError
            The folder cannot be written to.
        """
        return files.write_vtk(self, folder, every)

    def _saved_arrays(self):
        if self._only_outputs:
            return super()._saved_arrays()
        return {name: getattr(self, name) for name in files.ARRAYS}

    def _saved_columns(self):
        return super()._saved_columns() if self._only_outputs else files.columns(self)

    def _model_text(self):
        try:
            return self.system.to_toml()
        except ValueError:
            return ""  # a function among its arguments

    def _shortening(self):
        """``-1/2 integral of v'^2`` from the root to each node, (k, n)."""
        l = self.system.length / self.system.elements
        v, theta = (np.pad(x, [(0, 0), (1, 0)]) for x in (self.v, self.theta))
        chord = np.diff(v, axis=1) / l
        a, b = theta[:, :-1] - chord, theta[:, 1:] - chord
        square = chord**2 + (2.0 * (a**2 + b**2) - a * b) / 15.0
        return -0.5 * l * np.cumsum(square, axis=1)

    @property
    def tip_xy(self):
        """Place of the tip in the plane, (k, 2), m."""
        return self.frames()[:, -1]

    @property
    def energy(self):
        """Energy, (k,), J; relative to a prescribed rotation."""
        return self.system.energy(self.z, self.t)

    @property
    def kinetic_energy(self):
        """Kinetic part of the energy, (k,), J."""
        return self.system.kinetic_energy(self.z, self.t)

    @property
    def potential_energy(self):
        """Energy of deformation, springs and gravity, (k,), J."""
        return self.system.potential_energy(self.z, self.t)

    def _account(self, index):
        rows = self._rows
        return (
            rows[:, self.system.size + index]
            if rows.shape[1] > self.system.size
            else np.zeros(len(rows))
        )

    @property
    def work(self):
        """Work of torques, loads and a prescribed rotation since the start, (k,), J."""
        return self._account(0)

    @property
    def dissipated(self):
        """Energy lost to damping since the start, (k,), J."""
        return self._account(1)

    @property
    def balance_error(self):
        """Change of energy + dissipated - work, (k,), J: what the step's error leaves."""
        t, row = self._start
        start = self.system.energy(self._shown(row), t)
        return self.energy - start + self.dissipated - self.work

    def plot_energy(self, ax=None, relative=False):
        """Draw the energy over time, with work and dissipation where there are any.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        relative : bool
            Draw ``H/H0 - 1`` instead.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return plots.plot_energy(self, ax, relative)

    def plot_response(self, ax=None, quantities=("tip_u", "tip_v")):
        """Draw quantities over time.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        quantities : sequence of str
            Names of attributes with one number a time.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return plots.plot_response(self, ax, quantities)

    def animate(self, path, frames=120, fps=25):
        """Write the motion in the plane as a film.

        Parameters
        ----------
        path : str or Path
            Ending in ``.gif`` or ``.html``.
        frames : int
            Pictures at most.
        fps : float
            Pictures a second.

        Returns
        -------
        Path
        """
        return plots.animate(self, path, frames, fps)


def _over(function, t):
    """A function of time at all times."""
    return np.array([float(function(float(x))) for x in t])
