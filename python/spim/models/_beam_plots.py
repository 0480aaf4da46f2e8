"""Drawings of beams and their runs; Matplotlib is imported on use."""

from pathlib import Path

import numpy as np

UNITS = {
    "tip_u": "m",
    "tip_v": "m",
    "phi1": "rad",
    "phi2": "rad",
    "omega": "rad/s",
    "p_phi": "N m s",
    "energy": "J",
    "kinetic_energy": "J",
    "potential_energy": "J",
    "work": "J",
    "dissipated": "J",
    "balance_error": "J",
}


def axes(ax=None):
    """Axes to draw on: those given, or new ones."""
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ModuleNotFoundError:
        raise ImportError(
            'drawing needs Matplotlib, which is not installed: pip install "spim[plot]"'
        ) from None
    return pyplot.subplots(layout="constrained")[1]


def sketch(beam, ax=None, what="model"):
    """Draw a beam on its hub: the paper's Figs. 1 to 3."""
    if what not in ("model", "elements"):
        raise ValueError(f'what: must be "model" or "elements", got {what!r}')
    ax = axes(ax)
    L, R = beam.length, max(beam.hub_radius, 0.04 * beam.length)
    if what == "elements":
        _draw_elements(beam, ax)
        return ax
    angle = 0.35
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x = np.linspace(0.0, 1.0, 101)
    bent = turn @ np.array([R + L * x, 0.16 * L * x**2])
    straight = turn @ np.array([R + L * x, np.zeros_like(x)])
    circle = np.linspace(0.0, 2.0 * np.pi, 100)
    ax.plot(R * np.cos(circle), R * np.sin(circle), "k-", lw=1.2)
    ax.plot(*straight, "--", color="0.6", lw=1.0)
    ax.plot(*bent, color="#0072B2", lw=2.5)
    for end, words in (((1.15 * L, 0.0), "$X_0$"), ((0.0, 0.6 * L), "$Y_0$")):
        ax.annotate("", end, (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": "0.3"})
        ax.annotate(words, end, color="0.3", xytext=(4, 4), textcoords="offset points")
    if beam.tip_mass > 0.0:
        ax.plot(*bent[:, -1], "o", color="#D55E00", ms=9)
        ax.annotate(r"$m_t$", bent[:, -1], xytext=(8, -4), textcoords="offset points")
    arc = np.linspace(0.0, angle, 30)
    ax.plot(0.3 * L * np.cos(arc), 0.3 * L * np.sin(arc), "k-", lw=0.8)
    prescribed = beam.angles == 0
    ax.annotate(
        r"$\theta(t)$" if prescribed else r"$\varphi_1$",
        (0.31 * L * np.cos(0.5 * angle), 0.31 * L * np.sin(0.5 * angle)),
    )
    notes = [f"$R$ = {beam.hub_radius:g} m, $L$ = {beam.length:g} m"]
    if not prescribed:
        notes.append(f"$J_A$ = {beam.hub_inertia:g} kg m$^2$, $k_1$ = {beam.ground_spring:g} N m")
        joint = "locked" if beam.angles == 1 else f"$k_2$ = {beam.joint_spring:g} N m"
        notes.append(f"joint: {joint}")
    ax.text(0.02, 0.98, "\n".join(notes), va="top", fontsize=9, transform=ax.transAxes)
    middle = len(x) // 2
    ax.annotate("$u$, $v$", bent[:, middle], xytext=(-10, 8), textcoords="offset points")
    ax.set(xlim=(-0.15 * L, 1.3 * L), ylim=(-0.15 * L, 0.75 * L))
    ax.set_aspect("equal")
    ax.set_axis_off()
    return ax


def _draw_elements(beam, ax):
    """Elements, nodes and the taper of the section, to scale along the beam."""
    L = beam.length
    places = np.concatenate([[0.0], beam.nodes])
    mass = beam.section.mass(np.linspace(0.0, L, 101), L)
    half = 0.06 * L * mass / mass.max()
    x = np.linspace(0.0, L, 101)
    ax.fill_between(x, -half, half, color="#0072B2", alpha=0.25, lw=0)
    ax.plot(places, np.zeros_like(places), "ko-", lw=1.0, ms=4)
    for k, place in enumerate(places if len(places) <= 12 else places[[0, -1]]):
        number = k if len(places) <= 12 else int(round(place / L * beam.elements))
        ax.annotate(str(number), (place, 0.0), xytext=(0, 6), textcoords="offset points")
    ax.plot([0.0, 0.0], [-0.1 * L, 0.1 * L], "k-", lw=3)
    ax.set(xlabel="x [m]", yticks=[], ylim=(-0.2 * L, 0.2 * L))
    ax.set_title(f"{beam.elements} elements; width: mass a length", fontsize=9)
    ax.spines[["top", "right", "left"]].set_visible(False)


def plot_energy(solution, ax=None, relative=False):
    """Draw the energy over time, or its relative error."""
    ax = axes(ax)
    energy = solution.energy
    if relative:
        ax.plot(solution.t, energy / energy[0] - 1.0, lw=0.8)
        ax.set(xlabel="t [s]", ylabel="$H/H_0 - 1$")
    else:
        ax.plot(solution.t, energy, lw=0.8, label="energy")
        if solution.work.any() or solution.dissipated.any():
            ax.plot(solution.t, solution.work, lw=0.8, label="work")
            ax.plot(solution.t, solution.dissipated, lw=0.8, label="dissipated")
            ax.legend(frameon=False)
        ax.set(xlabel="t [s]", ylabel="energy [J]")
    return ax


def plot_response(solution, ax=None, quantities=("tip_u", "tip_v")):
    """Draw quantities of a run over time."""
    ax = axes(ax)
    if isinstance(quantities, str):
        quantities = (quantities,)
    for name in quantities:
        values = np.asarray(getattr(solution, name))
        if values.ndim != 1 or len(values) != len(solution.t):
            raise ValueError(f"quantities: {name!r} is not one number a time")
        ax.plot(
            solution.t, values, lw=0.8, label=f"{name} [{UNITS[name]}]" if name in UNITS else name
        )
    ax.set(xlabel="t [s]")
    ax.legend(frameon=False)
    return ax


def animate(solution, path, frames=120, fps=25):
    """Write the motion in the plane as GIF or HTML."""
    path = Path(path)
    if path.suffix not in (".gif", ".html"):
        raise ValueError(f'path: must end in ".gif" or ".html", got {str(path)!r}')
    for name, value in (("frames", frames), ("fps", fps)):
        if not value > 0:
            raise ValueError(f"{name}: must be positive, got {value}")
    ax = axes()
    from matplotlib import animation, pyplot

    figure = ax.figure
    try:
        rows = np.unique(np.linspace(0, len(solution.t) - 1, frames).astype(int))
        places = solution.frames()[rows]
        reach = 1.05 * np.abs(places).max()
        (line,) = ax.plot([], [], "o-", color="#0072B2", ms=3)
        (trace,) = ax.plot([], [], color="#D55E00", lw=0.6)
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x [m]", ylabel="y [m]")
        ax.set_aspect("equal")

        def draw(k):
            line.set_data(*places[k].T)
            trace.set_data(*places[: k + 1, -1].T)
            ax.set_title(f"t = {solution.t[rows[k]]:.3f} s")
            return line, trace

        film = animation.FuncAnimation(figure, draw, len(rows), interval=1000.0 / fps)
        if path.suffix == ".gif":
            film.save(path, writer=animation.PillowWriter(fps=fps))
        else:
            path.write_text(film.to_jshtml(fps=fps), encoding="utf-8")
    finally:
        pyplot.close(figure)
    return path
