"""The methods and what was measured of them: prints ``docs/methods.md``.

python docs/methods.py > docs/methods.md
"""

import spim
from spim._methods import cells, takes

HEAD = """\
# The methods, as they are measured

Made by `make methods`, which measures every method anew (`tests/verify/measured.rs`), writes the
figures to `rust/core/method/measured.csv`, from where `spim.methods()` and `spim methods` have
them, and makes this page. It is to be run after a change of a method and for a new one: what then
differs in the file is what the change does. The suite fails where the file is not what is
measured, to every digit, and where a measured order is not within 0.15 of the stated one. All
columns but *needs*, *stated order*, *symplectic* and *symmetric* are measured.
"""

OPTIONS = """\
## Options

Keyword arguments of `integrate`. Labels and figures above are those of methods without any; those
of `auto` are of linear systems: on others it has those of the method it takes, which
`solution.method` names.
"""

HOW = """\
## How

**On what.** Methods that need a linear system or a structure: two coupled oscillators, M =
diag(1, 2), K = [4 -1; -1 3], from q = (1, -1/2), p = (1/4, 2); `modal`, which takes modes, the
same without the coupling. All others: the system of Hénon and Heiles, from q = (1/10, 0), p =
(1/5, 1/5), an energy of 0.045, below its chaos. Steps of 1/8 at default options, but `pim` and
`spim` without their doublings: with 20 of them as by default nothing but rounding would show.

**Order.** The relative error at the end of runs from four phases, their squares added, over the
step: sixteen steps at most, each smaller by 2^(1/16) than the one before, as small as leaves
errors above 1e-11, and 1200 a run at most. Least squares of log error = c + p log h + a h^2 give
p, the slope in the limit of small steps. The term in h^2 is what slopes of symmetric methods
lack; the errors of order 12 and above reach 1e-11 before it is small (the mere slope of `gauss16`
is 15.7, of `gauss32` 28). Above order 16 there is a term in h^4 as well.

It is measured on

- the oscillators to time 2 for methods of linear systems and structures, beside `auto`;
- an oscillator x'' = -x of amplitude 0.3 in the coordinates q = x, p = x' + x^2 for methods of
  any system and semilinear ones, to time 2, from order 8 on 20: H = ((p - q^2)^2 + q^2)/2 is
  nonlinear, its motion is known;
- the oscillators to time 60 for `gauss12` to `gauss32`, whose linear part is solved within the
  iterations: on nonlinear systems these converge only at steps that are too small for errors of
  order 24 and 32 to be above rounding, and too few for the slope of orders 12 and 16;
- the system of Hénon and Heiles to time 2, from order 10 on 20, for splittings and compositions,
  beside `gauss16` at steps of 1/16.

**Symplectic defect.** The largest entry of W^T J W - J of a step, W its derivative: of linear
systems column by column, of others by differences of order 8, which leave 1e-14.

**Forth and back.** A step, then one of -1/8: the largest difference from the start, of its
largest component.

**Energy.** The largest |E/E0 - 1| over 100 000 steps. *Drift* is the change of the mean of E/E0 -
1 from the first tenth of the steps to the last: of a symplectic method far less than the error,
which comes and goes; of others most of it.

**Cost.** Counts a step, not times, which are in `benches/RESULTS.md`: *evaluations* of the right
side, those of iterations and starts with them, over the same 100 000 steps; *products* of a
matrix and a block of states, of which linear methods make one in 64 steps. Products with
exponentials within steps of semilinear methods are not counted, nor are solves.
"""


def table(head, rows):
    """Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page():
    """All of it."""
    head = ["method", "needs", "stated order", "order", "symplectic", "defect"]
    head += ["symmetric", "forth and back", "energy error", "drift", "evaluations", "products"]
    rows = []
    for method in spim.methods():
        order, symplectic, back, *rest = cells(method)
        stated = "exact" if method.order is None else str(method.order)
        says = ["yes" if label else "no" for label in (method.symplectic, method.symmetric)]
        labels = [f"`{method.name}`", method.needs, stated, order]
        rows.append([*labels, says[0], symplectic, says[1], back, *rest])
    options = [
        [f"`{name}`", ", ".join(f"`{method}`" for method in names), doc]
        for name, names, doc in takes(spim.methods())
    ]
    listed = table(["option", "of", "what it does"], options)
    return f"{HEAD}\n{table(head, rows)}\n\n{OPTIONS}\n{listed}\n\n{HOW}"


if __name__ == "__main__":
    print(page(), end="")
