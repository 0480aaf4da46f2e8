"""Drawing of `Comparison` and `Growth`: two columns, and below each a space for notes.

Matplotlib is imported on use, through its object-oriented interface: no display, no pyplot, no
global setting. Colours are those of Okabe and Ito (2008), told apart with any colour vision.
"""

import numpy as np

from spim.studies._output import number

BLACK, BLUE, SKY, GREEN = "#000000", "#0072B2", "#56B4E9", "#009E73"
VERMILION, PURPLE, PALE = "#D55E00", "#CC79A7", "#D9D9D9"
MARKERS = 40  # on a curve, about


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


def beside_paper(comparison):
    """Draw a `Comparison`, the paper on the left."""
    paper, curves, apart = comparison.paper, comparison.curves, comparison.apart
    figure, left, right, notes = _columns(
        f"Paper, Fig. {paper.number} (τ = {paper.step:g} s)",
        f"spim (τ = {paper.step:g} s)",
        rows=2 if apart else 1,
    )
    if comparison.known is not None:
        _draw_known(left, right[0], comparison.known)
    if paper.largest is not None:
        _draw_band(left, right[0], paper)
    elif comparison.known is None:
        text = "the curve is not available:\nthe paper's axis"
        left.text(0.5, 0.5, text, ha="center", va="center", fontsize=9, transform=left.transAxes)
    _draw_curves(right[0], curves, paper.exponent)
    t = curves[0].t
    for axes in (left, *right):
        axes.set(xlim=(t[0], t[-1]), xticks=np.linspace(t[0], t[-1], 5))
    for axes in (left, right[0]):
        axes.set(ylim=paper.ticks[:2], yticks=np.linspace(*paper.ticks))
        _label(axes, paper, paper.exponent)
    if apart:
        _draw_curves(right[1], apart, comparison.apart_exponent)
        _label(right[1], paper, comparison.apart_exponent)
        right[0].set(xlabel="", xticklabels=[])
    _write(notes[0], paper.words)
    _legend(notes[1], right, title=comparison.notes)
    return figure


def growth(figure_data):
    """Draw a `Growth`."""
    panels = figure_data.panels
    figure, left, (right,), notes = _columns(*(panel.title for panel in panels))
    unit = f" [{figure_data.unit}]" if figure_data.unit else ""
    for axes, panel in zip((left, right), panels, strict=True):
        for place, curve in enumerate(panel.curves):
            values = np.maximum.accumulate(np.abs(curve.values))
            # What is 0, as at the start, has no logarithm.
            shown = np.where(values > 0, values, np.nan)
            # Markers a tenth of the panel apart, those of each curve at places of their own.
            markers = (0.1 * place / len(panel.curves), 0.1)
            axes.plot(curve.t, shown, label=curve.label, markevery=markers, **_thin(curve.style))
        for name, value in panel.stated.items():
            _draw_level(axes, value, f"paper, {name}: {number(value)}", (1.01, 0), va="center")
        axes.set(yscale="log", ylim=figure_data.limits, xlabel="time [s]")
        axes.set(xscale="log" if panel.logarithmic_time else "linear")
        axes.set(ylabel=f"largest {figure_data.quantity} so far{unit}")
    _legend(notes[0], [left], columns=2)
    return figure


def _columns(left_title, right_title, rows=1):
    """A figure: itself, axes left, axes right (one or two), spaces for notes left and right."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.4), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.08)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 2, height_ratios=(1, 1, 0.6))
    left = figure.add_subplot(grid[:2, 0])
    places = [grid[:2, 1]] if rows == 1 else [grid[0, 1], grid[1, 1]]
    right = [figure.add_subplot(place) for place in places]
    notes = [figure.add_subplot(grid[2, column]) for column in (0, 1)]
    for axes in (left, *right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color=PALE, linewidth=0.6)
        axes.set_axisbelow(True)
    for axes, title in ((left, left_title), (right[0], right_title)):
        axes.set_title(title, loc="left", fontsize=11, fontweight="bold")
    for axes in notes:
        axes.set_axis_off()
    return figure, left, right, notes


def _draw_known(left, right, known):
    left.plot(known.t, known.values, label=known.label, **known.style)
    left.legend(loc="upper right", fontsize=9, frameon=False, borderaxespad=0)
    right.plot(known.t, known.values, label=known.label, color=PALE, linewidth=3)


def _draw_band(left, right, paper):
    bound = paper.largest / 10.0**paper.exponent
    left.axhspan(-bound, bound, color=PALE, alpha=0.5, linewidth=0)
    text = "the curve is not available:\nthe paper's axis and its largest error"
    left.text(0.5, 0.5, text, ha="center", va="center", fontsize=9, transform=left.transAxes)
    for axes in (left, right):
        _draw_level(axes, bound, f"paper: {number(paper.largest)} {paper.unit}", (0.01, -11))
        _draw_level(axes, -bound)


def _draw_level(axes, value, text="", at=(0, 0), **style):
    """A horizontal line; text from a fraction of the width on, some points above it."""
    axes.axhline(value, color=BLACK, linewidth=1, linestyle=(0, (6, 3)), zorder=1)
    axes.annotate(
        text,
        (at[0], value),
        xycoords=("axes fraction", "data"),
        xytext=(0, at[1]),
        textcoords="offset points",
        fontsize=8.5,
        annotation_clip=False,
        **style,
    )


def _draw_curves(axes, curves, exponent):
    for place, curve in enumerate(curves):
        # Where not every point has a marker, curves that coincide have theirs at different points.
        every = max(1, len(curve.t) // MARKERS)
        markers = (place % every, every)
        label = f"{curve.label}: {curve.note}"
        values = np.asarray(curve.values) / 10.0**exponent
        axes.plot(curve.t, values, label=label, markevery=markers, **_thin(curve.style))


def _thin(style):
    return {"linewidth": 1.1, "markersize": 5, "markerfacecolor": "none", **style}


def _label(axes, paper, exponent):
    unit = f"$10^{{{exponent}}}$ {paper.unit}" if exponent else paper.unit
    axes.set(xlabel="time [s]", ylabel=f"{paper.quantity} [{unit}]")


def _write(space, text):
    words = space.text(0, 1, text, va="top", fontsize=9, linespacing=1.4, transform=space.transAxes)
    words.set_in_layout(False)


def _legend(space, several, title=None, columns=1):
    """The legend of all curves of several axes, in a space for notes."""
    handles, labels = [], []
    for axes in several:
        more_handles, more_labels = axes.get_legend_handles_labels()
        handles += more_handles
        labels += more_labels
    legend = space.legend(
        handles,
        labels,
        title=title,
        alignment="left",
        loc="upper left",
        bbox_to_anchor=(0, 1.08),
        ncols=columns,
        fontsize=9,
        title_fontsize=9,
        frameon=False,
        borderaxespad=0,
        handlelength=2.8,
    )
    legend.set_in_layout(False)
