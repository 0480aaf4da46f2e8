"""Beams that several tests use."""

from spim import models

PAPER_SECTION = models.TaperedSection(
    root=(0.04596, 0.00248), tip=(0.02673, 0.00144), density=2.7667e3, youngs_modulus=6.8952e10
)


def paper(**changes):
    """The beam of study 6.1."""
    given = {
        "length": 8.0,
        "section": PAPER_SECTION,
        "elements": 2,
        "hub_inertia": 10.0,
        "tip_mass": 0.085,
    }
    return models.RotatingBeam(**(given | changes))


def kane(**changes):
    """The beam of Kane, Ryan & Banerjee (1987)."""
    given = {
        "length": 10.0,
        "section": models.DistributedSection(1.2, 2.8e7, 1.4e4),
        "elements": 8,
        "rotation": models.SpinUp(6.0, 15.0),
    }
    return models.RotatingBeam(**(given | changes))
