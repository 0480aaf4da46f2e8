"""Finite elements of a beam: linear along it, cubic across it.

All integrals by six Gauss points an element: exact for linear tapers, whose mass is of second and
whose stiffness of fourth degree in x (Huang, Deng & Yao 2007, eqs. 4-14).
"""

import numpy as np

POINTS = 6


def rule():
    """Gauss points in (0, 1) and weights, (2, 6)."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    return np.array([0.5 * (1.0 + nodes), 0.5 * weights])


def shapes(x, length):
    """Shape functions at parts x of an element: axial (..., 2); transverse and slopes (..., 4)."""
    one = np.ones_like(x)
    axial = np.stack([1.0 - x, x], -1)
    transverse = np.stack(
        [
            1.0 - 3.0 * x**2 + 2.0 * x**3,
            length * (x - 2.0 * x**2 + x**3),
            3.0 * x**2 - 2.0 * x**3,
            length * (x**3 - x**2),
        ],
        -1,
    )
    slopes = np.stack(
        [
            6.0 * (x**2 - x) / length,
            one - 4.0 * x + 3.0 * x**2,
            6.0 * (x - x**2) / length,
            3.0 * x**2 - 2.0 * x,
        ],
        -1,
    )
    return axial, transverse, slopes


def curvatures(x, length):
    """Second derivatives of the transverse shape functions, (..., 4)."""
    return np.stack(
        [
            (12.0 * x - 6.0) / length**2,
            (6.0 * x - 4.0) / length,
            (6.0 - 12.0 * x) / length**2,
            (6.0 * x - 2.0) / length,
        ],
        -1,
    )


def elements(section, length, count, tip_mass, tip_inertia):
    """Arrays of the elements, as `spim._core.RotatingBeam` takes them."""
    l = length / count
    points, weights = rule()
    begins = l * np.arange(count)[:, None]
    x = begins + l * points
    mass = section.mass(x, length)
    dm = l * weights * mass
    axial, transverse, slopes = shapes(points, l)

    def outboard(power):
        """``integral of s^power dm`` from each Gauss point to the tip, tip mass included."""
        whole = (dm * x**power).sum(axis=1)
        beyond = np.cumsum(whole[::-1])[::-1] - whole + tip_mass * length**power
        # From the point to the end of its element.
        rest = begins[..., None] + l * (points[:, None] + (1.0 - points[:, None]) * points)
        part = l * (1.0 - points[:, None]) * weights * section.mass(rest, length) * rest**power
        return part.sum(axis=-1) + beyond[:, None]

    def products(factor, a, b):
        return np.einsum("eg,gi,gj->eij", factor, a, b)

    arrays = {
        "axial_mass": products(dm, axial, axial),
        "bending_mass": products(dm, transverse, transverse),
        "gyroscopic": products(dm, axial, transverse),
        "shortening": products(l * weights * outboard(0), slopes, slopes),
        "pull": products(l * weights * outboard(1), slopes, slopes),
        "axial": dm @ axial,
        "axial_moment": (dm * x) @ axial,
        "bending": dm @ transverse,
        "bending_moment": (dm * x) @ transverse,
        "axial_stiffness": section.axial(x, length) @ weights,
        "bending_stiffness": section.bending(x, length),
    }
    # The tip: a mass with rotary inertia.
    arrays["axial_mass"][-1, 1, 1] += tip_mass
    arrays["bending_mass"][-1, 2, 2] += tip_mass
    arrays["bending_mass"][-1, 3, 3] += tip_inertia
    arrays["gyroscopic"][-1, 1, 2] += tip_mass
    arrays["axial"][-1, 1] += tip_mass
    arrays["axial_moment"][-1, 1] += tip_mass * length
    arrays["bending"][-1, 2] += tip_mass
    arrays["bending_moment"][-1, 2] += tip_mass * length
    arrays["bending_moment"][-1, 3] += tip_inertia
    moments = [(dm * x**power).sum() + tip_mass * length**power for power in range(3)]
    moments[2] += tip_inertia
    return arrays, np.array(moments)


def assembled(blocks, rows, columns):
    """Global matrix of element matrices, without the clamped node.

    `rows`, `columns`: which of (u, v, theta) of its two nodes an element's rows and columns are.
    """
    count = len(blocks)
    whole = np.zeros((3 * (count + 1),) * 2)
    for e, block in enumerate(blocks):
        whole[np.ix_(3 * e + np.array(rows), 3 * e + np.array(columns))] += block
    return whole[3:, 3:]


# Places of an element's coordinates among (u1, v1, theta1, u2, v2, theta2).
AXIAL, BENDING = (0, 3), (1, 2, 4, 5)


def matrices(arrays, length, flap=None):
    """M, G, K, D0, D1, and vectors along and across, of all degrees of freedom but the clamped."""
    count = len(arrays["axial"])
    l = length / count
    points, weights = rule()
    bent = curvatures(points, l)
    bending = arrays["bending_stiffness"] if flap is None else flap
    stiffness = np.einsum("eg,gi,gj->eij", l * weights * bending, bent, bent)
    ends = np.array([[1.0, -1.0], [-1.0, 1.0]])
    axial_stiffness = arrays["axial_stiffness"][:, None, None] / l * ends
    gyroscopic = assembled(arrays["gyroscopic"], AXIAL, BENDING)

    def vector(name, places):
        whole = np.zeros(3 * (count + 1))
        for e, part in enumerate(arrays[name]):
            whole[3 * e + np.array(places)] += part
        return whole[3:]

    return {
        "M": assembled(arrays["axial_mass"], AXIAL, AXIAL)
        + assembled(arrays["bending_mass"], BENDING, BENDING),
        "G": gyroscopic - gyroscopic.T,
        "K": assembled(axial_stiffness, AXIAL, AXIAL) + assembled(stiffness, BENDING, BENDING),
        "D0": assembled(arrays["shortening"], BENDING, BENDING),
        "D1": assembled(arrays["pull"], BENDING, BENDING),
        "s_u": vector("axial", AXIAL),
        "a_u": vector("axial_moment", AXIAL),
        "s_v": vector("bending", BENDING),
        "a_v": vector("bending_moment", BENDING),
    }
