"""Write ``rust/core/expm/coefficients.rs``: coefficients and thresholds of the exponential.

Derived in mpmath with 100 digits. Run time 10 s on one core::

    python tests/data/generate_coefficients.py           # write the file
    python tests/data/generate_coefficients.py --check   # exit 1 if the file differs

- ``TAYLOR8``, ``SID15``, ``SID21``, the polynomial schemes of 3, 4 and 5 products: their
  coefficients solve "the terms of degree 2, 3, ... are 1/k!" (TAYLOR8: from 3), by Newton's
  method from the published 16 digits; stored as pairs of doubles.
- ``THETA_...``: the norms up to which these schemes and the Taylor polynomial of degree 4 need
  no scaling, by truncation error and backward error relative to the norm of the matrix.
- ``PADE_THETA``: the same for Pade approximants, by the backward error.

Sources: Sastre, Linear Algebra Appl. 539 (2018) for TAYLOR8; Sastre, Ibanez & Defez, Appl. Math.
Comput. 340 (2019) 206-220 for SID15 and SID21; Higham, SIAM J. Matrix Anal. Appl. 26 (2005) for
the backward error.
"""

import argparse
import sys
from decimal import Decimal
from pathlib import Path

from mpmath import factorial, floor, inf, log10, lu_solve, matrix, mp, mpf, norm, sqrt

mp.dps = 100
DESTINATION = Path(__file__).resolve().parents[2] / "rust/core/expm/coefficients.rs"
WIDTH = 100  # of a line of Rust
LAST_DEGREE = 60  # of a truncation error
SERIES_TERMS = 150  # of a backward error
HIGHEST_PADE = 13
LARGEST_PADE_THETA = mpf("4.25")  # Al-Mohy & Higham (2009): the denominator stays well conditioned

TAYLOR8_START = """
    4.980119205559973e-3 1.992047682223989e-2 7.665265321119147e-2 8.765009801785554e-1
    1.225521150112075e-1 2.974307204847627
"""
SID15_START = """
    4.018761610201036e-4 2.945531440279683e-3 -8.709066576837676e-3 4.017568440673568e-1
    3.230762888122312e-2 5.768988513026145 2.338576034271299e-2 2.381070373870987e-1
    2.224209172496374 -5.792361707073261 -4.130276365929783e-2 10.40801735231354
    -63.31712455883370 3.484665863364574e-1
"""
SID21_START = """
    1.161658834444880e-6 4.500852739573010e-6 5.374708803114821e-5 2.005403977292901e-3
    6.974348269544424e-2 9.418613214806352e-1 2.852960512714315e-3 -7.544837153586671e-3
    1.829773504500424 3.151382711608315e-2 1.392249143769798e-1 -2.269101241269351e-3
    -5.394098846866402e-2 3.112216227982407e-1 9.343851261938047 6.865706355662834e-1
    3.233370163085380 -5.726379787260966 -1.413550099309667e-2 -1.638413114712016e-1
"""


class Polynomial:
    """A polynomial by its terms: coefficients from degree 0 upwards."""

    def __init__(self, terms):
        self.terms = list(terms)

    def __add__(self, other):
        size = max(len(self.terms), len(other.terms))
        a, b = (p.terms + [mpf(0)] * (size - len(p.terms)) for p in (self, other))
        return Polynomial(x + y for x, y in zip(a, b, strict=True))

    def __mul__(self, other):
        product = [mpf(0)] * (len(self.terms) + len(other.terms) - 1)
        for i, x in enumerate(self.terms):
            for j, y in enumerate(other.terms):
                product[i + j] += x * y
        return Polynomial(product)

    def __rmul__(self, scalar):
        return Polynomial(scalar * x for x in self.terms)

    def derivative(self):
        return Polynomial([k * x for k, x in enumerate(self.terms)][1:] or [mpf(0)])


A, A2, A3 = (Polynomial([mpf(0)] * k + [mpf(1)]) for k in (1, 2, 3))


def taylor8(c1, c2, c3, c4, c5, c6):
    """The scheme of degree 8 in 3 products; exact."""
    y0 = A2 * (c1 * A2 + c2 * A)
    return (y0 + c3 * A2 + c4 * A) * (y0 + c5 * A2) + c6 * y0 + mpf(1) / 2 * A2 + A


def sid15(c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13, c14):
    """The scheme 15+ in 4 products: of degree 16, right through degree 15."""
    y0 = A2 * (c1 * A2 + c2 * A)
    y1 = (y0 + c3 * A2 + c4 * A) * (y0 + c5 * A2) + c6 * y0 + c7 * A2
    left, right = y1 + c8 * A2 + c9 * A, y1 + c10 * y0 + c11 * A
    return left * right + c12 * y1 + c13 * y0 + c14 * A2 + A


def sid21(
    c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13, c14, c15, c16, c17, c18, c19, c20
):
    """The scheme 21+ in 5 products: of degree 24, right through degree 21."""
    y0 = A3 * (c1 * A3 + c2 * A2 + c3 * A)
    y1 = (y0 + c4 * A3 + c5 * A2 + c6 * A) * (y0 + c7 * A3 + c8 * A2)
    y1 = y1 + c9 * y0 + c10 * A3 + c11 * A2
    left, right = y1 + c12 * A3 + c13 * A2 + c14 * A, y1 + c15 * y0 + c16 * A
    return left * right + c17 * y1 + c18 * y0 + c19 * A3 + c20 * A2 + A


def solve(scheme, start, order):
    """Coefficients for which the terms of ``scheme`` through degree ``order`` are those of exp.

    As many equations, of the highest degrees, as unknowns; the lower terms are right by form.
    Central differences leave the Jacobian good to two thirds of the digits, so that Newton's
    method still ends at full precision.
    """
    c = matrix([mpf(x) for x in start.split()])
    degrees = range(order + 1 - len(c), order + 1)

    def residual(c):
        terms = scheme(*c).terms
        return matrix([factorial(k) * terms[k] - 1 for k in degrees])

    step = mpf(10) ** (-mp.dps // 3)
    for _ in range(20):
        jacobian = matrix(len(c), len(c))
        for j in range(len(c)):
            ahead, behind = c.copy(), c.copy()
            ahead[j] += step
            behind[j] -= step
            jacobian[:, j] = (residual(ahead) - residual(behind)) / (2 * step)
        change = lu_solve(jacobian, residual(c))
        c -= change
        if norm(change, inf) < mpf(10) ** (-0.8 * mp.dps):
            return list(c)
    raise ArithmeticError(f"{scheme.__name__}: Newton's method did not converge")


def largest_theta(errors, eps):
    """Largest theta with ``sum |errors[k]| theta^(k-1) <= eps``, by bisection of its logarithm."""
    low, high = mpf("1e-20"), mpf(64)
    for _ in range(64):
        theta = sqrt(low * high)
        if sum(abs(e) * theta ** (k - 1) for k, e in errors.items()) <= eps:
            low = theta
        else:
            high = theta
    return low


def truncation_theta(terms, order, eps):
    """Threshold of a polynomial by its truncation error; right through degree ``order``."""
    terms = terms + [mpf(0)] * (LAST_DEGREE + 1 - len(terms))
    degrees = range(order + 1, LAST_DEGREE + 1)
    return largest_theta({k: terms[k] - 1 / factorial(k) for k in degrees}, eps)


def backward_theta(p, q, order, eps):
    """Threshold of ``r = p/q``, right through degree ``order``, by ``log(exp(-x) r(x))``.

    Its derivative is ``(p' q - p q' - p q) / (p q)``, the numerator without terms below ``order``:
    these are left out, and nothing cancels.
    """
    p, q = Polynomial(p), Polynomial(q)
    product = (p * q).terms
    numerator = (p.derivative() * q + (-1) * (p * (q.derivative() + q))).terms
    inverse = [1 / product[0]]  # of the power series
    for k in range(1, SERIES_TERMS):
        known = sum(x * inverse[k - i] for i, x in enumerate(product[1 : k + 1], 1))
        inverse.append(-known / product[0])
    errors = {}
    for k in range(order, SERIES_TERMS):
        used = range(order, min(k + 1, len(numerator)))
        errors[k + 1] = sum(numerator[i] * inverse[k - i] for i in used) / (k + 1)
    return largest_theta(errors, eps)


def pade_theta(above, below, eps):
    """Threshold of the Pade approximant [above/below]; 0 for the constant [0/0]."""

    def terms(own, other, sign):
        total = own + other
        return [
            sign**j * factorial(total - j) * factorial(own)
            / (factorial(total) * factorial(j) * factorial(own - j))
            for j in range(own + 1)
        ]  # fmt: skip

    if above == below == 0:
        return mpf(0)
    p, q = terms(above, below, 1), terms(below, above, -1)
    return min(LARGEST_PADE_THETA, backward_theta(p, q, above + below, eps))


def double(x):
    """The double nearest to ``x``."""
    return float(mpf(x, prec=53, rounding="n"))


def literal(x):
    """Shortest literal that reads back as the double ``x``."""
    return repr(x) if x == 0 or abs(x) >= 0.1 else f"{Decimal(repr(x)):e}"


def pair(x):
    """``[hi, lo]``: the double nearest to ``x``, the double nearest to the rest."""
    hi = double(x)
    return f"[{literal(hi)}, {literal(double(x - hi))}]"


def rounded_down(theta):
    """Literal of ``theta`` rounded down to four digits."""
    exponent = int(floor(log10(theta))) - 3 if theta else 0
    return literal(float(f"{int(floor(theta / mpf(10) ** exponent))}e{exponent}"))


def array(items, indent=""):
    """``[items]`` in the layout of rustfmt, for a line that ends with one more character."""
    line = f"[{', '.join(items)}]"
    if len(indent) + len(line) < WIDTH:
        return line
    lines = [f"{indent}    {items[0]},"]
    for item in items[1:]:
        if len(lines[-1]) + len(item) + 2 < WIDTH:
            lines[-1] += f" {item},"
        else:
            lines.append(f"{indent}    {item},")
    return "\n".join(["[", *lines, f"{indent}]"])


def constant(doc, name, kind, value):
    """A documented Rust constant."""
    return f"\n/// {doc}\npub const {name}: {kind} = {value};\n"


def table(doc, name, columns, rows):
    """A documented constant of several rows."""
    lines = "".join(f"    {row},\n" for row in rows)
    return constant(doc, name, f"[[f64; {columns}]; {len(rows)}]", f"[\n{lines}]")


def render():
    """Text of the Rust file."""
    text = HEADER
    schemes = {"TAYLOR4": ([1 / factorial(k) for k in range(5)], 4)}
    for name, what, scheme, start, order in (
        ("TAYLOR8", "the Taylor polynomial of degree 8 in 3 products", taylor8, TAYLOR8_START, 8),
        ("SID15", "the scheme 15+ in 4 products", sid15, SID15_START, 15),
        ("SID21", "the scheme 21+ in 5 products", sid21, SID21_START, 21),
    ):
        c = solve(scheme, start, order)
        schemes[name] = scheme(*c).terms, order
        doc = f"`c1, c2, ...` of {what}, each as `[hi, lo]`."
        text += table(doc, name, 2, [pair(x) for x in c])
    for name, suffix, bits, doc in (
        ("TAYLOR4", "", 53, "the Taylor polynomial of degree 4 in double"),
        ("TAYLOR8", "", 53, "[`TAYLOR8`] in double"),
        ("SID15", "", 53, "[`SID15`] in double"),
        ("SID21", "", 53, "[`SID21`] in double"),
        ("SID21", "_PAIR", 78, "[`SID21`] for correctly rounded results"),
        ("SID21", "_DOUBLE_PAIR", 106, "[`SID21`] for results right to the last bit of a pair"),
    ):
        terms, order = schemes[name]
        eps = mpf(2) ** -bits
        backward = backward_theta([1, *terms[1:]], [1], order, eps)
        theta = rounded_down(min(truncation_theta(terms, order, eps), backward))
        doc = f"Threshold of {doc}: `eps = 2^-{bits}`."
        text += constant(doc, f"THETA_{name}{suffix}", "f64", theta)
    eps = mpf(2) ** -53
    degrees = range(HIGHEST_PADE + 1)
    rows = [[rounded_down(pade_theta(above, below, eps)) for below in degrees] for above in degrees]
    rows = [array(row, " " * 4) for row in rows]
    return text + table(PADE_DOC, "PADE_THETA", HIGHEST_PADE + 1, rows)


HEADER = """\
//! Coefficients and thresholds of the polynomial and rational schemes for the exponential.
//!
//! Generated by `tests/data/generate_coefficients.py`, which derives every number in
//! multiprecision: change that script, not this file.
//!
//! The coefficients of the polynomial schemes are pairs `[hi, lo]`: the double nearest, and the
//! double nearest to the rest. A scheme `T(x) = sum of t_k x^k` needs no scaling up to its
//! threshold: there both its truncation error, `sum of |t_k - 1/k!| theta^(k-1)`, and its backward
//! error, with the terms of `log(exp(-x) (1 + T(x)))`, are at most `eps` relative to the norm of
//! the matrix. Thresholds are rounded down to four digits.
//!
//! Sources: Sastre, Linear Algebra Appl. 539 (2018) for the polynomial of degree 8; Sastre, Ibáñez
//! & Defez, Appl. Math. Comput. 340 (2019) 206-220 for 15+ and 21+; Higham, SIAM J. Matrix Anal.
//! Appl. 26 (2005) for the thresholds of the Padé approximants.
"""

PADE_DOC = """\
`PADE_THETA[l][m]`: threshold of the Padé approximant `[l/m]`, numerator of degree `l`.
///
/// With the backward error `log(exp(-x) r(x)) = sum of c_k x^k`, the largest `theta` with
/// `sum of |c_k| theta^(k-1) <= 2^-53`, at most 4.25. `[0][0]` is unused."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="only compare with the file")
    check = parser.parse_args().check
    text = render()
    if not check:
        DESTINATION.write_text(text, encoding="utf-8")
    elif DESTINATION.read_text(encoding="utf-8") != text:
        sys.exit(f"{DESTINATION} is out of date: run {Path(__file__).name}")


if __name__ == "__main__":
    main()
