"""Study 6.2 of the paper: oscillators of high and low frequency, for accuracy. Figs. 10-15.

Huang, Deng, Yao, J. Sound Vib. 299 (2007) 229-246; its numbers beside ours. Its curves are not
available as data and none is drawn: the left panels show what its text, its eq. 50 and the ticks
of its axes say. The report's words are in ``oscillators.md``.
"""

import contextlib
import io
import math
import time
from dataclasses import dataclass
from importlib.resources import files
from string import Template

import numpy as np

import spim
from spim.studies import _decimal
from spim.studies._drawing import BLACK, BLUE, GREEN, PURPLE, SKY, VERMILION
from spim.studies._figures import Comparison, Curve, Growth, Panel, PaperFigure
from spim.studies._output import markdown_table, number, text_table

MASS = (0.1, 10.0, 1000.0)  # kg
STIFFNESS = (100.0, 10.0, 1.0)  # N/m
Z0 = (0.0, 0.0, 0.0, 2.0, 2.0, 2.0)  # m and kg m/s, from eq. 50
END = 2.0  # s
COARSE, FINE = STEPS = (0.05, 0.01)  # s, the paper's tau
LONG, QUICK = 1_000_000, 10_000  # fine steps of the energy figure
TIMED = 100_000  # fine steps of a run that is timed


@dataclass(frozen=True)
class Setting:
    """A method as the study runs it.

    Attributes
    ----------
    label : str
    method, options : str, dict
        Of `spim.integrate`.
    paper : dict of float to float
        The paper's largest error of x1 over 0-2 s [m] by step [s], where it states one.
    style : dict
        Of its curve.
    """

    label: str
    method: str
    options: dict
    paper: dict
    style: dict


def _style(color, marker, linestyle):
    return {"color": color, "marker": marker, "linestyle": linestyle}


PLAIN = {"correction": "none"}
SETTINGS = {
    "rk4": Setting("RK4", "rk4", {}, {FINE: 3.2e-3}, _style(VERMILION, "^", "--")),
    "unscaled": Setting(
        "[2/2] without doubling", "spim", PLAIN | {"doublings": 0}, {}, _style(PURPLE, "s", "-.")
    ),
    "pim": Setting("PIM, N = 20", "pim", PLAIN, {FINE: 5.4e-4}, _style(GREEN, "x", ":")),
    "spim": Setting(
        "SPIM, plain double",
        "spim",
        PLAIN,
        {COARSE: 6.1e-15, FINE: 3.4e-15},
        _style(BLUE, "o", "-"),
    ),
    "polish": Setting(
        "SPIM, polished (default)", "spim", {"correction": "polish"}, {}, _style(SKY, "D", "-")
    ),
    "exact": Setting(
        'SPIM, correction="exact"', "spim", {"correction": "exact"}, {}, _style(BLACK, ".", "-")
    ),
}

STATE, ERROR = "state x1", "error of x1"


def _states(number, step, words):
    """A figure of x1 by four methods."""
    paper = PaperFigure(number, step, STATE, "m", (-0.8, 0.8, 9), words)
    return paper, ("rk4", "unscaled", "pim", "spim"), ()


def _errors(number, step, ticks, exponent, largest, words, *settings, apart=()):
    """A figure of the error of x1 by one method."""
    paper = PaperFigure(number, step, ERROR, "m", ticks, words, exponent, largest)
    return paper, settings, apart


# What the paper shows; our curves, keys of `SETTINGS`; those that need an axis of their own.
FIGURES = (
    _states(
        10,
        COARSE,
        'The text: RKM "departs far from the analytical solution".\n'
        'SGA (in the legend: PIM) "can capture the analytical solution,\n'
        'although there is some error". Between SPIM and REAL there\n'
        '"cannot be observed any difference".',
    ),
    _errors(
        11,
        COARSE,
        (-6, 8, 8),
        -15,
        6.1e-15,
        'The text, of SPIM: "the max error is only 6.1 x 10$^{-15}$".',
        "spim",
        "exact",
    ),
    _states(
        12,
        FINE,
        'The text: "the results calculated by the four methods are close so much\n'
        'as to superpose entirely".',
    ),
    _errors(
        13,
        FINE,
        (-4, 4, 5),
        -15,
        3.4e-15,
        'The text: "the largest error of SPIM is 3.4 x 10$^{-15}$".',
        "spim",
        "exact",
    ),
    _errors(
        14,
        FINE,
        (-6, 6, 7),
        -4,
        5.4e-4,
        'The text: "that of PIM is 5.4 x 10$^{-4}$".\n'
        "A [2/2] step without doubling gives that (right, above).\n"
        "PIM with N = 20, as the paper describes it, does not\n"
        "(right, below: eleven powers of ten smaller).",
        "unscaled",
        apart=("pim",),
    ),
    _errors(15, FINE, (-4, 4, 5), -3, 3.2e-3, 'The text: "that of RKM is 3.2 x 10$^{-3}$".', "rk4"),
)

# What could have given the paper's 5.4e-4: words, method, options.
SUSPECTS = (
    ("PIM as described: Taylor 4, N = 20", "pim", {"doublings": 20}),
    ("Taylor 4 without doubling (RK4's polynomial)", "pim", {"doublings": 0}),
    ("SRK, eq. 30: two half steps of the midpoint rule", "spim", {"pade": 1, "doublings": 1}),
    ("[2/2], two half steps", "spim", {"pade": 2, "doublings": 1}),
    ("**[2/2] without doubling**", "spim", {"pade": 2, "doublings": 0}),
)


@dataclass(frozen=True)
class Result:
    """A run over 0-2 s: its solution, and the errors of x1 against 60 digits [m], ndarray (k,)."""

    solution: spim.Solution
    error: np.ndarray

    @property
    def largest(self):
        """Largest error of x1 [m]."""
        return float(np.abs(self.error).max())


def system():
    """The three oscillators."""
    return spim.models.Oscillators(mass=MASS, stiffness=STIFFNESS)


def reference(step, oscillator=0):
    """Displacement of an oscillator at ``0, step, 2 step .. 2 s``, 60 digits.

    The closed form, of the matrix as rounded: no method enters.

    Parameters
    ----------
    step : float
        [s], the double itself.
    oscillator : int
        0, 1 or 2.

    Returns
    -------
    list of Decimal
        [m].
    """
    A, x, p = system().A, oscillator, oscillator + len(MASS)
    count = round(END / step) + 1
    return _decimal.displacements(A[x, p], -A[p, x], Z0[p], step, count)


def real(t):
    """Eq. 50, the paper's REAL, in double precision: x1 [m] at times t [s]."""
    return math.sqrt(10) / 5 * np.sin(10 * math.sqrt(10) * t)


def real_error(step):
    """Largest error of `real` on the grid ``k step``, [m]."""
    exact = reference(step)
    return max(abs(e) for e in _decimal.errors(real(step * np.arange(len(exact))), exact))


def run(step, method, options, exact):
    """A `Result`, measured against ``exact = reference(step)``."""
    solution = spim.integrate(system(), Z0, (0.0, END), step, method=method, **options)
    return Result(solution, np.array(_decimal.errors(solution.z[:, 0], exact)))


def study():
    """All settings at both steps: `Result` by the key of `SETTINGS` and the step [s]."""
    exact = {step: reference(step) for step in STEPS}
    return {
        (key, step): run(step, setting.method, setting.options, exact[step])
        for key, setting in SETTINGS.items()
        for step in STEPS
    }


def fine_run(setting, steps, every):
    """Solution over many fine steps."""
    return spim.integrate(
        system(),
        Z0,
        (0.0, steps * FINE),
        FINE,
        method=setting.method,
        every=every,
        **setting.options,
    )


def energy_error(solution):
    """``H/H0 - 1`` of the stored states, free of rounding, ndarray (k,)."""
    A, n = system().A, len(MASS)
    return np.array(_decimal.energy_errors(A[:n, n:].diagonal(), -A[n:, :n].diagonal(), solution.z))


def seconds(setting, steps, repeats=7):
    """Shortest time of several runs over many fine steps, their last state stored, [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        fine_run(setting, steps, every=steps)
        times.append(time.perf_counter() - start)
    return min(times)


# Figures


def _curve(key, solution, values, note=""):
    return Curve(SETTINGS[key].label, solution.t, values, SETTINGS[key].style, note)


def comparisons(results):
    """The paper's figures beside ours, a `Comparison` each."""
    for paper, settings, apart in FIGURES:
        states = paper.quantity == STATE
        curves = []
        for key in settings + apart:
            result = results[key, paper.step]
            values = result.solution.z[:, 0] if states else result.error
            curves.append(_curve(key, result.solution, values, f"{number(result.largest)} m"))
        ours, others = curves[: len(settings)], curves[len(settings) :]
        if states:
            digits = {"x1: reference [m]": [f"{x:.40f}" for x in reference(paper.step)]}
            yield Comparison(paper, ours, others, known=_real_curve(), reference=digits)
        else:
            yield Comparison(paper, ours, others)


def _real_curve():
    t = np.linspace(0, END, 2001)
    return Curve("REAL, the paper's eq. (50)", t, real(t), {"color": BLACK, "linewidth": 1.1})


def error_figure(results):
    """Errors of all settings, a panel a step, with the paper's numbers."""
    panels = []
    for name, step in (("coarse", COARSE), ("fine", FINE)):
        runs = {key: results[key, step] for key in SETTINGS}
        curves = [_curve(key, result.solution, result.error) for key, result in runs.items()]
        stated = {s.method.upper(): s.paper[step] for s in SETTINGS.values() if step in s.paper}
        panels.append(Panel(f"errors_{name}", f"Error of x1, τ = {step:g} s", curves, stated))
    return Growth(
        "errors",
        "Errors of x1, all methods",
        "error of x1",
        "m",
        "Largest error of x1 so far over 0-2 s on a logarithmic axis, a panel a step, lines at the "
        "paper's numbers. RK4 and the [2/2] step without doubling lie eleven and more powers of "
        "ten above PIM with N = 20 and SPIM, which coincide; SPIM with exact correction is flat "
        "below 1e-16 m.",
        (1e-18, 10),
        tuple(panels),
    )


def energy_figure(results, long):
    """Energy errors of all settings with the fine step, over 0-2 s and over `long` runs."""
    short = {key: results[key, FINE].solution for key in SETTINGS}
    end = long["spim"].t[-1]
    panels = [
        Panel(name, title, [_curve(k, run, energy_error(run)) for k, run in runs.items()], {}, log)
        for name, title, runs, log in (
            ("energy", f"Energy over {END:g} s, τ = {FINE:g} s", short, False),
            ("energy_long", f"Energy over {end:g} s, τ = {FINE:g} s", long, True),
        )
    ]
    return Growth(
        "energy",
        f"Energy errors, all methods, tau = {FINE:g} s",
        "|H/H0 - 1|",
        "",
        "Largest relative energy error so far on a logarithmic axis, over 0-2 s and over a long "
        "run. RK4 loses energy from the start; the [2/2] step without doubling, PIM and SPIM stay "
        "at rounding and drift slowly; SPIM with exact correction does not drift.",
        (1e-18, 10),
        tuple(panels),
    )


# Tables: head and rows of strings


def error_table(results):
    """Largest errors of x1, ours beside the paper's."""
    head = ["largest error of x1 [m]"]
    for step in STEPS:
        head += [f"tau = {step:g} s", "paper"]
    rows = []
    for key, setting in SETTINGS.items():
        row = [setting.label]
        for step in STEPS:
            stated = setting.paper.get(step)
            row += [number(results[key, step].largest), number(stated) if stated else "-"]
        rows.append(row)
    return head, rows


def energy_table(results, long):
    """Largest relative energy errors."""
    head = ["largest relative energy error", *(f"0-2 s, tau = {step:g} s" for step in STEPS)]
    head += [f"0-{long['spim'].t[-1]:g} s, tau = {FINE:g} s"]
    rows = []
    for key, setting in SETTINGS.items():
        solutions = [*(results[key, step].solution for step in STEPS), long[key]]
        errors = [number(np.abs(energy_error(solution)).max()) for solution in solutions]
        rows.append([setting.label, *errors])
    return head, rows


def suspect_table():
    """What could have given the paper's 5.4e-4."""
    head = ["scheme", *(f"error, tau = {step:g} s [m]" for step in STEPS), "symplectic defect"]
    exact = {step: reference(step) for step in STEPS}
    rows = []
    for words, method, scheme in SUSPECTS:
        options = PLAIN | scheme
        errors = [number(run(step, method, options, exact[step]).largest) for step in STEPS]
        P = spim.Propagator(system().A, FINE, method=method, **options)
        rows.append([words, *errors, number(P.symplectic_defect)])
    return head, rows


def time_table():
    """Run times with the fine step, as ratios to RK4's."""
    lengths = (round(END / FINE), TIMED)
    head = ["run time, RK4 = 1", *(f"{steps} steps" for steps in lengths), "ns a step"]
    times = {key: [seconds(setting, n) for n in lengths] for key, setting in SETTINGS.items()}
    rows = []
    for key, setting in SETTINGS.items():
        ratios = [f"{mine / rk4:.2f}" for mine, rk4 in zip(times[key], times["rk4"], strict=True)]
        rows.append([setting.label, *ratios, f"{times[key][-1] / TIMED * 1e9:.1f}"])
    return head, rows


def environment():
    """What `spim.show_versions` prints."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        spim.show_versions()
    return text.getvalue().strip()


def reproduce(folder, quick=False):
    """Run the study and write its figures, data and report.

    Parameters
    ----------
    folder : Folder
    quick : bool
        The long run of the energy figure takes 1e4 steps instead of 1e6.

    Returns
    -------
    str
        Our largest errors beside the paper's.
    """
    results = study()
    steps = QUICK if quick else LONG
    long = {key: fine_run(setting, steps, steps // 250) for key, setting in SETTINGS.items()}
    template = files(__package__).joinpath("oscillators.md").read_text(encoding="utf-8")
    report = Template(template).substitute(
        errors=markdown_table(*error_table(results)),
        error_figure=folder.write_figure(error_figure(results)),
        suspects=markdown_table(*suspect_table()),
        energy=markdown_table(*energy_table(results, long)),
        energy_figure=folder.write_figure(energy_figure(results, long)),
        times=markdown_table(*time_table()),
        figures="\n\n".join(map(folder.write_figure, comparisons(results))),
        environment=environment(),
        unscaled=number(results["unscaled", FINE].largest),
        pim=number(results["pim", FINE].largest),
        rk4=number(results["rk4", FINE].largest),
        real_coarse=number(real_error(COARSE)),
        real_fine=number(real_error(FINE)),
        digits=_decimal.DIGITS,
    )
    folder.write_text("report.md", report)
    return text_table(*error_table(results))
