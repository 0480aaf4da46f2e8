"""Claims about the equations of the rotating beam."""

import numpy as np
import pytest
from beams import kane, paper

import spim
from spim import models

HUBS = {
    "locked": {"ground_spring": 40.0},
    "jointed": {"joint_spring": 300.0, "ground_spring": 40.0},
    "driven": {"hub_inertia": None, "rotation": models.SpinUp(2.0, 3.0)},
}


def swinging(hub, coupling, **changes):
    """A beam with a hub radius and gravity in a large motion, and its state at t = 1."""
    beam = paper(
        elements=3, hub_radius=0.7, coupling=coupling, gravity=(1.5, -9.8), **HUBS[hub], **changes
    )
    random = np.random.default_rng(3)
    # With a joint, first-order coupling holds for small deflections alone.
    small = 0.1 if (hub, coupling) == ("jointed", "foac") else 1.0
    size = {"u": 0.002, "v": 0.3, "theta": 0.1, "u_rate": 0.1, "v_rate": 0.5, "theta_rate": 0.3}
    given = {name: small * scale * random.normal(size=3) for name, scale in size.items()}
    if hub != "driven":
        given |= {"phi1": 0.3, "omega": 1.2}
    if hub == "jointed":
        given |= {"phi2": 0.2, "joint_rate": -0.7}
    return beam, beam.state(**given, t=1.0)


def slopes(function, z, step):
    """Central differences of fourth order."""
    found = []
    for k in range(len(z)):
        d = np.zeros(len(z))
        d[k] = step * max(1.0, abs(z[k]))
        values = [function(z + c * d) for c in (-2.0, -1.0, 1.0, 2.0)]
        found.append((values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * d[k]))
    return np.array(found)


@pytest.mark.parametrize("coupling", ["foac", "zoac", "third"])
@pytest.mark.parametrize("hub", HUBS)
def test_rates_are_the_canonical_ones_of_the_energy(hub, coupling):
    beam, z = swinging(hub, coupling)
    N = beam.dof
    slope = slopes(lambda z: beam.energy(z, 1.0), z, 1e-4)
    wanted = np.concatenate([slope[N:], -slope[:N]])
    found = beam.rate(z, 1.0)
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    assert np.abs(found[:N] - beam.rates(z, 1.0)).max() == 0.0


@pytest.mark.parametrize("coupling", ["foac", "zoac"])
@pytest.mark.parametrize("hub", ["locked", "driven"])
def test_matrices_are_those_of_eq_15(hub, coupling):
    """Accelerations of eq. 15 are those of the canonical equations, without gravity."""
    beam, _ = swinging(hub, coupling)
    given = {**beam._given, "gravity": (0.0, 0.0)}
    beam = models.RotatingBeam(**given)
    random = np.random.default_rng(3)
    n = 3 * beam.elements
    q, rates = np.append(0.1 * random.normal(size=n), 0.2), np.append(random.normal(size=n), 1.3)
    if hub == "driven":
        # The speed at t = 1 is what the matrices must be asked at.
        rates[n], q[n] = beam.rotation.omega(1.0), beam.rotation.angle(1.0)
    E = beam.matrices(q, rates)
    N = beam.dof

    def state(q, rates):
        z = np.concatenate([q[:N], rates[:N]])
        return beam._mapped("momenta", z, 1.0)

    z = state(q, rates)
    assert np.abs(beam.rates(z, 1.0) - rates[:N]).max() <= 1e-10
    if hub == "driven":
        speed_up = (beam.rotation.omega(1.0 + 1e-4) - beam.rotation.omega(1.0 - 1e-4)) / 2e-4
        right = E.force - E.gyroscopic @ rates - E.stiffness @ q - E.mass[:, n] * speed_up
        wanted = np.linalg.solve(E.mass[:n, :n], right[:n])
    else:
        wanted = np.linalg.solve(E.mass, E.force - E.gyroscopic @ rates - E.stiffness @ q)
    # q'' along the flow.
    d = 1e-6
    later, before = z + d * beam.rate(z, 1.0), z - d * beam.rate(z, 1.0)
    found = (beam.rates(later, 1.0 + d) - beam.rates(before, 1.0 - d)) / (2.0 * d)
    assert np.abs(found - wanted).max() <= 1e-6 * np.abs(wanted).max()


def test_the_general_formula_of_eq_23_holds():
    """P' = 1/2 y'^T M_y y' - V_y, with M by differences."""
    beam, z = swinging("locked", "foac")
    given = {**beam._given, "gravity": (0.0, 0.0)}
    beam = models.RotatingBeam(**given)
    N = beam.dof
    y, rates = z[:N], beam.rates(z)
    kinetic = slopes(lambda y: 0.5 * rates @ beam.matrices(y, rates).mass @ rates, y, 1e-3)
    still = beam.energy(np.concatenate([y, np.zeros(N)]))
    assert still > 0.0
    potential = slopes(lambda y: beam.energy(np.concatenate([y, np.zeros(N)])), y, 1e-3)
    found = beam.rate(z)[N:]
    assert np.abs(found - (kinetic - potential)).max() <= 1e-9 * np.abs(found).max()


@pytest.mark.parametrize("coupling", ["foac", "third"])
@pytest.mark.parametrize("hub", ["locked", "jointed"])
def test_dead_loads_are_the_slopes_of_their_work(hub, coupling):
    """Forces of fixed direction have the potential - F . r."""
    tip, spread = np.array([30.0, -20.0]), np.array([[4.0, 7.0], [-3.0, 2.0], [1.0, 5.0]])
    plain, z = swinging(hub, coupling)
    loaded, _ = swinging(hub, coupling, tip_force=tip, distributed_force=spread)
    N, n = plain.dof, 3
    force = (loaded.rate(z) - plain.rate(z))[N:]
    points, weights = np.polynomial.legendre.leggauss(8)
    points, weights = 0.5 * (1.0 + points), 0.5 * weights
    l = plain.length / n

    def work(y):
        """Of all forces, by quadrature of the places of the beam's points."""
        nodal = np.vstack([np.zeros(3), y[: 3 * n].reshape(n, 3)])
        phi = y[3 * n]
        angle = phi + (y[3 * n + 1] if hub == "jointed" else 0.0)
        ex, ey = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        root = plain.hub_radius * np.array([np.cos(phi), np.sin(phi)])
        total, lost = 0.0, 0.0
        for e in range(n):
            (u1, v1, t1), (u2, v2, t2) = nodal[e], nodal[e + 1]
            _, N_v, N_s = fe_shapes(points, l)
            nodes = np.array([v1, t1, v2, t2])
            square = (N_s @ nodes) ** 2
            for x, w, v in zip(points, weights, N_v @ nodes, strict=True):
                # Shortening up to x.
                inner = 0.5 * (1.0 + np.polynomial.legendre.leggauss(8)[0]) * x
                part = x * l * weights @ (fe_shapes(inner, l)[2] @ nodes) ** 2
                shortening = 0.5 * (lost + part) if coupling == "foac" else 0.0
                along = l * (e + x) + (1 - x) * u1 + x * u2 - shortening
                total += w * l * spread[e] @ (root + along * ex + v * ey)
            lost += l * weights @ square
        shortening = 0.5 * lost if coupling == "foac" else 0.0
        place = root + (plain.length + nodal[n, 0] - shortening) * ex + nodal[n, 1] * ey
        return total + tip @ place

    wanted = slopes(work, z[:N], 1e-3)
    assert np.abs(force - wanted).max() <= 1e-9 * np.abs(wanted).max()


def fe_shapes(x, l):
    from spim.models._finite_elements import shapes

    return shapes(np.asarray(x), l)


def test_totals_of_the_papers_beam():
    beam = paper()
    assert abs(beam.mass - 1.613601) < 5e-7
    assert np.abs(np.array(beam.moments) - [6.020501, 31.109650]).max() < 5e-7
    z0 = beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    assert abs(beam.energy(z0) - 12596.632300384) < 1e-8


@pytest.mark.parametrize("elements", [1, 3])
def test_a_rigid_body_has_the_inertia_of_its_masses(elements):
    beam = paper(elements=elements, hub_radius=0.7, tip_inertia=0.2)
    z = beam.state(omega=2.0)
    m0, (m1, J0) = beam.mass + beam.tip_mass, beam.moments
    inertia = 10.0 + J0 + 2.0 * 0.7 * m1 + 0.7**2 * m0
    assert abs(beam.energy(z) / (2.0 * inertia) - 1.0) < 1e-14
    assert abs(z[-1] / (2.0 * inertia) - 1.0) < 1e-14


def test_work_and_dissipation_balance_the_energy():
    """A motor turns a damped beam under gravity and a follower force; RK4 with small steps."""
    beam = paper(
        coupling="third",
        gravity=(0.0, -9.8),
        damping=(0.05, 1e-4),
        hub_torque=lambda t: 20.0 * np.sin(t),
        tip_force=lambda t, z: (0.0, -0.1 * z[7]),
        follower=True,
    )
    solution = spim.integrate(beam, beam.state(v=[0.1, 0.3]), (0.0, 0.2), 1e-5, method="rk4")
    assert abs(solution.work[-1]) > 1e-3
    assert solution.dissipated[-1] > 1e-3
    assert np.abs(solution.balance_error).max() <= 1e-8 * solution.energy.max()


def test_a_prescribed_rotation_does_the_work_of_its_torque():
    solution = spim.integrate(
        kane(elements=4), kane(elements=4).state(), (0.0, 2.0), 1e-4, method="rk4", every=10
    )
    assert np.abs(solution.balance_error).max() <= 1e-9 * np.abs(solution.work).max()
    assert solution.z.shape == (2001, 24)


def test_the_parts_of_the_energy_are_those_of_rest_and_motion():
    beam = paper()
    still = beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    assert beam.kinetic_energy(still) == 0.0
    assert beam.potential_energy(still) == beam.energy(still)
    moving = beam.state(omega=2.0)
    assert beam.potential_energy(moving) == 0.0
    assert beam.kinetic_energy(moving) == beam.energy(moving)
