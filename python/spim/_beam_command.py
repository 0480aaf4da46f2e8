"""The command ``spim beam``: a run of a rotating beam, described by a file."""

import sys
import time
import warnings
from pathlib import Path

import numpy as np

import spim
from spim.models import RotatingBeam, _toml
from spim.models._beam_files import require_meshio
from spim.models._toml import FLAG, NUMBER, NUMBER_OR_NUMBERS, PAIR, TEXT, TEXTS, WHOLE, Key
from spim.studies import MissingPlotError, require_matplotlib

NODAL = Key(NUMBER_OR_NUMBERS, "m; of the nodes")
START = {
    "u": NODAL,
    "v": NODAL,
    "theta": Key(NUMBER_OR_NUMBERS, "rad; of the nodes"),
    "u_rate": Key(NUMBER_OR_NUMBERS, "m/s; of the nodes"),
    "v_rate": Key(NUMBER_OR_NUMBERS, "m/s; of the nodes"),
    "theta_rate": Key(NUMBER_OR_NUMBERS, "rad/s; of the nodes"),
    "phi1": Key(NUMBER, "rad"),
    "phi2": Key(NUMBER, "rad"),
    "omega": Key(NUMBER, "rad/s"),
    "joint_rate": Key(NUMBER, "rad/s"),
}
RUN = START | {
    "t_span": Key(PAIR, "s: start and end", True),
    "step": Key(NUMBER, "s", True),
    "method": Key(TEXT, "srk2 if left out"),
    "every": Key(WHOLE, "only each so many steps a state is stored"),
}
OUTPUT = {
    "formats": Key(TEXTS, "csv, npz, vtk; csv and npz if left out"),
    "figures": Key(FLAG, "true if left out"),
}
FORMATS = ("csv", "npz", "vtk")


def add(commands):
    """Add the command to those of the parser."""
    beam = commands.add_parser(
        "beam",
        help="run a rotating beam that a TOML file describes: data and figures",
        description="Run a rotating beam. CONFIG has the tables [beam], [section] and, where it is "
        "prescribed, [rotation], as RotatingBeam.to_toml writes them; [run] with "
        f"{', '.join(RUN)}; and [output] with formats ({', '.join(FORMATS)}) and figures.",
    )
    beam.add_argument("config", metavar="CONFIG", type=Path, help="such as rotating_beam.toml")
    beam.add_argument(
        "--output", metavar="DIR", type=Path, default=Path("out/beam"), help="default: %(default)s"
    )
    beam.set_defaults(run=run, parser=beam)


def run(chosen):
    """Run the command."""
    fail = chosen.parser.error
    try:
        beam, run, output = described(chosen.config)
        z0 = beam.state(**{k: v for k, v in run.items() if k in START}, t=run["t_span"][0])
        if "vtk" in output["formats"]:
            require_meshio()
    except OSError as error:
        fail(f"cannot read {chosen.config}: {error.strerror or error}")
    except (ValueError, TypeError, ImportError, spim.SpimError) as error:
        fail(f"{chosen.config}: {error}")
    try:
        chosen.output.mkdir(parents=True, exist_ok=True)
        began = time.perf_counter()
        solution = _stepped(chosen, beam, z0, run)
        seconds = time.perf_counter() - began
        told = [*_files(solution, chosen.output, output), "", summary(solution, seconds)]
    except OSError as error:
        where = error.filename or chosen.output
        fail(f"cannot write to {where}: {error.strerror or error}")
    except spim.ModelError as error:
        # States of a beam that its coupling does not describe any more.
        _end(chosen, f"the run has states without an energy, nothing more is written: {error}")
    print(*told, sep="\n")
    if not solution.success:
        _end(chosen, f"the run ended early: {solution.message}")


def _end(chosen, message):
    """Says what a run has come to; exit code 1."""
    sys.stdout.flush()
    chosen.parser.exit(1, f"{chosen.parser.prog}: {message}\n")


def described(path):
    """Beam, run and output of a file, what was left out filled in.

    Raises
    ------
    ValueError
        Names table and key.
    OSError
        The file cannot be read.
    """
    tables = _toml.read(Path(path))
    beam = RotatingBeam(**_toml.arguments(tables))
    run = {"method": "srk2", "every": 1} | _toml.checked(tables, "run", RUN)
    output = {"formats": ["csv", "npz"], "figures": True}
    output |= _toml.checked(tables, "output", OUTPUT)
    for name in output["formats"]:
        _toml.one_of("[output] formats", name, FORMATS)
    return beam, run, output


def _stepped(chosen, beam, z0, run):
    """The solution, as far as it came; warnings in one line each."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            solution = spim.integrate(
                beam,
                z0,
                run["t_span"],
                run["step"],
                method=run["method"],
                every=run["every"],
                progress=sys.stderr.isatty(),
                throw=False,
            )
        except (ValueError, TypeError, OverflowError, MemoryError, spim.SpimError) as error:
            chosen.parser.error(f"{chosen.config}: [run] {error}")
    for warning in said:
        print(f"{chosen.parser.prog}: {warning.message}", file=sys.stderr)
    return solution


def _files(solution, folder, output):
    """Write files; yields their paths, and what there is to say of those left out."""
    for suffix in ("csv", "npz"):
        if suffix in output["formats"]:
            path = folder / f"beam.{suffix}"
            solution.save(path)
            yield path
    if "vtk" in output["formats"]:
        yield solution.to_vtk(folder / "vtk")
    if not output["figures"]:
        return
    try:
        require_matplotlib()
    except MissingPlotError as error:
        yield f"no figures: {error}"
        return
    drawing = drawn(solution)
    for suffix, metadata in {"svg": {"Date": None}, "png": {}}.items():
        path = folder / f"beam.{suffix}"
        drawing.savefig(path, dpi=150, metadata={"Title": "Rotating beam", **metadata})
        yield path


def summary(solution, seconds):
    """A run in a few lines."""
    steps, t, v = solution.stats["steps"], solution.t, solution.tip_v
    energy, off = solution.energy, np.abs(solution.balance_error).max()
    flows = np.abs([solution.work, solution.dissipated])
    what = "balance error" if flows.any() else "energy drift"
    scale = max(np.abs(energy).max(), flows.max())
    part = f", {off / scale:.4g} of the largest energy" if scale > 0.0 else ""
    least, most = int(np.argmin(v)), int(np.argmax(v))
    return "\n".join(
        [
            f"method  {solution.method}",
            f"steps   {steps} of {solution.step:g} s, t = {t[0]:g} .. {t[-1]:g} s, "
            f"in {seconds:.3g} s",
            f"energy  {energy[0]:.6g} J, then {energy[-1]:.6g} J; {what} at most {off:.4g} J{part}",
            f"tip     v from {v[least]:.6g} m at {t[least]:g} s to {v[most]:.6g} m at "
            f"{t[most]:g} s, of the stored states",
        ]
    )


def drawn(solution):
    """Tip displacement, energy and its balance over time, as a Matplotlib figure."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from spim.studies._drawing import BLUE, GREEN, PALE, VERMILION

    figure = Figure(figsize=(8, 7), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(3, sharex=True)
    tip, energy, balance = panels
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color=PALE, linewidth=0.6)
        axes.set_axisbelow(True)
    curves = {
        "tip displacement v [m]": (tip, solution.tip_v, BLUE),
        "energy [J]": (energy, solution.energy, VERMILION),
        "energy + dissipated - work,\nchange [J]": (balance, solution.balance_error, GREEN),
    }
    for label, (axes, values, color) in curves.items():
        axes.plot(solution.t, values, color=color, linewidth=1.1)
        axes.set_ylabel(label)
    # Drift belongs to the last panel; this one shows the size of the energy.
    size, range_ = np.abs(solution.energy).max(), np.ptp(solution.energy)
    if range_ < 1e-2 * size:
        energy.set_ylim(*(solution.energy.mean() + 0.01 * size * np.array([-1.0, 1.0])))
    panels[-1].set_xlabel("time [s]")
    return figure
