"""Linear systems at the pace of a sampler."""

import math

import numpy as np

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
        "zero": u is constant over an interval, ``x_k+1 = Ad x_k + Bd u_k``. "first": u is linear,
        ``x_k+1 = Ad x_k + Bd0 u_k + Bd1 u_k+1``. Both are exact but for rounding; no inverse is
        formed, so that A may be singular.

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
    A, B, tau = _square("A", A), _finite("B", B), _interval(tau)
    if B.ndim != 2 or len(B) != len(A):
        raise ValueError(f"B: must have shape ({len(A)}, r), got {B.shape}")
    if hold == "zero":
        Ad, first = phi(A, 1, tau=tau)
        return Ad, tau * (first @ B)
    if hold == "first":
        Ad, first, second = phi(A, 2, tau=tau)
        late = second @ B
        return Ad, tau * (first @ B - late), tau * late
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
        Sizes that do not match, entries that are not finite, `Q` not symmetric, `tau` not positive.
    """
    A, Q, tau = _square("A", A), _square("Q", Q), _interval(tau)
    m = len(A)
    if Q.shape != A.shape:
        raise ValueError(f"Q: must have shape {A.shape}, got {Q.shape}")
    if np.abs(Q - Q.T).max() > 1e-12 * np.abs(Q).max():
        raise ValueError("Q: must be symmetric")
    norm = tau * np.abs(A).sum(axis=0).max()
    doublings = max(0, math.ceil(math.log2(norm)) + 1) if norm > 0.0 else 0
    # Powers of two times tau: each exponential is formed anew, so that no error is squared.
    intervals = tau * 0.5 ** np.arange(doublings, -1, -1)
    steps = expm(intervals[:, None, None] * A)
    block = np.block([[A, Q], [np.zeros((m, m)), -A.T]])
    short = expm(intervals[0] * block)
    covariance = short[:m, m:] @ short[:m, :m].T
    for step in steps[:-1]:
        covariance = covariance + step @ covariance @ step.T
    return steps[-1], 0.5 * (covariance + covariance.T)


def _finite(name, given):
    array = np.asarray(given)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name}: needs an array of real numbers, got dtype {array.dtype}")
    array = array.astype(float)
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}: entry {index} is {array[index]}")
    return array


def _square(name, given):
    array = _finite(name, given)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
        raise ValueError(f"{name}: must be square and not empty, got shape {array.shape}")
    return array


def _interval(tau):
    tau = float(tau)
    if not (0.0 < tau < math.inf):
        raise ValueError(f"tau: must be positive and finite, got {tau}")
    return tau
