"""Ready-made models, one a file."""

from spim.models.oscillators import Oscillators

__all__ = ["Oscillators"]
