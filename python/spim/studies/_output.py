"""What a study writes: text, tables and figures in one folder, and a list of what was written."""

import csv
from pathlib import Path


class Folder:
    """The folder ``output / name`` of a study; made if need be.

    Attributes
    ----------
    path : Path
    files : list of Path
        Everything written so far.

    Raises
    ------
    OSError
        The folder cannot be made.
    """

    def __init__(self, output, name):
        self.path = Path(output) / name
        self.path.mkdir(parents=True, exist_ok=True)
        self.files = []

    def write_text(self, name, text):
        """Write a text file."""
        self._new(name).write_text(text, encoding="utf-8")

    def write_table(self, name, columns):
        """Write columns of equal length as CSV, their names with units in the first line.

        Parameters
        ----------
        name : str
        columns : dict of str to sequence
            Floats are written with 17 digits, so that they read back as they were.
        """
        with self._new(name).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            for row in zip(*columns.values(), strict=True):
                writer.writerow([f"{x:.17g}" if isinstance(x, float) else x for x in row])

    def write_figure(self, figure):
        """Write a figure as SVG and PNG and its numbers as CSV; return the Markdown that shows it.

        Parameters
        ----------
        figure : Comparison or Growth
        """
        drawing = figure.draw()
        formats = {"svg": {"Date": None}, "png": {}}
        for suffix, metadata in formats.items():
            path = self._new(f"{figure.name}.{suffix}")
            drawing.savefig(path, dpi=150, metadata={"Title": figure.title, **metadata})
        tables = figure.tables()
        for name, columns in tables.items():
            self.write_table(f"{name}.csv", columns)
        data = ", ".join(f"[{name}.csv]({name}.csv)" for name in tables)
        return (
            f"![{figure.alt_text()}]({figure.name}.svg)\n\n"
            f"{figure.title} ([PNG]({figure.name}.png); data: {data})"
        )

    def _new(self, name):
        path = self.path / name
        self.files.append(path)
        return path


def number(x):
    """A number with up to four digits, as ``5.469e-4`` or ``0.2``."""
    mantissa, _, exponent = f"{x:.3e}".partition("e")
    return f"{float(mantissa):g}e{int(exponent)}" if int(exponent) < -1 else f"{x:.4g}"


def markdown_table(head, rows):
    """A table of strings in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def text_table(head, rows):
    """A table of strings in columns, for the terminal: the first column left, numbers right."""
    lines = [head, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )
