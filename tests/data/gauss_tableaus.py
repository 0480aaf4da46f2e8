"""Coefficients of the Gauss methods, rounded once: prints rust/core/tableau/gauss.rs.

python tests/data/gauss_tableaus.py > rust/core/tableau/gauss.rs
"""

import mpmath as mp
import numpy as np

mp.mp.dps = 80
STAGES = (1, 2, 3, 4, 6, 8)


def nodes(s):
    """Roots of the shifted Legendre polynomial."""
    guesses = np.polynomial.legendre.leggauss(s)[0]
    # The middle one is 0.
    roots = [
        mp.findroot(lambda x: mp.legendre(s, x), mp.mpf(g)) if abs(g) > 1e-3 else mp.mpf(0)
        for g in guesses
    ]
    return [(1 + x) / 2 for x in roots]


def tableau(s):
    """A, b, c: integrals of the Lagrange polynomials."""
    c = nodes(s)
    vandermonde = mp.matrix(s, s)
    for i in range(s):
        for j in range(s):
            vandermonde[j, i] = c[i] ** j
    weights = vandermonde**-1
    moments = [[x ** (j + 1) / (j + 1) for j in range(s)] for x in [*c, mp.mpf(1)]]
    rows = [
        [sum(moment[j] * weights[i, j] for j in range(s)) for i in range(s)] for moment in moments
    ]
    return rows[:-1], rows[-1], c


def number(x):
    """The nearest double, in the fewest digits."""
    return repr(float(x))


def main():
    """Print the file."""
    print("//! Gauss methods: collocation at roots of Legendre polynomials, order 2 s.")
    print("//!")
    print("//! Made by tests/data/gauss_tableaus.py; each number is the exact one rounded once.")
    print("//! Source: Butcher (1964); Hairer, Lubich & Wanner, Geometric Numerical")
    print("//! Integration, II.1.3.")
    print("#![allow(clippy::excessive_precision)]\n")
    print("use super::Tableau;\n")
    for s in STAGES:
        a, b, c = tableau(s)
        print(f"/// Order {2 * s}.")
        print(f"pub const GAUSS{2 * s}: Tableau = Tableau {{")
        print("    a: &[")
        for row in a:
            print(f"        {', '.join(map(number, row))},")
        print("    ],")
        print(f"    b: &[{', '.join(map(number, b))}],")
        print(f"    c: &[{', '.join(map(number, c))}],")
        print("};\n")


if __name__ == "__main__":
    main()
