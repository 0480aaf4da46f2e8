"""Study 6.3 of the paper: a compound pendulum, for nonlinear systems. Figs. 16-18.

Huang, Deng, Yao, J. Sound Vib. 299 (2007) 229-246; its numbers beside ours. Its curves are not
available as data and none is drawn. The report's words are in ``pendulum.md``.
"""

import time
from importlib.resources import files
from string import Template

import numpy as np

import spim
from spim.studies._drawing import BLACK, BLUE, VERMILION
from spim.studies._figures import Comparison, Curve, Growth, Panel, PaperFigure
from spim.studies._output import markdown_table, number, text_table
from spim.studies.oscillators import environment

Z0 = (0.1, np.pi / 6.0, 0.0, 0.0)  # m, rad, kg m/s, kg m^2/s
STEP, RK4_STEP = 0.01, 1e-4  # s, the paper's
END, ERROR_END = 10.0, 2.0  # s
LONG, QUICK = 1000.0, 100.0  # s
# The end state at 10 s, by a Taylor integrator at a tolerance of 1e-18.
REFERENCE = (-0.04365873, 0.01829039, -0.28367353, 0.82888834)
# Errors at 2 s, largest of the four components, of a calculation of ours with another code.
EXPECTED = {
    "spim_explicit": 2.7e-5,
    "spim_pc": 1.7e-5,
    "lawson_gauss2": 1.8e-5,
    "lawson_gauss4": 2.9e-8,
    "lawson_gauss6": 2.9e-11,
    "gauss4": 2.6e-4,
    "gauss6": 1.8e-7,
    "rk4": 1.7e-3,
}
METHODS = (
    "spim_explicit",
    "spim_pc",
    "spim_implicit",
    "lawson_gauss2",
    "lawson_gauss4",
    "lawson_gauss6",
    "lawson_gauss8",
    "lawson_gauss12",
    "lawson_gauss16",
    "eavf",
    "srk2",
    "midpoint",
    "gauss4",
    "gauss6",
    "gauss8",
    "gauss12",
    "gauss16",
    "gauss24",
    "gauss32",
    "rk4",
)
# What the paper's schemes may take the remainder for over a step, and the order that makes.
APPROXIMATIONS = {"linear": 2, "quadratic": 3, "cubic": 4, ("trigonometric", 3.6): 3}
# The paper's run times of 10 s [s], by method and step.
PAPER_TIMES = {("spim_pc", STEP): 0.079, ("rk4", RK4_STEP): 753.0, ("rk4", STEP): 0.656}


def pendulum():
    """The system, all numbers the paper's."""
    return spim.models.CompoundPendulum()


def run(method, step, end, every=1, **options):
    """A run from the paper's initial state."""
    return spim.integrate(pendulum(), Z0, (0.0, end), step, method=method, every=every, **options)


def reference(end):
    """The state at a time, by Gauss collocation of order 16 with small steps, (4,)."""
    return run("gauss16", 2.5e-3, end).z[-1]


def errors(step=STEP):
    """Largest error of the four components at 2 s, by method."""
    exact = reference(ERROR_END)
    return {m: float(np.abs(run(m, step, ERROR_END).z[-1] - exact).max()) for m in METHODS}


def orders(method, steps=(0.01, 0.005), **options):
    """Measured order between two steps."""
    exact = reference(ERROR_END)
    found = [np.abs(run(method, h, ERROR_END, **options).z[-1] - exact).max() for h in steps]
    return float(np.log(found[0] / found[1]) / np.log(steps[0] / steps[1]))


def seconds(method, step, repeats=5):
    """Median time of a run of 10 s, its end state stored, [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run(method, step, END, every=10**9)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def comparisons():
    """The paper's Figs. 17 and 18 beside ours."""
    coarse, fine = run("spim_pc", STEP, END), run("rk4", RK4_STEP, END, every=100)
    words = "The text: RKM with 1e-4 s and SPIM with 0.01 s agree;\nthey took 753 s and 0.079 s."
    for figure, at, quantity, unit, ticks in (
        (17, 0, "state x", "m", (-0.15, 0.15, 7)),
        (18, 1, "state theta", "rad", (-0.6, 0.6, 7)),
    ):
        off = np.abs(coarse.z[:, at] - fine.z[:, at]).max()
        curves = [
            Curve("RK4, h = 1e-4 s", fine.t, fine.z[:, at], {"color": VERMILION}, "-"),
            Curve(
                "SPIM (47), h = 0.01 s",
                coarse.t,
                coarse.z[:, at],
                {"color": BLUE, "marker": "o", "linestyle": ""},
                f"{number(off)} {unit}",
            ),
        ]
        paper = PaperFigure(figure, STEP, quantity, unit, ticks, words)
        yield Comparison(paper, curves, notes="largest difference over the run")


def energy_figure(end):
    """Energy errors over a long run."""
    styles = {
        "spim_pc": {"color": BLUE},
        "spim_implicit": {"color": BLUE, "linestyle": "--"},
        "lawson_gauss4": {"color": BLACK},
        "rk4": {"color": VERMILION},
    }
    panels = []
    for name, until in (("energy", END), ("energy_long", end)):
        curves = []
        for method, style in styles.items():
            solution = run(method, STEP, until, every=max(1, round(until / STEP / 1000)))
            error = solution.energy / solution.energy[0] - 1.0
            curves.append(Curve(method, solution.t, error, style))
        panels.append(Panel(name, f"Energy over {until:g} s, h = {STEP:g} s", curves))
    return Growth(
        "energy",
        f"Energy errors, h = {STEP:g} s",
        "|H/H0 - 1|",
        "",
        "Largest relative energy error so far on a logarithmic axis, over 10 s and a long run. "
        "Lawson-Gauss of order 4 keeps its band, the implicit form of eq. 47 nearly so; eq. 47 "
        "itself drifts slowly and RK4 fast.",
        (1e-12, 1.0),
        tuple(panels),
    )


def error_table():
    """Errors and measured orders of all methods at the paper's step."""
    head = ["method", "order", "error at 2 s", "expected", "measured order", "ms for 10 s"]
    records = {record.name: record for record in spim.methods()}
    rows = []
    for method, error in errors().items():
        wanted = EXPECTED.get(method)
        # Where the error is rounding there is no order.
        slope = f"{orders(method):.2f}" if error > 1e-10 else "-"
        rows.append(
            [
                method,
                str(records[method].order),
                number(error),
                number(wanted) if wanted else "-",
                slope,
                f"{1e3 * seconds(method, STEP):.2f}",
            ]
        )
    return head, rows


def approximation_table():
    """Errors and measured orders of the paper's schemes with other functions for the remainder."""
    head = ["remainder over a step", "method", "order", "error at 2 s", "measured order"]
    exact, rows = reference(ERROR_END), []
    for approximation, order in APPROXIMATIONS.items():
        name = (
            approximation
            if isinstance(approximation, str)
            else "{}, w = {:g}".format(*approximation)
        )
        for method in ("spim_explicit", "spim_pc", "spim_implicit"):
            options = {"approximation": approximation}
            error = np.abs(run(method, STEP, ERROR_END, **options).z[-1] - exact).max()
            slope = orders(method, (0.0025, 0.00125), **options)
            rows.append([name, method, str(order), number(error), f"{slope:.2f}"])
    return head, rows


def time_table():
    """The paper's own comparison, here and there."""
    head = ["run of 10 s", "error at 10 s", "here [s]", "paper [s]"]
    exact, rows = reference(END), []
    for (method, step), theirs in PAPER_TIMES.items():
        error = np.abs(run(method, step, END, every=10**9).z[-1] - exact).max()
        took = number(seconds(method, step, 3))
        rows.append([f"{method}, h = {step:g} s", number(error), took, f"{theirs:g}"])
    return head, rows


def reproduce(folder, quick=False):
    """Run the study and write its figures, data and report.

    Parameters
    ----------
    folder : Folder
    quick : bool
        The long run of the energy figure takes 100 s instead of 1000 s.

    Returns
    -------
    str
        Errors of all methods.
    """
    table = error_table()
    end = run("gauss16", 2.5e-3, END).z[-1]
    template = files(__package__).joinpath("pendulum.md").read_text(encoding="utf-8")
    report = Template(template).substitute(
        errors=markdown_table(*table),
        approximations=markdown_table(*approximation_table()),
        times=markdown_table(*time_table()),
        end=", ".join(f"{x:.8f}" for x in end),
        reference=", ".join(f"{x:.8f}" for x in REFERENCE),
        energy_figure=folder.write_figure(energy_figure(QUICK if quick else LONG)),
        figures="\n\n".join(map(folder.write_figure, comparisons())),
        environment=environment(),
    )
    folder.write_text("report.md", report)
    return text_table(*table)
