"""Figures as data: curves, what a figure of the paper shows, comparisons, growth of errors.

Each figure has a name for its files, a title, `draw`, `tables` (for CSV) and `alt_text`.
"""

from dataclasses import dataclass, field

import numpy as np

from spim.studies import _drawing
from spim.studies._output import number


@dataclass(frozen=True)
class Curve:
    """Values over time, (k,) each: `t` in s, `values` in the unit of the figure.

    `style` is that of Matplotlib's lines; the legend and the alternative text add `note`.
    """

    label: str
    t: np.ndarray
    values: np.ndarray
    style: dict
    note: str = ""


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper, as far as it can be known without its curves.

    Attributes
    ----------
    number : int
    step : float
        [s].
    quantity, unit : str
        Of the vertical axis.
    ticks : (float, float, int)
        Of that axis: first, last, how many; in ``10^exponent unit``.
    words : str
        What the paper says about it, at most four lines of 72 characters.
    exponent : int
    largest : float, optional
        The largest magnitude it states [unit]: drawn as a band.
    """

    number: int
    step: float
    quantity: str
    unit: str
    ticks: tuple
    words: str
    exponent: int = 0
    largest: float | None = None


@dataclass(frozen=True)
class Comparison:
    """The paper's figure on the left, as far as it is known; ours on the same axes on the right.

    Attributes
    ----------
    paper : PaperFigure
    curves : list of Curve
        Ours.
    apart : list of Curve
        Ours, too small for the paper's axis: drawn below on one of their own.
    apart_exponent : int
        Of that axis.
    known : Curve, optional
        What the paper gives as a formula; drawn on both sides.
    reference : dict of str to sequence, optional
        Columns to go into the table before ours.
    notes : str
        What the notes of the curves are.
    """

    paper: PaperFigure
    curves: list
    apart: list = field(default_factory=list)
    apart_exponent: int = -15
    known: Curve | None = None
    reference: dict = field(default_factory=dict)
    notes: str = "largest error over the run"

    @property
    def name(self):
        return f"fig{self.paper.number}"

    @property
    def title(self):
        return f"Fig. {self.paper.number}: {self.paper.quantity}, tau = {self.paper.step:g} s"

    def draw(self):
        """As a Matplotlib figure."""
        return _drawing.beside_paper(self)

    def tables(self):
        """Name and columns of the figure's numbers."""
        curves, paper = self.curves + self.apart, self.paper
        columns = {f"{paper.quantity}: {c.label} [{paper.unit}]": c.values for c in curves}
        return {self.name: {"time [s]": curves[0].t} | self.reference | columns}

    def alt_text(self):
        """The figure in words, with its numbers."""
        theirs = []
        if self.known is not None:
            theirs.append(f"{self.known.label}, and the paper's words on its methods")
        if self.paper.largest is not None:
            theirs.append(f"a band for the paper's largest, {number(self.paper.largest)} m")
        ours = "; ".join(f"{c.label}, {c.note}" for c in self.curves + self.apart)
        left = ", ".join(theirs) or "the paper's axis and its words, its curve is not available"
        return f"{self.title}. Left: {left}. Right, with notes ({self.notes}): {ours}."


@dataclass(frozen=True)
class Panel:
    """Half of a `Growth`: curves, and values the paper states, by a short name."""

    name: str
    title: str
    curves: list
    stated: dict = field(default_factory=dict)
    logarithmic_time: bool = False


@dataclass(frozen=True)
class Growth:
    """Largest magnitudes so far on a logarithmic axis, in two panels of the same curves.

    Attributes
    ----------
    name, title, quantity, unit, words : str
        `words`: the alternative text.
    limits : (float, float)
        Ends of the vertical axes.
    panels : (Panel, Panel)
    """

    name: str
    title: str
    quantity: str
    unit: str
    words: str
    limits: tuple
    panels: tuple

    def draw(self):
        """As a Matplotlib figure."""
        return _drawing.growth(self)

    def tables(self):
        """Names and columns of the panels' numbers, signed, each at its time."""
        unit = f" [{self.unit}]" if self.unit else ""
        return {
            panel.name: {"time [s]": panel.curves[0].t}
            | {f"{self.quantity}: {curve.label}{unit}": curve.values for curve in panel.curves}
            for panel in self.panels
        }

    def alt_text(self):
        """The figure in words."""
        return self.words
