"""Where the paper's fixed N = 20 doublings end: errors of "spim" and "pim" by frequency and growth.

Relative to `expm(method="exact")`, in parts of its largest entry::

    python benches/python/fixed_doublings.py [--markdown]
"""

import argparse

import numpy as np
from _table import show

import spim

ANGLES = (1e-2, 1, 1e2, 1e3, 1e4, 1e5, 1e6)
GROWTHS = (1, 10, 20, 30, 40)


def error(a, method):
    """Largest error in parts of the largest entry, or the exception raised."""
    exact = spim.expm(a, method="exact")
    try:
        found = spim.expm(a, method=method)
    except (spim.SpimError, OverflowError) as problem:
        return type(problem).__name__
    return f"{np.abs(found - exact).max() / np.abs(exact).max():.1e}"


def rows():
    """Cells of the table."""
    for angle in ANGLES:
        a = angle * np.array([[0.0, 1.0], [-1.0, 0.0]])
        yield [f"oscillation, tau w = {angle:g}", error(a, "spim"), error(a, "pim")]
    for growth in GROWTHS:
        a = growth * np.array([[0.0, 1.0], [1.0, 0.0]])
        yield [f"growth and decay by e^{growth}", error(a, "spim"), error(a, "pim")]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    show(["motion", "spim", "pim"], rows(), parser.parse_args().markdown)


if __name__ == "__main__":
    main()
