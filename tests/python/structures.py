"""Structures that several tests take."""

import numpy as np


def chain(n):
    """Equal masses and springs between two walls."""
    return np.eye(n), 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def beam(elements, free=False):
    """Euler-Bernoulli elements of unit length in all; graded as structures are."""
    size = 1.0 / elements
    x = np.diag([1.0, size, 1.0, size])
    mass = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    stiff = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    n = 2 * elements + 2
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        here = slice(2 * e, 2 * e + 4)
        M[here, here] += x @ mass @ x * size / 420.0
        K[here, here] += x @ stiff @ x / size**3
    return (M, K) if free else (M[2:, 2:], K[2:, 2:])
