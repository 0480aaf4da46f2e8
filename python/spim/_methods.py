"""The methods, as their records in the core describe them."""

import textwrap
from dataclasses import dataclass, field

from spim import _core

OPTIONS = (
    "options: keyword arguments of integrate. The tables are of methods without any, and of auto "
    "on linear systems"
)
INDENT = {"initial_indent": "    ", "subsequent_indent": "    "}


@dataclass(frozen=True)
class Method:
    """What is true of a method at its default options, and what was measured of it.

    Labels of "auto" are those on linear systems; on others it has those of the method it takes,
    which ``solution.method`` names. Options can change order and labels, as they say.

    The figures are measured by the verification suite, `pim` and `spim` without their doublings, on
    Hénon and Heiles' system or, where a method needs a linear one, on two coupled oscillators, with
    a step of 1/8; the order on runs of many steps. `docs/methods.md` says how. They are None for a
    method without a line in the table.

    Attributes
    ----------
    name, aliases, summary : str, tuple of str, str
    order : int or None
        Order of convergence; None where it is exact but for rounding.
    symplectic, symmetric, energy_preserving : bool
        Of the step on Hamiltonian systems.
    needs : str
        The structure it needs: "flow" (any system), "linear", "structure", "separable" (linear,
        free and undamped), "split" (q' of p alone, p' of q alone), "semilinear", "canonical" (the
        same with a Hamiltonian A) or "potential" (the same with forces of q alone).
    reproducible : str
        Where its results are the same bits.
    reference : str
    options : dict of str
        Keyword arguments of `integrate` it takes, and what they do.
    measured_order : float or None
        Slope of the error over the step, both in logarithms, in the limit of small steps.
    symplectic_defect : float or None
        Largest entry of ``W.T @ J @ W - J``, W the derivative of a step.
    reversibility_defect : float or None
        How far a step forth and one back end from their start, of its largest component.
    energy_error : float or None
        Largest relative error of the energy over 1e5 steps; infinite where they fail.
    energy_drift : float or None
        Change of that error's mean from the first tenth of the steps to the last.
    evaluations, products : float or None
        Evaluations of the right side, and products of a matrix and a block of states, a step.
    """

    name: str
    aliases: tuple
    summary: str
    order: int | None
    symplectic: bool
    symmetric: bool
    energy_preserving: bool
    needs: str
    reproducible: str
    reference: str
    options: dict = field(repr=False)
    measured_order: float | None = None
    symplectic_defect: float | None = None
    reversibility_defect: float | None = None
    energy_error: float | None = None
    energy_drift: float | None = None
    evaluations: float | None = None
    products: float | None = None


class Methods(list):
    """A list of records that prints as tables: what is said of them, what was measured, options."""

    def __str__(self):
        labels = [("name", "order", "symplectic", "symmetric", "needs", "what it is")]
        labels += [
            (
                m.name,
                "exact" if m.order is None else str(m.order),
                "yes" if m.symplectic else "no",
                "yes" if m.symmetric else "no",
                m.needs,
                m.summary,
            )
            for m in self
        ]
        figures = [
            (
                "measured",
                "order",
                "symplectic",
                "symmetric",
                "energy",
                "drift",
                "evaluations",
                "products",
            ),
            ("", "", "defect", "defect", "error", "of it", "a step", "a step"),
            *((m.name, *cells(m)) for m in self),
        ]
        tables = [_aligned(labels), _aligned(figures)]
        options = [
            f"{name}: of {', '.join(names)}\n{textwrap.fill(doc, 96, **INDENT)}"
            for name, names, doc in takes(self)
        ]
        return "\n\n".join(tables + (["\n".join([OPTIONS, *options])] if options else []))

    __repr__ = __str__


def takes(records):
    """The options of methods: name, names of the methods that take it, what it does."""
    found = {}
    for record in records:
        for option in record.options.items():
            found.setdefault(option, []).append(record.name)
    return [(name, names, doc) for (name, doc), names in found.items()]


def cells(method):
    """The measured figures of a method, as tables show them.

    Parameters
    ----------
    method : Method

    Returns
    -------
    tuple of str
        Order, defects, energy error and drift, evaluations and products.
    """
    order = "exact" if method.order is None else _shown(method.measured_order, ".2f")
    small = (
        method.symplectic_defect,
        method.reversibility_defect,
        method.energy_error,
        method.energy_drift,
    )
    counts = (method.evaluations, method.products)
    return (
        order,
        *(_shown(figure, ".1e") for figure in small),
        *(_shown(count, ".2g") for count in counts),
    )


def _shown(figure, form):
    return "-" if figure is None else format(figure, form)


def _aligned(rows):
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    lines = []
    for row in rows:
        first = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        lines.append("  ".join([*first, row[-1]]))
    return "\n".join(lines)


def methods():
    """All methods `integrate` knows.

    Returns
    -------
    list of Method
        Prints as tables: what is said of the methods, what was measured, and their options.
    """
    records = _core.methods()
    return Methods(Method(**{**r, "aliases": tuple(r["aliases"])}) for r in records)
