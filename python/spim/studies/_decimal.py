"""References of 60 digits with the standard library alone: `decimal`, a sine, exact differences.

A double is a decimal fraction of finite length, so the difference of a computed state and its
reference carries no rounding of doubles: what is measured is the error of the state alone.
"""

import decimal
from decimal import Decimal

DIGITS = 60
GUARD = 10


def sine(angle, digits=DIGITS):
    """sin(angle) by its Taylor series, absolute error below ``10^-digits``.

    The terms grow to ``exp(|angle|)`` before they fall, so that many digits more are carried:
    meant for angles up to a few hundred.

    Parameters
    ----------
    angle : Decimal
        In rad.
    digits : int

    Returns
    -------
    Decimal
    """
    lost = int(abs(angle) / Decimal(10).ln()) + 1
    with decimal.localcontext(decimal.Context(prec=digits + lost + GUARD)):
        negligible = Decimal(10) ** -(digits + GUARD)
        total = term = angle
        order = 1
        while abs(term) > negligible:
            order += 2
            term = -term * angle * angle / (order * (order - 1))
            total += term
        return total


def displacements(gain, stiffness, momentum, step, count):
    """Displacements of an oscillator ``x' = gain p, p' = -stiffness x`` that starts from x = 0.

    ``x(t) = p(0) gain / w sin(w t)``, ``w^2 = gain stiffness``, at ``t = 0, step, 2 step, ...``:
    of the doubles as given, so ``gain`` is 1/m as the matrix holds it, rounded.

    Parameters
    ----------
    gain : float
        1/m [1/kg].
    stiffness : float
        [N/m].
    momentum : float
        p(0) [kg m/s].
    step : float
        [s].
    count : int
        How many times, 0 included.

    Returns
    -------
    list of Decimal
        In m, `DIGITS` digits behind the point.
    """
    with decimal.localcontext(decimal.Context(prec=DIGITS + GUARD)):
        w = (Decimal(gain) * Decimal(stiffness)).sqrt()
        amplitude = Decimal(momentum) * Decimal(gain) / w
        return [amplitude * sine(w * k * Decimal(step)) for k in range(count)]


def errors(states, reference):
    """Differences ``state - reference``, exact to `DIGITS` digits, as floats.

    Parameters
    ----------
    states : iterable of float
    reference : iterable of Decimal

    Returns
    -------
    list of float
    """
    with decimal.localcontext(decimal.Context(prec=DIGITS + GUARD)):
        return [float(Decimal(float(x)) - r) for x, r in zip(states, reference, strict=True)]


def energy_errors(gains, stiffnesses, states):
    """Relative errors ``H(z) / H(z_0) - 1`` of oscillators, free of rounding; z_0 is the first row.

    ``H = sum of gain_i p_i^2 / 2 + stiffness_i x_i^2 / 2``.

    Parameters
    ----------
    gains, stiffnesses : array_like (n,)
        1/m_i [1/kg] and k_i [N/m].
    states : array_like (k, 2n)
        ``[x_1 .. x_n, p_1 .. p_n]``.

    Returns
    -------
    list of float (k,)
    """
    weights = [Decimal(float(weight)) for weight in (*stiffnesses, *gains)]
    with decimal.localcontext(decimal.Context(prec=DIGITS)):
        energies = [
            sum(weight * Decimal(float(x)) ** 2 for weight, x in zip(weights, z, strict=True)) / 2
            for z in states
        ]
        return [float(energy / energies[0] - 1) for energy in energies]
