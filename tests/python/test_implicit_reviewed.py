"""Implicit methods where a reader broke them: equilibria, rest, scales, stiffness from rest."""

import numpy as np
import pytest

import spim

GAUSS = ["gauss4", "gauss8", "gauss16", "gauss32"]
ALL = [*GAUSS, "midpoint", "srk2", "runge_kutta"]


@pytest.mark.parametrize("method", ALL)
def test_a_damped_run_settles_at_a_loaded_equilibrium(method):
    system = spim.FlowSystem(2, lambda t, z: [z[1], -z[0] - 1.4 * z[1] + 1.0])
    end = spim.integrate(system, [0.0, 0.0], (0.0, 100.0), 0.1, method=method).z[-1]
    np.testing.assert_allclose(end, [1.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("method", ALL)
def test_a_static_equilibrium_stays(method):
    def gradient(t, z):
        return [3.0 * z[0] - z[1] - 1.1, z[1] - z[0] - 0.7, z[2], z[3]]

    system = spim.HamiltonianSystem(2, gradient)
    end = spim.integrate(system, [0.9, 1.6, 0.0, 0.0], (0.0, 30.0), 0.1, method=method).z[-1]
    np.testing.assert_allclose(end, [0.9, 1.6, 0.0, 0.0], atol=3e-14)


@pytest.mark.parametrize("method", ["gauss4", "gauss16", "midpoint", "srk2"])
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.3, 1.0, 2.0])
@pytest.mark.parametrize("turn", [0.3, 3.0, 30.0])
def test_steps_of_all_sizes_from_rest_are_solved(method, damping, turn):
    w = 1e3
    system = spim.FlowSystem(
        2, lambda t, z: [z[1], -w * w * (z[0] - 1.0) - 2.0 * damping * w * z[1]]
    )
    h = turn / w
    end = spim.integrate(system, [0.0, 0.0], (0.0, 200 * h), h, method=method).z[-1]
    if damping in (0.3, 1.0) and turn == 0.3:
        np.testing.assert_allclose(end * [1.0, 1.0 / w], [1.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("method", ["midpoint", "srk2", "gauss4"])
@pytest.mark.parametrize("scale", [1e-22, 1e-9, 1.0, 1e12])
def test_the_unit_of_length_does_not_matter(method, scale):
    system = spim.FlowSystem(2, lambda t, z: [z[1], -((z[0] / scale) ** 3) * scale])
    end = spim.integrate(system, [scale, 0.0], (0.0, 5.0), 0.05, method=method).z[-1] / scale
    np.testing.assert_allclose(end, [-0.39656, 0.69831], atol=2e-3)


@pytest.mark.parametrize("method", ALL)
def test_stiff_systems_may_start_at_zero(method):
    system = spim.FlowSystem(1, lambda t, z: [-1e4 * (z[0] - np.cos(t))])
    end = spim.integrate(system, [0.0], (0.0, 0.1), 1e-3, method=method).z[-1]
    np.testing.assert_allclose(end, np.cos(0.1), atol=2e-5)


@pytest.mark.parametrize("method", ["gauss4", "gauss16"])
def test_from_rest_a_force_of_time_alone_moves_what_it_does_not_act_on(method):
    system = spim.FlowSystem(2, lambda t, z: [z[1], -z[0] + np.cos(2.0 * t)])
    end = spim.integrate(system, [0.0, 0.0], (0.0, 0.05), 0.05, method=method).z[-1]
    np.testing.assert_allclose(end[0], (np.cos(0.05) - np.cos(0.1)) / 3.0, atol=1e-10)


@pytest.mark.parametrize("method", ["lawson_gauss4", "lawson_gauss12", "lawson_gauss16"])
def test_lawson_methods_settle_at_a_loaded_equilibrium(method):
    def rest(t, z):
        return [0.0, 9.8 * (z[0] - np.sin(z[0])) + 2.0]

    system = spim.SemilinearSystem([[0.0, 1.0], [-9.8, -0.7]], rest)
    end = spim.integrate(system, [0.0, 0.0], (0.0, 100.0), 0.1, method=method).z[-1]
    np.testing.assert_allclose(end, [np.arcsin(2.0 / 9.8), 0.0], atol=1e-6)


def test_full_matrices_have_a_limit_that_is_said():
    chain = spim.models.FermiPastaUlamTsingou(springs=2000)
    start = np.zeros(8000)
    with pytest.raises(spim.UnsupportedError, match="full matrix of 16000 rows"):
        spim.integrate(chain, start, (0.0, 0.1), 0.1, method="runge_kutta")
    start[0] = 1.0
    assert spim.integrate(chain, start, (0.0, 0.1), 0.01, method="gauss8").success
