"""Systems of every structure that methods know, small and quick."""

import numpy as np
from beams import kane

import spim
from spim import models

M, K = np.diag([2.0, 1.0, 0.5]), np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
C = spim.damping.rayleigh(M, K, alpha=0.1, beta=0.01)
A = np.array([[0.0, 1.0, 0.2, 0], [-1, 0, 0, 0.1], [0.3, 0, -0.1, 1], [0, -0.2, -2, 0]])


def _load(t):
    return [np.sin(t * t), 0.0, 1.0]


def cubic(t, z):
    return np.array([0.0, 0.0, -0.2 * z[0] ** 3 + 0.1 * np.sin(t), -0.1 * z[1] ** 3])


def gradient(t, z):
    return [np.sin(z[0]) + 0.1 * np.cos(t), z[1]]


def _tip_force(t, z):
    return 0.1 * np.cos(t), 0.2


def force(t, q):
    return -q - 0.1 * q**3 + 0.1 * np.cos(t)


RECORD = np.random.default_rng(1).normal(size=(800, 3))
FREE = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(2))
LOADS = {
    "free": None,
    "harmonic": spim.loads.Harmonic([1.0, 0.0, 2.0], 3.0, 0.5),
    "record": spim.loads.Sampled(RECORD, 0.05),
    "uneven": spim.loads.Sampled(RECORD, 0.013),
    "function": spim.loads.Function(_load),
}


def every():
    """Pairs of a system and a state, by name."""
    found = {
        "linear": (spim.LinearSystem(A), [1.0, 0.5, -0.2, 0.1]),
        "undamped": (spim.StructuralSystem(M, K), [0.1, 0.0, -0.1, 0.0, 1.0, 0.0]),
        "semilinear": (spim.SemilinearSystem(FREE, cubic), [1.0, -0.5, 0.3, 0.2]),
        "separable": (spim.SeparableSystem(force, mass=[1.0, 2.0]), [1.0, 0.0, 0.0, 0.5]),
        "hamiltonian": (spim.HamiltonianSystem(1, gradient), [1.0, 0.3]),
        "henon_heiles": (models.HenonHeiles(), [0.1, 0.2, 0.3, 0.1]),
        "kepler": (models.Kepler(), [0.7, 0.0, 0.0, 1.3]),
    }
    for name, load in LOADS.items():
        structure = spim.StructuralSystem(M, K, damping=C, load=load)
        found[f"structure, {name}"] = structure, structure.state(q=[0.1, 0, 0], v=[0, 0.3, 0])
    section = models.DistributedSection(1.2, 2.8e5, 1.4e3)
    free = models.RotatingBeam(length=2.0, section=section, elements=3, hub_inertia=1.0)
    found["beam, free hub"] = free, free.state(v=lambda x: 0.01 * x**2, omega=0.5)
    driven = kane(elements=3, damping=(0.1, 1e-4), tip_force=_tip_force)
    found["beam, driven"] = driven, driven.state(v=lambda x: 1e-4 * x**2)
    return found


def step_of(name):
    """A step for the system of this name."""
    return 4e-4 if name.startswith("beam") else 0.05


def cases():
    """System, state, step and name of a method, for whatever goes together."""
    for name, (system, z0) in every().items():
        for method in spim.methods():
            h = step_of(name)
            options = {"a": [[0.5]], "b": [1.0]} if method.name == "runge_kutta" else {}
            given = {"method": spim.RungeKutta(**options) if options else method.name}
            try:
                spim.integrate(system, z0, (0.0, h), h, **given)
            except spim.UnsupportedError:
                continue
            yield name, method.name, system, z0, h, given
