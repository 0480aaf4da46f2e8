"""Tables of the Gauss methods for stages solved together: prints rust/core/tableau/collocation.rs.

python tests/data/collocation_tables.py > rust/core/tableau/collocation.rs
"""

import mpmath as mp
from gauss_tableaus import tableau

mp.mp.dps = 80
STAGES = (1, 2, 3, 4, 6, 8, 12, 16)
# Stages the next ones are extrapolated from, those nearest to the end: more lose more by rounding.
REACH = 8


def ratios(a, b):
    """``a_ij / b_j``: below the diagonal rounded, above it what is left of 1, which is exact."""
    s = len(b)
    mu = [[0.5] * s for _ in range(s)]
    for i in range(s):
        for j in range(i):
            mu[i][j] = float(a[i][j] / b[j])
            mu[j][i] = 1.0 - mu[i][j]
            assert 0.5 <= mu[i][j] <= 2.0
            assert abs(mu[j][i] - a[j][i] / b[i]) < 2e-16
    return mu


def decomposed(a, b):
    """Eigenvalues of ``b_i a_ij / b_j``; both sides' vectors of those with imaginary part >= 0."""
    s = len(b)
    matrix = mp.matrix(s, s)
    for i in range(s):
        for j in range(s):
            matrix[i, j] = b[i] * a[i][j] / b[j]
    values, vectors = mp.eig(matrix)
    inverse = vectors**-1
    kept = [k for k in range(s) if mp.im(values[k]) > -(mp.mpf(10) ** -40)]
    kept.sort(key=lambda k: (mp.re(values[k]), mp.im(values[k])))
    forward, backward = [], []
    for k in kept:
        # A pair of conjugates counts twice; of equal length on both sides.
        pair = 1 if abs(mp.im(values[k])) < mp.mpf(10) ** -40 else 2
        length = mp.sqrt(sum(abs(inverse[k, j]) ** 2 for j in range(s)))
        forward.append([inverse[k, j] / length for j in range(s)])
        backward.append([pair * vectors[j, k] * length for j in range(s)])
    return [values[k] for k in kept], forward, backward


def ahead(c):
    """Lagrange polynomials through the last stages, at those of the next step."""
    s = len(c)
    known = range(max(0, s - REACH), s)
    rows = []
    for i in range(s):
        at = 1 + c[i]
        row = [mp.mpf(0)] * s
        for j in known:
            row[j] = mp.fprod((at - c[k]) / (c[j] - c[k]) for k in known if k != j)
        rows.append(row)
    return rows


def show(name, numbers):
    """A table, four numbers a line."""
    words = [repr(float(x)) for x in numbers]
    print(f"    {name}: &[")
    for at in range(0, len(words), 4):
        print(f"        {', '.join(words[at : at + 4])},")
    print("    ],")


def main():
    """Print the file."""
    print("//! Gauss methods for stages that are solved together.")
    print("//!")
    print(
        "//! Made by tests/data/collocation_tables.py. Ratios below the diagonal are the exact ones"
    )
    print("//! rounded once, those above are what is left of 1; the rest serves iterations alone.")
    print("//! Source: Antoñana, Makazaga & Murua, Numer. Algorithms 76 (2017).")
    print("#![allow(clippy::excessive_precision)]\n")
    print("use super::Collocation;\n")
    for s in STAGES:
        a, b, c = tableau(s)
        values, forward, backward = decomposed(a, b)
        print(f"/// Order {2 * s}.")
        print("#[rustfmt::skip]")
        print(f"pub const COLLOCATION{2 * s}: Collocation = Collocation {{")
        show("b", b)
        show("c", c)
        show("mu", [x for row in ratios(a, b) for x in row])
        show("ahead", [x for row in ahead(c) for x in row])
        for part, of in (("real", mp.re), ("imaginary", mp.im)):
            show(f"values_{part}", [of(x) for x in values])
            show(f"forward_{part}", [of(x) for row in forward for x in row])
            show(f"backward_{part}", [of(x) for row in backward for x in row])
        print("};\n")


if __name__ == "__main__":
    main()
