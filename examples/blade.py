"""A blade with stiffness-proportional damping: explicit steps end below a millisecond."""

import time

import numpy as np

import spim

ELEMENTS = 12
n = ELEMENTS
# A tapering chain of bending stiffness: flap of a blade, tip free.
taper = np.linspace(1.0, 0.2, n + 1)
curvature = np.zeros((n, n + 1))
for i in range(n):
    curvature[i, max(i - 1, 0)] += 1.0
    curvature[i, i] += -2.0 if i else -1.0
    curvature[i, i + 1] += 1.0
K = curvature.T @ (4e6 * np.diag(taper[1:])) @ curvature
K, M = K[1:, 1:], np.diag(60.0 * taper[1:])
K[0, 0] += 1e7
C = spim.damping.rayleigh(M, K, alpha=0.0, beta=5e-3)

free = spim.StructuralSystem(M, K, damping=C)
modes = free.modal()
print(
    f"frequencies {modes.frequencies[0]:.2f} .. {modes.frequencies[-1]:.0f} rad/s, "
    f"damping ratios {modes.damping_ratios[0]:.3f} .. {modes.damping_ratios[-1]:.2f}"
)
gust = spim.loads.Polynomial([500.0 * taper[1:]]) * (
    spim.loads.Polynomial([1.0]) - spim.loads.Harmonic([1.0], 2.0)
)
blade = spim.StructuralSystem(M, K, damping=C, load=gust)
# Explicit methods are bound to the fastest decay, 2 zeta w.
bound = 2.785 / np.abs(np.linalg.eigvals(blade.A)).max()
print(f"RK4 is stable to a step of {bound:.1e} s")
for step in (0.1, 0.01):
    start = time.perf_counter()
    run = spim.integrate(blade, blade.state(), (0.0, 10.0), step)
    seconds = time.perf_counter() - start
    print(f"step {step:g} s: tip at {run.q[-1, -1]:.12f} m after 10 s, {1e3 * seconds:.1f} ms")
