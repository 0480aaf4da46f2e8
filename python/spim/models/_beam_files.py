"""What a run of a rotating beam writes: arrays, columns, and lines for ParaView."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

ARRAYS = ("t z u v theta tip_u tip_v tip_xy phi1 phi2 omega rates energy work dissipated").split()


def require_meshio():
    """meshio, or an ImportError that says how to get it."""
    try:
        import meshio
    except ModuleNotFoundError:
        raise ImportError(
            'VTK files need meshio, which is not installed: pip install "spim[vtk]"'
        ) from None
    return meshio


def columns(solution):
    """Columns (k,) by their headings: names as `RotatingBeam.state` has them, and units."""
    n = solution.system.elements
    found = {"t [s]": solution.t}
    nodal = solution.rates[:, : 3 * n].reshape(-1, n, 3)
    for i in range(n):
        found |= {
            f"u{i + 1} [m]": solution.u[:, i],
            f"v{i + 1} [m]": solution.v[:, i],
            f"theta{i + 1} [rad]": solution.theta[:, i],
        }
    found |= {"phi1 [rad]": solution.phi1, "phi2 [rad]": solution.phi2}
    for i in range(n):
        found |= {
            f"u{i + 1}_rate [m/s]": nodal[:, i, 0],
            f"v{i + 1}_rate [m/s]": nodal[:, i, 1],
            f"theta{i + 1}_rate [rad/s]": nodal[:, i, 2],
        }
    return found | {
        "omega [rad/s]": solution.omega,
        "joint_rate [rad/s]": _joint_rate(solution),
        "tip_x [m]": solution.tip_xy[:, 0],
        "tip_y [m]": solution.tip_xy[:, 1],
        "energy [J]": solution.energy,
        "work [J]": solution.work,
        "dissipated [J]": solution.dissipated,
    }


def write_vtk(solution, folder, every):
    """Write files and their collection; see `BeamSolution.to_vtk`."""
    if isinstance(every, bool) or not isinstance(every, int | np.integer):
        raise TypeError(f"every: must be a whole number, got {every!r}")
    if every < 1:
        raise ValueError(f"every: must be 1 or more, got {every}")
    meshio = require_meshio()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    last = len(solution.t) - 1
    rows = [k for k in range(last + 1) if k % every == 0 or k == last]
    flat = [(0, 0), (0, 0), (0, 1)]
    points, speeds = (np.pad(x, flat) for x in (solution.frames(), velocities(solution)))
    data = {name: _rooted(getattr(solution, name)) for name in ("u", "v", "theta")}
    data["velocity"] = speeds
    nodes = np.arange(solution.system.elements)
    lines = [("line", np.stack([nodes, nodes + 1], 1))]
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    digits = max(4, len(str(len(rows) - 1)))
    for place, k in enumerate(rows):
        name = f"beam_{place:0{digits}}.vtu"
        there = {quantity: values[k] for quantity, values in data.items()}
        meshio.Mesh(points[k], lines, point_data=there).write(folder / name)
        ElementTree.SubElement(
            collection, "DataSet", timestep=repr(float(solution.t[k])), part="0", file=name
        )
    ElementTree.indent(root)
    path = folder / "beam.pvd"
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path


def velocities(solution):
    """Velocities of the root and all nodes in the plane, (k, n + 1, 2), m/s: rates of `frames`."""
    beam = solution.system
    n = beam.elements
    rates = solution.rates[:, : 3 * n].reshape(-1, n, 3)
    along, across, turning = (_rooted(rates[:, :, i]) for i in range(3))
    if beam.coupling == "foac":
        along = along + _rooted(_shortening_rate(solution, across, turning))
    phi, angle = solution.phi1[:, None], (solution.phi1 + solution.phi2)[:, None]
    hub = solution.omega[:, None]
    spin = hub + _joint_rate(solution)[:, None]
    # Places of the nodes from the root, in the plane.
    root = beam.hub_radius * np.stack([np.cos(phi), np.sin(phi)], -1)
    x, y = np.moveaxis(solution.frames() - root, -1, 0)
    return np.stack(
        [
            -beam.hub_radius * hub * np.sin(phi)
            + (along * np.cos(angle) - across * np.sin(angle) - spin * y),
            beam.hub_radius * hub * np.cos(phi)
            + (along * np.sin(angle) + across * np.cos(angle) + spin * x),
        ],
        -1,
    )


def _shortening_rate(solution, across, turning):
    """``- integral of v' dv'/dt`` from the root to each node, (k, n)."""
    l = solution.system.length / solution.system.elements
    chord, chord_rate = np.diff(_rooted(solution.v)) / l, np.diff(across) / l
    theta = _rooted(solution.theta)
    a, b = theta[:, :-1] - chord, theta[:, 1:] - chord
    a_rate, b_rate = turning[:, :-1] - chord_rate, turning[:, 1:] - chord_rate
    bent = (4.0 * (a * a_rate + b * b_rate) - a * b_rate - a_rate * b) / 15.0
    return -0.5 * l * np.cumsum(2.0 * chord * chord_rate + bent, axis=1)


def _joint_rate(solution):
    """Speed of the joint, (k,), rad/s; 0 where it is locked."""
    if solution.system.angles < 2:
        return np.zeros(len(solution.t))
    return solution.rates[:, 3 * solution.system.elements + 1]


def _rooted(values):
    """Values of the nodes (k, n) with those of the clamped root, 0, in front: (k, n + 1)."""
    return np.pad(values, [(0, 0), (1, 0)])
