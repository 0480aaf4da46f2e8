"""The methods, as their records in the core describe them."""

from dataclasses import dataclass, field

from spim import _core


@dataclass(frozen=True)
class Method:
    """What is true of a method at its default options.

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


class Methods(list):
    """A list of records that prints as a table."""

    def __str__(self):
        head = ("name", "order", "symplectic", "symmetric", "needs", "what it is")
        rows = [
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
        widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head) - 1)]
        lines = []
        for row in [head, *rows]:
            cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
            lines.append("  ".join([*cells, row[-1]]))
        return "\n".join(lines)

    __repr__ = __str__


def methods():
    """All methods `integrate` knows.

    Returns
    -------
    list of Method
        Prints as a table.
    """
    records = _core.methods()
    return Methods(Method(**{**r, "aliases": tuple(r["aliases"])}) for r in records)
