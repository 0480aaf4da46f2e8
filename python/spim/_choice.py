"""What ``method="auto"`` takes for nonlinear systems, and why.

At a given step methods of order 16 are the most exact ones on every model of ``spim.models``, and
beyond small errors at equal time too. What is left to choose is whether to turn with a linear part.
"""

from typing import NamedTuple

import numpy as np

# Growth or decay over a step, as an exponent, to which exponential methods lose no digits.
GROWTH_LIMIT = 2.0
# Phase w_max h of a step that eight stages resolve: a radian a stage.
PHASE_LIMIT = 8.0


class Choice(NamedTuple):
    """A method and why; a sentence to warn with, if any."""

    method: str
    reason: str
    warning: str | None = None


def collocation(why):
    """Gauss' method of order 16."""
    return Choice("gauss16", f"of order 16, {why}")


def along(spectrum, kept, step):
    """For a system with a linear part, by its eigenvalues; `kept`: what is true of the method."""
    phase = float(np.abs(spectrum.imag).max()) * step
    growth = float(np.abs(spectrum.real).max()) * step
    if PHASE_LIMIT <= phase < np.inf:
        words = (
            f"w_max h = {phase:.3g} of the linear part is {PHASE_LIMIT:g} or more, where steps of "
            "exponential methods resonate; fast oscillations lose their phase, slow motion is right"
        )
        return Choice("gauss16", words, f"auto, gauss16: {words}; take smaller steps for them")
    if growth >= GROWTH_LIMIT:
        return collocation(
            f"the linear part solved within the iterations: in a step it grows or decays by "
            f"e^{growth:.3g}, and exponential methods lose digits from e^{GROWTH_LIMIT:g} on"
        )
    return Choice(
        "lawson_gauss16",
        f"the linear part, its w_max h = {phase:.3g} below {PHASE_LIMIT:g}, is stepped exactly and "
        f"the rest with order 16; {kept}",
    )
