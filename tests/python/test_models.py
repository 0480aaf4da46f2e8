"""Claims about the native nonlinear models: known invariants, under methods of all kinds."""

import pickle

import numpy as np
import pytest

import spim
from spim import models

CASES = {
    "HenonHeiles": (models.HenonHeiles(), [0.3, 0.0, 0.0, 0.35], 0.1),
    "Kepler": (models.Kepler(), models.Kepler().state(0.3), 0.02),
    "FermiPastaUlamTsingou": (
        models.FermiPastaUlamTsingou(),
        models.FermiPastaUlamTsingou().state(),
        0.002,
    ),
    "DoublePendulum": (models.DoublePendulum(), [0.5, 0.2, 0.0, 0.0], 0.02),
    "OuterSolarSystem": (models.OuterSolarSystem(), models.OuterSolarSystem().state(), 50.0),
    "CompoundPendulum": (models.CompoundPendulum(), [0.1, 0.5, 0.0, 0.0], 0.01),
}


def run(name, method="auto", steps=1000, parts=1):
    model, z0, step = CASES[name]
    end = steps * step
    return spim.integrate(model, z0, (0.0, end), step / parts, method=method, every=parts)


@pytest.mark.parametrize("name", CASES)
def test_the_default_method_keeps_the_energy_and_says_why(name):
    solution = run(name)
    assert " (auto: " in solution.method
    assert np.abs(solution.energy / solution.energy[0] - 1.0).max() <= 1e-6


@pytest.mark.parametrize("name", CASES)
def test_methods_of_all_kinds_agree(name):
    wanted = run(name, "gauss16", 40).z[-1]
    known = {record.name for record in spim.methods()}
    for method in ("yoshida8", "lawson_gauss8", "gauss8", "rk4"):
        assert method in known
        try:
            found = run(name, method, 40, parts=4).z[-1]
        except spim.UnsupportedError:
            continue
        bound = 1e-4 if method == "rk4" else 1e-6
        assert np.abs(found - wanted).max() <= bound * np.abs(wanted).max(), method


def test_kepler_ellipses_close_and_keep_their_shape():
    kepler = models.Kepler()
    z0 = kepler.state(0.6)
    steps = 500
    solution = spim.integrate(
        kepler, z0, (0.0, 3.0 * kepler.period), kepler.period / steps, method="yoshida8"
    )
    assert np.abs(solution.z[[steps, 3 * steps]] - z0).max() <= 1e-6
    assert np.abs(kepler.angular_momentum(solution.z) / 0.8 - 1.0).max() <= 1e-13
    assert np.abs(kepler.eccentricity_vector(solution.z) - [0.6, 0.0]).max() <= 1e-6


def test_planets_keep_their_invariants_and_jupiter_its_year():
    planets = models.OuterSolarSystem()
    solution = spim.integrate(planets, planets.state(), (0.0, 40_000.0), 50.0)
    momentum = planets.momentum(solution.z)
    assert np.abs(momentum - momentum[0]).max() <= 1e-16
    turning = planets.angular_momentum(solution.z)
    assert np.abs(turning / turning[0] - 1.0).max() <= 1e-12
    jupiter = solution.z[:, 3:6] - solution.z[:, :3]
    turns = np.unwrap(np.arctan2(jupiter[:, 1], jupiter[:, 0]))
    days = 40_000.0 / ((turns[-1] - turns[0]) / (2.0 * np.pi))
    assert abs(days / 4332.6 - 1.0) <= 0.01


def test_stiff_springs_exchange_energy_and_keep_its_sum():
    chain = models.FermiPastaUlamTsingou()
    solution = spim.integrate(chain, chain.state(), (0.0, 200.0), 0.02)
    parts = chain.oscillatory_energy(solution.z)
    total = parts.sum(axis=1)
    assert np.abs(total / total[0] - 1.0).max() <= 0.15
    assert parts[0, 0] == pytest.approx(1.0)
    assert parts[:, 0].min() < 0.5
    assert parts[:, 1:].max() > 0.5


def test_a_small_double_pendulum_swings_in_its_modes():
    """Equal masses and rods: w^2 = (2 - sqrt 2) g / l, theta2 = sqrt 2 theta1."""
    model = models.DoublePendulum(gravity=1.0)
    w = np.sqrt(2.0 - np.sqrt(2.0))
    z0 = 1e-4 * np.array([1.0, np.sqrt(2.0), 0.0, 0.0])
    end = 2.0 * np.pi / w
    last = spim.integrate(model, z0, (0.0, end), end / 200).z[-1]
    assert np.abs(last - z0).max() <= 1e-9


@pytest.mark.parametrize("name", CASES)
def test_models_can_be_pickled(name):
    model, z0, _ = CASES[name]
    again = pickle.loads(pickle.dumps(model))
    assert again.energy(z0) == model.energy(z0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: models.Kepler(-1.0), "mu: must be positive"),
        (lambda: models.Kepler().state(1.0), "eccentricity"),
        (lambda: models.FermiPastaUlamTsingou(springs=2.5), "springs"),
        (lambda: models.DoublePendulum(masses=(1.0, 0.0)), "mass2: must be positive"),
        (lambda: models.DoublePendulum(lengths=(1.0,)), "lengths"),
        (lambda: models.HenonHeiles().energy([1.0]), "z: must have shape"),
    ],
)
def test_bad_models_are_refused_by_name(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_a_collision_is_said():
    solution = spim.integrate(
        models.Kepler(), [1.0, 0.0, -1.0, 0.0], (0.0, 2.0), 0.01, method="verlet", throw=False
    )
    assert len(solution.t) > 1
    with pytest.raises(spim.ModelError, match="component 2 of z' is nan at t = 0"):
        spim.integrate(models.Kepler(), [0.0, 0.0, 1.0, 0.0], (0.0, 1.0), 0.1)
