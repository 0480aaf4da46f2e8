"""Study 6.2 of the paper: three oscillators of high and low frequency, accuracy.

Figs. 10-15 of Huang, Deng, Yao, J. Sound Vib. 299 (2007) 229-246, its numbers beside ours. Its
curves are not available as data, and none is drawn: the left panels show what its text, its eq. 50
and its axes say. Report: ``oscillators.md``, a template filled in here.
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
from spim.studies import _decimal, _drawing
from spim.studies._output import markdown_table, text_table

MASS = (0.1, 10.0, 1000.0)  # kg
STIFFNESS = (100.0, 10.0, 1.0)  # N/m
Z0 = (0.0, 0.0, 0.0, 2.0, 2.0, 2.0)  # m and kg m/s, from eq. 50
END = 2.0  # s
STEPS = (0.05, 0.01)  # s, the paper's tau
LONG = {False: 1_000_000, True: 10_000}  # steps of 0.01 s, by `quick`: beyond the paper


@dataclass(frozen=True)
class Setting:
    """A method as the study runs it, and how it is drawn.

    Attributes
    ----------
    label : str
    method, options : str, dict
        Of `spim.integrate`.
    paper : dict of float to float
        The paper's largest error of x1 over 0-2 s [m], by step [s], where it states one.
    style : dict
        Of Matplotlib's lines.
    """

    label: str
    method: str
    options: dict
    paper: dict
    style: dict


SETTINGS = {
    "rk4": Setting(
        "RK4",
        "rk4",
        {},
        {0.01: 3.2e-3},
        {"color": _drawing.VERMILION, "marker": "^", "linestyle": "--"},
    ),
    "unscaled": Setting(
        "[2/2] without doubling",
        "spim",
        {"doublings": 0, "correction": "none"},
        {},
        {"color": _drawing.PURPLE, "marker": "s", "linestyle": "-."},
    ),
    "pim": Setting(
        "PIM, N = 20",
        "pim",
        {"correction": "none"},
        {0.01: 5.4e-4},
        {"color": _drawing.GREEN, "marker": "x", "linestyle": ":"},
    ),
    "spim": Setting(
        "SPIM, plain double",
        "spim",
        {"correction": "none"},
        {0.05: 6.1e-15, 0.01: 3.4e-15},
        {"color": _drawing.BLUE, "marker": "o", "linestyle": "-"},
    ),
    "polish": Setting(
        "SPIM, polished (default)",
        "spim",
        {"correction": "polish"},
        {},
        {"color": _drawing.SKY, "marker": "D", "linestyle": "-"},
    ),
    "exact": Setting(
        'SPIM, correction="exact"',
        "spim",
        {"correction": "exact"},
        {},
        {"color": _drawing.BLACK, "marker": ".", "linestyle": "-"},
    ),
}


@dataclass(frozen=True)
class Figure:
    """A figure of the paper: what it shows, as far as it can be known, and what we draw beside it.

    Attributes
    ----------
    number : int
    step : float
        [s].
    settings : tuple of str
        Our curves, keys of `SETTINGS`.
    axis : (float, float)
        The paper's vertical axis by its tick labels [10^exponent m].
    words : str
        What the paper says about it.
    largest : float or None
        Largest error stated [m]; None: the figure shows states, not errors.
    exponent : int
    apart : str or None
        One of our curves that needs an axis of its own, in 10^-15 m.
    """

    number: int
    step: float
    settings: tuple
    axis: tuple
    words: str
    largest: float | None = None
    exponent: int = 0
    apart: str | None = None

    @property
    def name(self):
        return f"fig{self.number}"

    @property
    def quantity(self):
        return "state $x_1$" if self.largest is None else "error of $x_1$"


FIGURES = (
    Figure(
        10,
        0.05,
        ("rk4", "unscaled", "pim", "spim"),
        (-0.8, 0.8),
        'The text: RKM "departs far from the analytical solution"; SGA (the legend\n'
        'says PIM) "can capture [it], although there is some error"; between SPIM and\n'
        'REAL there "cannot be observed any difference".',
    ),
    Figure(
        11,
        0.05,
        ("spim", "exact"),
        (-6, 8),
        'The text: "the max error is only 6.1 × 10$^{-15}$". The error of SPIM.',
        6.1e-15,
        -15,
    ),
    Figure(
        12,
        0.01,
        ("rk4", "unscaled", "pim", "spim"),
        (-0.8, 0.8),
        "The text: the results of the four methods\n"
        '"are close so much as to superpose entirely".',
    ),
    Figure(
        13,
        0.01,
        ("spim", "exact"),
        (-4, 4),
        'The text: "the largest error of SPIM is 3.4 × 10$^{-15}$".',
        3.4e-15,
        -15,
    ),
    Figure(
        14,
        0.01,
        ("unscaled",),
        (-6, 6),
        'The text: "that of PIM is 5.4 × 10$^{-4}$". One [2/2] step without doubling\n'
        "gives this figure; PIM with N = 20, as the paper describes it, does not.",
        5.4e-4,
        -4,
        "pim",
    ),
    Figure(
        15,
        0.01,
        ("rk4",),
        (-4, 4),
        'The text: "that of RKM is 3.2 × 10$^{-3}$".',
        3.2e-3,
        -3,
    ),
)

# What could have given the paper's 5.4e-4: name, method, options.
SUSPECTS = (
    ("PIM as described: Taylor 4, N = 20", "pim", {"doublings": 20}),
    ("Taylor 4, no doubling (RK4's polynomial)", "pim", {"doublings": 0}),
    ("the paper's SRK, eq. 30: [1/1], two half steps", "spim", {"pade": 1, "doublings": 1}),
    ("[2/2], two half steps", "spim", {"pade": 2, "doublings": 1}),
    ("**[2/2], no doubling**", "spim", {"pade": 2, "doublings": 0}),
)


@dataclass(frozen=True)
class Result:
    """A run over 0-2 s: its solution and its errors.

    Attributes
    ----------
    solution : spim.Solution
    error : ndarray (k,)
        Of x1 [m], against 60 digits.
    energy_error : ndarray (k,)
        H/H0 - 1.
    """

    solution: object
    error: np.ndarray
    energy_error: np.ndarray

    @property
    def largest(self):
        """Largest error of x1 [m]."""
        return float(np.abs(self.error).max())

    @property
    def largest_energy_error(self):
        """Largest relative error of the energy."""
        return float(np.abs(self.energy_error).max())


def system():
    """The three oscillators of the paper."""
    return spim.models.Oscillators(mass=MASS, stiffness=STIFFNESS)


def reference(step, oscillator=0):
    """Displacement of an oscillator on the grid ``k step`` over 0-2 s, 60 digits.

    Closed form of the matrix as rounded; nothing of the methods enters.

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
    A, n = system().A, len(MASS)
    gain, stiffness = A[oscillator, n + oscillator], -A[n + oscillator, oscillator]
    count = round(END / step) + 1
    return _decimal.displacements(
        float(gain), float(stiffness), Z0[n + oscillator], step, count
    )


def run(step, method, options, exact):
    """Integrate over 0-2 s and measure.

    Parameters
    ----------
    step : float
        [s].
    method, options : str, dict
        Of `spim.integrate`.
    exact : list of Decimal
        `reference` (step).

    Returns
    -------
    Result
    """
    solution = spim.integrate(system(), Z0, (0.0, END), step, method=method, **options)
    error = _decimal.errors(solution.z[:, 0], exact)
    return Result(solution, np.array(error), energy_error(solution))


def study():
    """Every setting at both steps.

    Returns
    -------
    dict of (str, float) to Result
        By the key of `SETTINGS` and the step [s].
    """
    exact = {step: reference(step) for step in STEPS}
    return {
        (key, step): run(step, setting.method, setting.options, exact[step])
        for key, setting in SETTINGS.items()
        for step in STEPS
    }


def energy_error(solution):
    """``H/H0 - 1`` of the stored states, free of rounding, (k,)."""
    A, n = system().A, len(MASS)
    errors = _decimal.energy_errors(np.diag(A[:n, n:]), -np.diag(A[n:, :n]), solution.z)
    return np.array(errors)


def long_energy_errors(steps):
    """Relative energy errors of long runs at tau = 0.01 s, at most 250 rows each.

    Returns
    -------
    t : ndarray (k,)
        [s].
    errors : dict of str to ndarray (k,)
    """
    step, every = STEPS[1], max(1, steps // 250)
    span = (0.0, steps * step)
    errors = {}
    for key, setting in SETTINGS.items():
        solution = spim.integrate(
            system(), Z0, span, step, method=setting.method, every=every, **setting.options
        )
        errors[key] = energy_error(solution)
    return solution.t, errors


def run_seconds(setting, step, steps, repeats=5):
    """Shortest time of several runs of `spim.integrate` [s], matrix exponential included."""
    oscillators, span = system(), (0.0, steps * step)
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        spim.integrate(
            oscillators, Z0, span, step, method=setting.method, every=steps, **setting.options
        )
        times.append(time.perf_counter() - start)
    return min(times)


def closed_form_in_double(step):
    """Eq. 50 evaluated in double precision on the grid ``k step``: x1 [m], (k,)."""
    t = np.arange(round(END / step) + 1) * step
    return real(t)


def real(t):
    """Eq. 50, the paper's REAL: x1 [m] at times t [s]."""
    return math.sqrt(10) / 5 * np.sin(10 * math.sqrt(10) * t)


# Figures


def draw(figure, results):
    """A figure of the paper on the left, as far as it is known, and ours on the right."""
    errors = figure.largest is not None
    split = figure.apart is not None
    p = _drawing.panels(
        f"Paper, Fig. {figure.number} (τ = {figure.step:g} s)",
        f"spim (τ = {figure.step:g} s)",
        split,
    )
    if errors:
        _draw_paper_error(p.left, figure)
    else:
        _draw_real(p.left, "REAL, by the paper's eq. (50)", color=_drawing.BLACK, linewidth=1.2)
        _draw_real(p.right, "eq. (50)", color=_drawing.PALE, linewidth=3)
    for key in figure.settings:
        _draw_curve(p.right, key, results[key, figure.step], figure.exponent, errors)
    for axes in (p.left, p.right):
        _label(axes, figure.quantity, figure.exponent)
        axes.set_ylim(figure.axis)
    if split:
        _draw_curve(p.lower, figure.apart, results[figure.apart, figure.step], -15, errors)
        _label(p.lower, figure.quantity, -15)
        p.right.set_xlabel("")
    curve = "" if not errors else "\nThe curve itself is not available: its bound and its axis are."
    _drawing.note(p.left_notes, figure.words + curve)
    _drawing.legend(p.right_notes, [p.right] + [p.lower] * split)
    return p.figure


def _draw_paper_error(axes, figure):
    bound = figure.largest / 10.0**figure.exponent
    axes.fill_between([0, END], -bound, bound, color=_drawing.PALE, alpha=0.5, linewidth=0)
    _drawing.level(axes, bound, f"largest error: {bound:g} × $10^{{{figure.exponent}}}$ m")
    _drawing.level(axes, -bound, "")


def _draw_real(axes, label, **style):
    t = np.linspace(0, END, 2001)
    axes.plot(t, real(t), label=label, **style)


def _draw_curve(axes, key, result, exponent, errors):
    setting = SETTINGS[key]
    t, x = result.solution.t, result.error if errors else result.solution.z[:, 0]
    sparse = max(1, len(t) // 50)
    axes.plot(
        t,
        x / 10.0**exponent,
        label=f"{setting.label}: error at most {result.largest:.3g} m",
        linewidth=1.1,
        markersize=4,
        markevery=sparse,
        **setting.style,
    )


def _label(axes, quantity, exponent):
    unit = f"$10^{{{exponent}}}$ m" if exponent else "m"
    axes.set(xlim=(0, END), xlabel="time [s]", ylabel=f"{quantity} [{unit}]")


def columns(figure, results):
    """The numbers behind a figure, by column title; the reference to 40 digits."""
    errors = figure.largest is not None
    keys = [*figure.settings, *([figure.apart] if figure.apart else [])]
    table = {"time [s]": results[keys[0], figure.step].solution.t.tolist()}
    if not errors:
        table["x1 reference [m]"] = [f"{x:.40g}" for x in reference(figure.step)]
    for key in keys:
        result = results[key, figure.step]
        values = result.error if errors else result.solution.z[:, 0]
        quantity = "error of x1" if errors else "x1"
        table[f"{quantity}: {SETTINGS[key].label} [m]"] = values.tolist()
    return table


def alt_text(figure, results):
    """A figure in words, with its numbers."""
    ours = "; ".join(
        f"{SETTINGS[key].label}, error at most {results[key, figure.step].largest:.3g} m"
        for key in (*figure.settings, *([figure.apart] if figure.apart else []))
    )
    theirs = (
        "the closed form of eq. 50 and the paper's words on its three methods"
        if figure.largest is None
        else f"the band of the paper's largest error, {figure.largest:g} m"
    )
    quantity = figure.quantity.replace("$", "").replace("_", "")
    return (
        f"Fig. {figure.number}, {quantity} over 0-2 s at tau = {figure.step:g} s. "
        f"Left: {theirs}. Right: {ours}."
    )


def draw_errors(results):
    """All errors over time on a logarithmic axis, one panel a step, the paper's as lines."""
    p = _drawing.panels(*(f"All methods, τ = {step:g} s" for step in STEPS))
    for axes, step in zip((p.left, p.right), STEPS, strict=True):
        for key, setting in SETTINGS.items():
            result = results[key, step]
            _draw_magnitude(axes, result.solution.t, result.error, setting)
            if step in setting.paper:
                text = f"paper, {setting.label.split(',')[0]}: {setting.paper[step]:g} m"
                _drawing.level(axes, setting.paper[step], text)
        axes.set(xlim=(0, END), ylim=(1e-18, 1e2), xlabel="time [s]")
        axes.set(yscale="log", ylabel="magnitude of the error of $x_1$ [m]")
    _drawing.legend(p.left_notes, [p.left])
    return p.figure
