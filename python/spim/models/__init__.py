"""Ready-made models, one a file."""

from spim.models.compound_pendulum import CompoundPendulum
from spim.models.double_pendulum import DoublePendulum
from spim.models.fermi_pasta_ulam_tsingou import FermiPastaUlamTsingou
from spim.models.henon_heiles import HenonHeiles
from spim.models.kepler import Kepler
from spim.models.oscillators import Oscillators
from spim.models.outer_solar_system import OuterSolarSystem
from spim.models.rotating_beam import RotatingBeam
from spim.models.rotation import RotationTable, SpinUp, Trapezoid
from spim.models.sections import DistributedSection, TaperedSection

__all__ = [
    "CompoundPendulum",
    "DistributedSection",
    "DoublePendulum",
    "FermiPastaUlamTsingou",
    "HenonHeiles",
    "Kepler",
    "Oscillators",
    "OuterSolarSystem",
    "RotatingBeam",
    "RotationTable",
    "SpinUp",
    "TaperedSection",
    "Trapezoid",
]
