"""Figures of the studies: the paper on the left, ours on the right, notes below each.

Matplotlib is imported on use, through its object-oriented interface: no display, no pyplot, no
global setting. Colours are those of Okabe and Ito (2008), told apart with any colour vision.
"""

from dataclasses import dataclass

BLUE, SKY, GREEN, VERMILION, PURPLE, ORANGE = (
    "#0072B2",
    "#56B4E9",
    "#009E73",
    "#D55E00",
    "#CC79A7",
    "#E69F00",
)
BLACK, GREY, PALE = "#000000", "#767676", "#D9D9D9"


class MissingPlotError(ImportError):
    """Matplotlib is needed and not installed."""


def require_matplotlib():
    """Raise `MissingPlotError` unless Matplotlib is there: to be called before long work."""
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError:
        raise MissingPlotError(
            'figures need Matplotlib, which is not installed: pip install "spim[plot]"'
        ) from None


@dataclass(frozen=True)
class Panels:
    """A figure of two columns: `left` and `right` are axes, the notes the space below them.

    `lower` is a second pair of axes under `right` where it was asked for, else None.
    """

    figure: object
    left: object
    right: object
    lower: object
    left_notes: object
    right_notes: object


def panels(left_title, right_title, split=False):
    """An empty figure of two columns.

    Parameters
    ----------
    left_title, right_title : str
    split : bool
        The right column has two axes, one above the other.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 2, height_ratios=(1, 1, 0.5))
    left = figure.add_subplot(grid[:2, 0])
    right = figure.add_subplot(grid[0, 1] if split else grid[:2, 1])
    lower = figure.add_subplot(grid[1, 1]) if split else None
    notes = [figure.add_subplot(grid[2, column]) for column in (0, 1)]
    for axes in (left, right, lower):
        if axes is not None:
            _tidy(axes)
    for axes in notes:
        axes.set_axis_off()
    left.set_title(left_title, loc="left", fontsize=11, fontweight="bold")
    right.set_title(right_title, loc="left", fontsize=11, fontweight="bold")
    return Panels(figure, left, right, lower, *notes)


def note(axes, text):
    """Fill the space below a panel with text."""
    axes.text(0, 1, text, va="top", fontsize=9, linespacing=1.35, transform=axes.transAxes)


def legend(notes, axes):
    """Put the legend of one or more axes into the space below them."""
    handles, labels = [], []
    for each in axes:
        more = each.get_legend_handles_labels()
        handles += more[0]
        labels += more[1]
    notes.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(0, 1.1),
        ncols=1 if len(labels) <= 4 else 2,
        fontsize=9,
        frameon=False,
        borderaxespad=0,
        handlelength=2.6,
    )


def level(axes, value, text, **style):
    """A horizontal line of the paper's, with its text just above."""
    axes.axhline(value, color=BLACK, linewidth=1, linestyle=(0, (6, 3)), zorder=1, **style)
    axes.annotate(
        text,
        (0.01, value),
        xycoords=("axes fraction", "data"),
        xytext=(0, 3),
        textcoords="offset points",
        fontsize=8.5,
    )


def _tidy(axes):
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
