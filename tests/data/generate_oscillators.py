"""Write ``oscillators.npz``: exact states of linear Hamiltonian systems on a time grid.

``z_k = exp(k tau H) z_0`` of the doubles H, tau and z_0 as stored (``k tau H`` is the exact
product), in mpmath with at least 60 digits, until 30 more digits change no bit. States are
stored as ``hi`` (correctly rounded) and ``lo`` (the double nearest to what remains). Run
time 1 s on one core::

    python tests/data/generate_oscillators.py

Runs, each with the keys ``<run>_H`` (m, m), ``_tau``, ``_z0`` (m,), ``_k`` (steps,),
``_hi``, ``_lo`` (steps, m), states ``z = [q; p]``:

- ``study_coarse``, ``study_fine``: the paper's three oscillators (6.2), 0-2 s,
  tau = 0.05 and 0.01, every step.
- ``oscillators``: the same system, tau = 1 s, steps up to 2^20.
- ``beam``: the paper's cantilever, 3 elements, raw coordinates, ``tau w_max = 4000``.
- ``hyperbolic``: one unstable and one stable mode, coupled; grows by 1e200 in 1e6 steps.
"""

from pathlib import Path

import mpmath as mp
import numpy as np
from matrices import (
    LENGTH,
    cantilever,
    cantilever_hamiltonian,
    doubles,
    exponential,
    oscillators,
    settled,
    structural,
    uniform,
)

DESTINATION = Path(__file__).with_name("oscillators.npz")
DIGITS = 60
MILLION = 10**6
Z0 = np.array([0.0, 0.0, 0.0, 2.0, 2.0, 2.0])


def oscillator_states(H, tau, z0, steps):
    """States of uncoupled oscillators ``H = [[0, diag(g)], [-diag(k), 0]]``, closed form.

    Returns
    -------
    callable
        ``compute(digits)``, the states as an mpmath matrix (steps, 2n).
    """

    def compute(digits):
        n = len(z0) // 2
        states = mp.zeros(len(steps), 2 * n)
        for i in range(n):
            g, k = mp.mpf(H[i, n + i]), mp.mpf(-H[n + i, i])
            q, p = mp.mpf(z0[i]), mp.mpf(z0[n + i])
            w = mp.sqrt(g * k)
            for row, step in enumerate(steps):
                cos, sin = mp.cos_sin(w * int(step) * mp.mpf(tau))
                states[row, i] = q * cos + p * (g / w) * sin
                states[row, n + i] = p * cos - q * (k / w) * sin
        return states

    return compute


def matrix_states(H, tau, z0, steps):
    """States by binary powers of ``exp(tau H)``; returns as `oscillator_states`."""

    def compute(digits):
        power = exponential(mp.matrix(H.tolist()) * mp.mpf(tau), digits)
        states = [mp.matrix(z0.tolist()) for _ in steps]
        for bit in range(int(max(steps)).bit_length()):
            for row, step in enumerate(steps):
                if int(step) >> bit & 1:
                    states[row] = power * states[row]
            power = power * power
        return mp.matrix([list(state) for state in states])

    return compute


def bent_beam(elements):
    """Stretched and bent, swinging on: ``u = 1 cm``, ``v = 0.5 m``, ``v' = 2 m/s`` at the tip."""
    M, _ = cantilever(elements)
    q, rate = [], []
    for node in range(1, elements + 1):
        x = mp.mpf(node) / elements
        q += [x / 100, x**2 / 2, x / LENGTH]
        rate += [x / 10, 2 * x**2, 4 * x / LENGTH]
    return doubles(mp.matrix(q)).ravel(), doubles(M * mp.matrix(rate)).ravel()


def saddle():
    """Two coupled dofs, one on a hill: H and the tau that gives a growth of 1e200."""
    H = structural(np.array([[1.0, 0.25], [0.25, 0.5]]), np.array([[-1.0, 0.3], [0.3, 40.0]]))
    with mp.workdps(DIGITS):
        rate = max(mp.re(value) for value in mp.eig(mp.matrix(H.tolist()))[0])
        return H, float(200 * mp.log(10) / (MILLION * rate))


def runs():
    """Yield (run, how, H, tau, z0, steps)."""
    H = oscillators()
    yield "study_coarse", oscillator_states, H, 0.05, Z0, np.arange(41)
    yield "study_fine", oscillator_states, H, 0.01, Z0, np.arange(201)
    chosen = [10**i for i in range(7)] + [2**20]
    random = ((uniform(8000, 50) + 1.0) / 2 * MILLION).astype(int) + 1
    yield "oscillators", oscillator_states, H, 1.0, Z0, np.unique([*chosen, *random])
    H, w_max = cantilever_hamiltonian(3, "raw")
    steps = np.array([1, 1000, 10**5, 2**19, MILLION])
    yield "beam", matrix_states, H, 4000.0 / w_max, np.concatenate(bent_beam(3)), steps
    H, tau = saddle()
    steps = np.array([1000, 10**5, 5 * 10**5, MILLION])
    yield "hyperbolic", matrix_states, H, tau, np.array([1.0, -0.5, 0.25, 2.0]), steps


def main():
    arrays = {}
    for run, how, H, tau, z0, steps in runs():
        hi, lo, digits = settled(how(H, tau, z0, steps), DIGITS)
        run_arrays = {"H": H, "tau": tau, "z0": z0, "k": steps, "hi": hi, "lo": lo}
        arrays |= {f"{run}_{key}": value for key, value in run_arrays.items()}
        largest = np.abs(hi).max()
        print(f"{run:13s} {len(steps):3d} states, {digits} digits, largest {largest:.3g}")
    np.savez_compressed(DESTINATION, **arrays)
    print(f"{DESTINATION.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
