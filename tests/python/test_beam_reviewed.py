"""Claims about rotating beams that a reader has once shown to be false."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from beams import paper

import spim
from spim import models

SECTION = models.DistributedSection(1.2, 2.8e7, 1.4e4)


def make(**changes):
    given = {"length": 10.0, "section": SECTION, "elements": 4}
    return models.RotatingBeam(**(given | changes))


def test_a_tip_that_turns_with_its_section_is_not_flung_outward():
    beam = make(elements=8, tip_inertia=20.0, rotation=lambda t: 6.0)
    found = beam.spinning_modes(6.0).frequencies[:3]
    assert np.abs(found - [4.274, 14.137, 38.024]).max() <= 1e-3
    # Its kinetic energy is J (alpha' + theta')^2 / 2, whatever theta.
    free = paper(tip_inertia=0.3), paper()
    z = [b.state(theta=[0.0, 0.4], theta_rate=[0.0, 0.7], omega=2.0) for b in free]
    difference = free[0].energy(z[0]) - free[1].energy(z[1])
    assert abs(difference - 0.5 * 0.3 * 2.7**2) <= 1e-12


def test_threads_share_a_beam_with_a_rotation_of_ones_own():
    def new():
        return make(gravity=(0.0, -9.81), rotation=lambda t: 2.0 * math.sin(t))

    def run(beam):
        return spim.integrate(beam, beam.state(), (0.0, 2.0), 1e-2).z

    wanted = run(new())
    for _ in range(4):
        beam = new()
        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(run, [beam] * 4))
        assert all((z == wanted).all() for z in found)


@pytest.mark.parametrize(
    ("omega", "angle"),
    [
        (lambda t: 2.0 + math.cos(320.0 * math.pi * t), 2.0),
        (lambda t: 0.0 if t < 0.52 else 3.0, 1.44),
        (lambda t: 100.0 if 0.5 < t < 0.502 else 0.0, 0.2),
    ],
)
def test_angles_of_ripples_and_jumps_are_their_integrals(omega, angle):
    beam = make(rotation=omega, elements=1)
    run = spim.integrate(beam, beam.state(), (0.0, 1.0), 0.1)
    assert abs(run.phi1[-1] - angle) <= 1e-6


def test_rotations_are_not_needed_outside_the_run():
    def omega(t):
        if not 0.0 <= t <= 1.0:
            raise ValueError("outside")
        return t

    run = spim.integrate(make(rotation=omega), make(rotation=omega).state(), (0.0, 1.0), 0.01)
    assert run.success
    assert abs(run.phi1[-1] - 0.5) <= 1e-12


def test_a_run_can_be_taken_on_from_its_last_state():
    beam = make(hub_inertia=1000.0, damping=(0.5, 0.0), tip_force=(1.0, 200.0))
    first = spim.integrate(beam, beam.state(v=0.001, omega=1.0), (0.0, 0.1), 1e-3)
    assert first.last.shape == (beam.size,)
    second = spim.integrate(beam, first.last, (0.1, 0.2), 1e-3)
    assert np.abs(second.balance_error).max() <= 1e-5


def test_modes_are_continuous_in_gravity_and_know_no_loads():
    for given in ({"rotation": lambda t: 6.0}, {"tip_force": (-100.0, 0.0), "hub_inertia": 1.0}):
        found = [
            make(gravity=g, **given).modal("clamped").frequencies[:3]
            for g in ((0.0, 0.0), (1e-9, 0.0))
        ]
        assert np.abs(found[1] / found[0] - 1.0).max() <= 1e-6
    assert make(gravity=(0.0, -9.81)).modal("clamped").frequencies[0] > 3.0


def test_arrays_written_to_later_change_no_beam():
    force = np.array([1.0, 2.0])
    beam = make(hub_inertia=1.0, tip_force=force)
    force[:] = 0.0
    assert "[1.0, 2.0]" in beam.to_toml()


@pytest.mark.parametrize("method", ["gauss4", "gauss8", "gauss16", "srk2"])
@pytest.mark.parametrize(
    "given",
    [
        {"hub_inertia": 500.0, "gravity": (0.0, -9.81)},
        {"coupling": "third", "rotation": models.SpinUp(6.0, 15.0)},
    ],
)
def test_runs_begin_from_rest(method, given):
    beam = make(elements=2, **given)
    run = spim.integrate(beam, beam.state(), (0.0, 0.05), 1e-3, method=method)
    assert np.abs(run.tip_v).max() > 0.0


def test_the_general_way_of_gauss_methods_ends_at_rounding_too():
    section = models.DistributedSection(1.2, 2.8e4, 1.4e3)
    given = {"length": 3.0, "section": section, "elements": 3, "hub_inertia": 60.0}
    for force in (None, (0.0, 0.0)):
        beam = models.RotatingBeam(**given, tip_force=force)
        z0 = beam.state(v=lambda x: 0.005 * x * x, theta=lambda x: 0.01 * x, omega=0.8)
        run = spim.integrate(beam, z0, (0.0, 0.2), 1e-3, method="gauss16")
        assert np.abs(run.energy / run.energy[0] - 1.0).max() <= 1e-12


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: make(rotation=models.SpinUp), TypeError, "SpinUp"),
        (lambda: make(follower="no"), TypeError, "follower"),
        (lambda: make(hub_inertia=1.0).sketch(what="foo"), ValueError, "what"),
        (lambda: make(hub_inertia=1.0).campbell([3.0, 2.0]), ValueError, "speeds: must ascend"),
        (lambda: make(hub_inertia=1.0).energy(np.full(26, np.nan)), ValueError, "z: entry"),
        (
            lambda: make(hub_inertia=1.0, coupling="third").matrices(np.zeros(13), np.zeros(13)),
            spim.UnsupportedError,
            "elasticity linear",
        ),
    ],
)
def test_what_is_wrong_is_named(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_outputs_alone_say_so_when_states_are_asked_for():
    beam = make(hub_inertia=1.0)
    run = spim.integrate(beam, beam.state(), (0.0, 0.1), 1e-2, outputs=[0])
    with pytest.raises(AttributeError, match="only outputs were stored"):
        run(0.05)
