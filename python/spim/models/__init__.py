"""Ready-made models, one a file."""

from spim.models.compound_pendulum import CompoundPendulum
from spim.models.oscillators import Oscillators
from spim.models.rotating_beam import RotatingBeam
from spim.models.rotation import RotationTable, SpinUp, Trapezoid
from spim.models.sections import DistributedSection, TaperedSection

__all__ = [
    "CompoundPendulum",
    "DistributedSection",
    "Oscillators",
    "RotatingBeam",
    "RotationTable",
    "SpinUp",
    "TaperedSection",
    "Trapezoid",
]
