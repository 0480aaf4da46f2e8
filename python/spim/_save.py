"""Solutions as files: arrays for NumPy (.npz), columns for anything that reads tables (.csv)."""

from pathlib import Path

import numpy as np

from spim._versions import __version__


def save(solution, path):
    """Write a solution; see `Solution.save`."""
    path = Path(path)
    write = WRITERS.get(path.suffix.lower())
    if write is None:
        there = " or ".join(WRITERS)
        raise ValueError(f"path: the suffix must be {there}, got {path.name!r}")
    write(solution, path)


def _write_arrays(solution, path):
    about = {
        "spim_version": __version__,
        "method": solution.method,
        "step": solution.step,
        "model": solution._model_text(),
    }
    # Given a name, NumPy would add a suffix to one in capitals.
    with path.open("wb") as file:
        np.savez(file, **solution._saved_arrays(), **about)


def _write_columns(solution, path):
    columns = solution._saved_columns()
    rows = np.column_stack(list(columns.values()))
    # 17 digits read back as they were.
    with path.open("w", newline="\n", encoding="utf-8") as file:
        np.savetxt(file, rows, "%.17g", ",", header=",".join(columns), comments="")


WRITERS = {".csv": _write_columns, ".npz": _write_arrays}
