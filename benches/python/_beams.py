"""Euler-Bernoulli beams of several benches."""

import numpy as np


def beam(elements, free=False):
    """Mass and stiffness of a uniform beam of unit length, clamped at its left end or free."""
    h = 1.0 / elements
    units = np.array([1.0, h, 1.0, h])
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    size = 2 * (elements + 1)
    M, K = np.zeros((2, size, size))
    for element in range(elements):
        here = slice(2 * element, 2 * element + 4)
        M[here, here] += h / 420.0 * units[:, None] * m * units
        K[here, here] += units[:, None] * k * units / h**3
    return (M, K) if free else (M[2:, 2:], K[2:, 2:])
