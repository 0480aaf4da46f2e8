"""Linear systems at the pace of a sampler."""

import math

import numpy as np

from spim._arrays import finite, matrix, symmetric
from spim._core import expm, phi


def discretize(A, B, tau, hold="zero"):
    """Step matrices of ``x' = A x + B u`` for an input that is held between samples.

    Parameters
    ----------
    A : array_like (m, m)
        Real.
    B : array_like (m, r)
    tau : float
        Sampling interval, in the unit of time of `A`; positive.
    hold : {"zero", "first"}
        "zero" (the default): u is constant over an interval, ``x_k+1 = Ad x_k + Bd u_k``. "first":
        u is linear, ``x_k+1 = Ad x_k + Bd0 u_k + Bd1 u_k+1``. Both are exact but for rounding; no
        inverse is formed, so that A may be singular.

    Returns
    -------
    Ad : ndarray (m, m)
    Bd : ndarray (m, r)
        For "zero".
    Bd0, Bd1 : ndarray (m, r)
        For "first".

    Raises
    ------
    ValueError
        Sizes that do not match, entries that are not finite, `tau` not positive, another hold.
    OverflowError
        A result exceeds 1.8e308.
    """
    A, B, tau = matrix("A", A), finite("B", B), _interval(tau)
    if B.ndim != 2 or len(B) != len(A):
        raise ValueError(f"B: must have shape ({len(A)}, r), got {B.shape}")
    if hold == "zero":
        Ad, first = phi(A, 1, tau=tau)
        return Ad, _product("Bd", tau * first, B)
    if hold == "first":
        Ad, first, second = phi(A, 2, tau=tau)
        early = _product("Bd0", tau * (first - second), B)
        return Ad, early, _product("Bd1", tau * second, B)
    raise ValueError(f'hold: must be "zero" or "first", got {hold!r}')


def discretize_noise(A, Q, tau):
    """Covariance of the white noise that ``x' = A x + w`` gathers in one interval.

    ``Qd`` = integral over 0..tau of ``exp(A s) Q exp(A s)^T``. Computed over a short interval by
    Van Loan's block exponential (IEEE Trans. Automat. Control 23, 1978) and doubled from there,
    ``Qd(2 t) = Qd(t) + exp(A t) Qd(t) exp(A t)^T``: a sum of positive matrices, which loses no
    digits to stiff decay, where the block exponential alone overflows.

    Parameters
    ----------
    A : array_like (m, m)
        Real.
    Q : array_like (m, m)
        Spectral density of w: symmetric, positive semidefinite.
    tau : float
        Sampling interval; positive.

    Returns
    -------
    Ad, Qd : ndarray (m, m)
        ``exp(tau A)`` and the covariance, exactly symmetric.

    Raises
    ------
    ValueError
        Sizes that do not match, entries that are not finite, `Q` not symmetric or with a negative
        eigenvalue, `tau` not positive.
    OverflowError
        A result exceeds 1.8e308.
    """
    A, Q, tau = matrix("A", A), matrix("Q", Q), _interval(tau)
    m = len(A)
    if Q.shape != A.shape:
        raise ValueError(f"Q: must have shape {A.shape}, got {Q.shape}")
    Q = symmetric("Q", Q)
    # Of the size of A: Q enters linearly.
    size = np.abs(Q).max() or 1.0
    lowest = np.linalg.eigvalsh(Q / size)[0]
    if lowest < -1e-12 * m:
        raise ValueError(f"Q: must be positive semidefinite, has the eigenvalue {lowest * size:g}")
    norm = tau * float(np.abs(A).sum(axis=0).max())
    if not np.isfinite(norm):
        raise OverflowError("tau * A exceeds 1.8e308")
    scale = (norm or 1.0) / tau / size
    doublings = max(0, math.ceil(math.log2(norm)) + 1) if norm > 0.0 else 0
    # Powers of two times tau: each exponential is formed anew, so that no error is squared.
    intervals = tau * 0.5 ** np.arange(doublings, -1, -1)
    steps = expm(intervals[:, None, None] * A)
    block = np.block([[A, Q * scale], [np.zeros((m, m)), -A.T]])
    short = expm(intervals[0] * block)
    covariance = short[:m, m:] @ short[:m, :m].T
    with np.errstate(all="ignore"):
        for step in steps[:-1]:
            covariance = covariance + step @ covariance @ step.T
        covariance = 0.5 * (covariance + covariance.T) / scale
    return steps[-1], _within_doubles("Qd", covariance)


def _product(name, one, other):
    with np.errstate(all="ignore"):
        return _within_doubles(name, one @ other)


def _within_doubles(name, result):
    if not np.isfinite(result).all():
        raise OverflowError(f"{name}: an entry exceeds 1.8e308")
    return result


def _interval(tau):
    tau = float(finite("tau", tau, ()))
    if not (0.0 < tau < math.inf):
        raise ValueError(f"tau: must be positive and finite, got {tau}")
    return tau
