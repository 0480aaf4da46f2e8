"""Write ``loads.npz``: a free-free beam under a polynomial, a resonant and a decaying load.

``z' = A z + f(t)`` from rest, with A the doubles `spim.StructuralSystem` forms of the mass and the
stiffness, so that the reference knows nothing of their rounding; the loads are stepped along in
one mpmath exponential, whose powers give the states. Run time a few seconds::

    python tests/data/generate_loads.py

Keys: ``mass``, ``stiffness``, ``A``, ``polynomial`` (3, n), ``harmonic`` (n,), ``frequency``,
``phase``, ``exponential`` (n,), ``rate``, ``steps`` (3,), ``counts`` (4,), ``states``
(3, 4, 2 n) and ``velocities`` (3, 4, n), at ``counts[j]`` steps of ``steps[i]``.
"""

from pathlib import Path

import mpmath as mp
import numpy as np
from matrices import doubles, exponential

import spim

DESTINATION = Path(__file__).with_name("loads.npz")
ELEMENTS = 4
COUNTS = (1, 10, 100, 1000)
PERIODS = (0.1, 1.3, 10.7)  # steps in shortest periods
DIGITS = 70


def free_beam():
    """Mass and stiffness of a uniform free-free beam: bending, unit data, (10, 10)."""
    length = 1.0 / ELEMENTS
    K = (
        np.array(
            [
                [12, 6 * length, -12, 6 * length],
                [6 * length, 4 * length**2, -6 * length, 2 * length**2],
                [-12, -6 * length, 12, -6 * length],
                [6 * length, 2 * length**2, -6 * length, 4 * length**2],
            ]
        )
        / length**3
    )
    M = (
        np.array(
            [
                [156, 22 * length, 54, -13 * length],
                [22 * length, 4 * length**2, 13 * length, -3 * length**2],
                [54, 13 * length, 156, -22 * length],
                [-13 * length, -3 * length**2, -22 * length, 4 * length**2],
            ]
        )
        * length
        / 420
    )
    size = 2 * (ELEMENTS + 1)
    mass, stiffness = np.zeros((2, size, size))
    for element in range(ELEMENTS):
        here = slice(2 * element, 2 * element + 4)
        mass[here, here] += M
        stiffness[here, here] += K
    return mass, stiffness


def main():
    """Compute and write."""
    mass, stiffness = free_beam()
    system = spim.StructuralSystem(mass, stiffness)
    n, A = system.dof, system.A
    w = system.modal().frequencies
    polynomial = np.zeros((3, n))
    polynomial[:, 0], polynomial[1, 8] = [1.0, -0.5, 0.125], 0.25
    harmonic, exponential_part = np.zeros(n), np.zeros(n)
    harmonic[4], exponential_part[2] = 2.0, -3.0
    frequency, phase, rate = float(w[2]), 0.375, -0.25
    # g = [1, t, t^2/2, cos, sin, exp]
    B = np.zeros((2 * n, 6))
    B[n:, :3] = (polynomial * np.array([[1.0], [1.0], [2.0]])).T
    B[n:, 3], B[n:, 5] = harmonic, exponential_part
    with mp.workdps(DIGITS):
        start = mp.matrix([0] * (2 * n) + [1, 0, 0, mp.cos(phase), mp.sin(phase), 1])
        whole = mp.zeros(2 * n + 6)
        for i in range(2 * n):
            for j in range(2 * n):
                whole[i, j] = mp.mpf(float(A[i, j]))
            for j in range(6):
                whole[i, 2 * n + j] = mp.mpf(float(B[i, j]))
        one, t, t2, cos, sin, decay = range(2 * n, 2 * n + 6)
        whole[t, one] = whole[t2, t] = 1
        whole[cos, sin], whole[sin, cos] = -mp.mpf(frequency), mp.mpf(frequency)
        whole[decay, decay] = mp.mpf(rate)
    steps = [float(p * 2.0 * np.pi / w[-1]) for p in PERIODS]
    states = np.zeros((len(steps), len(COUNTS), 2 * n))
    velocities = np.zeros((len(steps), len(COUNTS), n))
    for i, step in enumerate(steps):
        with mp.workdps(DIGITS):
            power = exponential(whole * mp.mpf(step), DIGITS)
            for j, _ in enumerate(COUNTS):
                z = power * start
                states[i, j] = doubles(z)[: 2 * n, 0]
                velocities[i, j] = doubles(whole * z)[:n, 0]
                power = power**10
        print(step, flush=True)
    np.savez_compressed(
        DESTINATION,
        mass=mass,
        stiffness=stiffness,
        A=A,
        polynomial=polynomial,
        harmonic=harmonic,
        frequency=frequency,
        phase=phase,
        exponential=exponential_part,
        rate=rate,
        steps=np.array(steps),
        counts=np.array(COUNTS),
        states=states,
        velocities=velocities,
    )


if __name__ == "__main__":
    main()
