"""The paper's pendulum for the benches: numbers, runs, and the state at the end."""

import math
import warnings

import numpy as np
from _peers import heyoka_run, longest, missing

import spim

SPAN = 10.0
START = (0.1, math.pi / 6.0, 0.0, 0.0)
FORMS = ("canonical", "velocities")

# Of steps that can resonate: errors are measured here.
warnings.filterwarnings("ignore", message=".*steps can resonate")


def constants():
    """Numbers of the model: inertia, bead mass, distance at rest, stiffness, gravity, M L/2."""
    M, L, m, k, g = 1.0, 1.0, 0.1, 100.0, 9.81914
    real = longest() if missing("heyoka") is None else float
    M, L, m, k, g = map(real, (M, L, m, k, g))
    return M * L * L / 3, m, L + m * g / k, k, g, M * L / 2


def linear():
    """The linear part at rest, (4, 4)."""
    inertia, m, rest, k, g, arm = (float(value) for value in constants())
    A = np.zeros((4, 4))
    A[0, 2], A[1, 3] = 1.0 / m, 1.0 / (inertia + m * rest * rest)
    A[2, 0], A[3, 1] = -k, -(arm + m * rest) * g
    return A


def taylor(form, tolerance, real=float, **options):
    """A run with heyoka, in canonical variables or with velocities."""
    import heyoka as hy

    inertia, m, rest, k, g, arm = (hy.expression(real(v)) for v in constants())
    x, theta = hy.make_vars("x", "theta")
    bead = rest + x
    sin, cos = hy.sin(theta), hy.cos(theta)
    if form == "canonical":
        px, ptheta = hy.make_vars("px", "ptheta")
        rate = ptheta / (inertia + m * bead * bead)
        system = [
            (x, px / m),
            (theta, rate),
            (px, m * bead * rate * rate - k * x - m * g * (1.0 - cos)),
            (ptheta, -(arm + m * bead) * g * sin),
        ]
        return heyoka_run(system, START, SPAN, tolerance, None, real, **options)
    v, rate = hy.make_vars("v", "rate")
    system = [
        (x, v),
        (theta, rate),
        (v, bead * rate * rate - k / m * x - g * (1.0 - cos)),
        (
            rate,
            -((arm + m * bead) * g * sin + 2.0 * m * bead * v * rate) / (inertia + m * bead * bead),
        ),
    ]
    numbers = [float(value) for value in constants()]

    def canonical(z):
        inertia, m, rest = numbers[:3]
        x, theta, v, rate = z
        return np.array([x, theta, m * v, (inertia + m * (rest + x) ** 2) * rate])

    return heyoka_run(system, START, SPAN, tolerance, canonical, real, **options)


def ours(method, steps, system=None, **options):
    """A run with spim as a function."""
    system = spim.models.CompoundPendulum() if system is None else system

    def run():
        solution = spim.integrate(
            system, START, (0.0, SPAN), SPAN / steps, method=method, every=steps, **options
        )
        return solution.z[-1]

    return run


def reference():
    """The state at the end, and how it was found."""
    own = ours("gauss32", 400)()
    if missing("heyoka"):
        return own, "spim's gauss32 in 400 steps"
    real = longest()
    eps = np.finfo(real).eps
    right = taylor("canonical", eps, real, compact_mode=True, high_accuracy=True)[0]()
    apart = float(np.abs(own - right).max())
    assert apart <= 1e-14, apart
    return right, f"heyoka with eps = {eps:.0e}, {apart:.0e} from gauss32 in 400 steps"
