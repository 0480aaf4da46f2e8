"""The rotating beam's canonical equations for heyoka, the joint locked or absent.

With ``c = a + G^T q`` and the momentum of the hub's angle constant, in the form that was fastest
(M^-1 a dense matrix of constants, no other dense one but M^-1 G^T, few products of variables)::

    z1 = M^-1 p,  x = M^-1 a + M^-1 G^T q,  w = b + Q q - G x
    sigma = s + r.q + q.w,  s = J - a.M^-1 a,  r = b - G M^-1 a
    phi' = (p_phi - c.z1) / sigma
    q' = z1 - phi' x,  p' = phi' (G z1 + phi' w) - K q
"""

from dataclasses import dataclass

import numpy as np

FORMS = ("physical", "modal")


@dataclass(frozen=True)
class Equations:
    """A system for `heyoka.taylor_adaptive`, and its variables y, r: ``q = T y, p = P r``."""

    system: list
    T: np.ndarray
    P: np.ndarray

    def start(self, z):
        """State of heyoka at a state [q, phi, p, p_phi] of spim."""
        n = len(self.T)
        y, momenta = np.linalg.solve(self.T, z[:n]), np.linalg.solve(self.P, z[n + 1 : 2 * n + 1])
        return np.concatenate([y, momenta, z[n : n + 1]])

    def coordinates(self, state):
        """[q, phi] of a state of heyoka."""
        n = len(self.T)
        return np.append(self.T @ state[:n], state[2 * n])


def _constants(beam, T):
    """Matrices in coordinates y, q = T y, by 40 digits."""
    import mpmath

    with mpmath.workdps(40):
        T = mpmath.matrix(T.tolist())
        M, G, K, Q = (T.T * mpmath.matrix(A.tolist()) * T for A in beam._linear()[:4])
        a, b = (T.T * mpmath.matrix(v.tolist()) for v in beam._linear()[4:])
        inverse = M**-1
        xa, X = inverse * a, inverse * G.T
        m0, m1, J0 = (mpmath.mpf(float(m)) for m in beam._moments)
        R = mpmath.mpf(beam.hub_radius)
        inertia = beam.hub_inertia + J0 + 2 * R * m1 + R * R * m0
        found = {
            "G": G,
            "Gt": G.T,
            "K": K,
            "Q": Q,
            "a": a,
            "b": b,
            "inverse": inverse,
            "xa": xa,
            "X": X,
        }
        found |= {"r": b - G * xa, "s": mpmath.matrix([inertia - (a.T * xa)[0]])}
        arrays = {}
        for name, matrix in found.items():
            text = [mpmath.nstr(v, 25) for v in matrix]
            arrays[name] = np.array(text, np.longdouble).reshape(matrix.rows, matrix.cols)
    return arrays


def equations(beam, p_phi, form="physical", real=float):
    """Equations of a beam without gravity, springs, damping and loads ("foac" or "zoac").

    Parameters
    ----------
    beam : spim.models.RotatingBeam
    p_phi : float
        Momentum of the hub's angle, N m s.
    form : {"physical", "modal"}
        Coordinates: the beam's own, or of the clamped beam's modes, where M = I and K is diagonal
        but all others are dense.
    real : type
        Of the constants: float, or numpy.longdouble.
    """
    import heyoka as hy
    import scipy.linalg

    n = 3 * beam.elements
    T = np.eye(n)
    if form == "modal":
        M, _, K = beam._linear()[:3]
        T = scipy.linalg.eigh(K, M)[1]
    A = _constants(beam, T)
    for name in ("inverse", "K", "G", "Gt", "X", "Q"):
        # Zeros that rounding has filled.
        largest = np.abs(A[name]).max()
        A[name][np.abs(A[name]) < 1e-16 * largest] = 0.0
    if form == "modal":
        A["K"], A["inverse"] = (np.diag(np.diag(A[name])) for name in ("K", "inverse"))

    def number(value):
        return hy.expression(real(value))

    def combined(coefficients, variables, constant=0.0):
        terms = [number(k) * v for k, v in zip(coefficients, variables, strict=True) if k != 0.0]
        return hy.sum(([number(constant)] if constant != 0.0 else []) + terms)

    def product(matrix, variables, constants=None):
        constants = np.zeros(len(matrix)) if constants is None else constants[:, 0]
        return [combined(row, variables, k) for row, k in zip(matrix, constants, strict=True)]

    def inner(left, right):
        return hy.sum([x * y for x, y in zip(left, right, strict=True)])

    q = hy.make_vars(*[f"q{i}" for i in range(n)])
    p = hy.make_vars(*[f"p{i}" for i in range(n)])
    phi = hy.make_vars("phi")
    c, x = product(A["Gt"], q, A["a"]), product(A["X"], q, A["xa"])
    z1 = product(A["inverse"], p)
    w = [f - g for f, g in zip(product(A["Q"], q, A["b"]), product(A["G"], x), strict=True)]
    sigma = combined(A["r"][:, 0], q, A["s"][0, 0]) + inner(q, w)
    impulse = -inner(c, z1)
    speed = (impulse + number(p_phi) if p_phi else impulse) / sigma
    turned, restoring = product(A["G"], z1), product(A["K"], q)
    system = [(q[i], z1[i] - speed * x[i]) for i in range(n)]
    system += [(p[i], speed * (turned[i] + speed * w[i]) - restoring[i]) for i in range(n)]
    system.append((phi, speed))
    return Equations(system, T, np.linalg.inv(T).T)


def rate(made, z):
    """``[q'; phi'; p'; p_phi']`` at a state [q, phi, p, p_phi] of spim."""
    import heyoka as hy

    n = len(made.T)
    variables, sides = zip(*made.system, strict=True)
    function = hy.cfunc(list(sides), vars=list(variables), compact_mode=True)
    found = function(made.start(z))
    return np.concatenate(
        [made.T @ found[:n], found[2 * n :], made.P @ found[n : 2 * n], np.zeros(1)]
    )
