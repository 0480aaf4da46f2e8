"""A beam in free flight: rigid modes, a thrust, a resonance, all exact for any step."""

import numpy as np

import spim

ELEMENTS = 6
h = 1.0 / ELEMENTS
k = (
    np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h * h, -6 * h, 2 * h * h],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h * h, -6 * h, 4 * h * h],
        ]
    )
    / h**3
)
m = (
    h
    / 420
    * np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    )
)
n = 2 * (ELEMENTS + 1)
M, K = np.zeros((2, n, n))
for element in range(ELEMENTS):
    here = slice(2 * element, 2 * element + 4)
    M[here, here] += m
    K[here, here] += k

w = spim.StructuralSystem(M, K).modal().frequencies
print(f"frequencies: {np.array2string(w[:5], precision=3)} rad/s: two rigid modes")
thrust, shake = np.zeros(n), np.zeros(n)
thrust[0], shake[n // 2 - 1] = 0.1, 1.0
load = spim.loads.Polynomial([thrust]) + spim.loads.Harmonic(shake, w[2])
beam = spim.StructuralSystem(M, K, load=load)
shortest = 2.0 * np.pi / w[-1]
for periods in (0.1, 1.0, 10.0):
    step = 100 * shortest / round(100 / periods)
    run = spim.integrate(beam, beam.state(), (0.0, 100 * shortest), step, correction="exact")
    print(
        f"step {periods:4.1f} shortest periods: ends at {run.q[-1, 0]:.15f}, {run.q[-1, -2]:.15f} m"
    )
