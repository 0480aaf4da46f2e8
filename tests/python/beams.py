"""Beams that several tests use."""

from spim import models
from spim.studies.beam import beam as paper

__all__ = ["kane", "paper"]


def kane(**changes):
    """The beam of Kane, Ryan & Banerjee (1987)."""
    given = {
        "length": 10.0,
        "section": models.DistributedSection(1.2, 2.8e7, 1.4e4),
        "elements": 8,
        "rotation": models.SpinUp(6.0, 15.0),
    }
    return models.RotatingBeam(**(given | changes))
