"""Claims about runs of the rotating beam: published figures, hubs, loads, failures."""

import pickle

import numpy as np
import pytest
from beams import kane, paper

import spim
from spim import models


def last(beam, z0, end, step, method, **options):
    return spim.integrate(beam, z0, (0.0, end), step, method=method, **options).z[-1]


@pytest.mark.parametrize("elements", [2, 7])
def test_methods_converge_to_one_motion(elements):
    beam = paper(elements=elements, hub_radius=0.3, ground_spring=25.0, damping=(0.1, 1e-5))
    z0 = beam.state(
        u=lambda x: 0.2 * x / 8.0,
        v=lambda x: (x / 8.0) ** 2,
        theta=lambda x: x / 32.0,
        omega=1.0,
    )
    exact = last(beam, z0, 0.02, 2e-4, "gauss16")
    errors = {
        name: np.abs(last(beam, z0, 0.02, step, name) - exact).max() / np.abs(exact).max()
        for name, step in (("srk2", 1e-5), ("midpoint", 1e-5), ("gauss8", 2e-4), ("rk4", 1e-5))
    }
    assert errors["srk2"] <= 1e-4
    assert errors["midpoint"] <= 4e-4
    assert errors["gauss8"] <= 1e-6
    assert errors["rk4"] <= 1e-6
    extrapolated = (
        4.0 * last(beam, z0, 0.02, 5e-6, "srk2") - last(beam, z0, 0.02, 1e-5, "srk2")
    ) / 3.0
    # What the square of the extrapolated error leaves.
    assert np.abs(extrapolated - exact).max() <= 5e-8 * np.abs(exact).max()


def peak(coupling, elements, step=5e-3):
    beam = kane(coupling=coupling, elements=elements)
    solution = spim.integrate(beam, beam.state(), (0.0, 20.0), step, method="srk2")
    at = int(np.argmin(solution.tip_v))
    return solution.tip_v[at], solution.t[at], solution


@pytest.mark.parametrize(
    ("coupling", "elements", "wanted"),
    [("foac", 32, -0.57440), ("third", 32, -0.57430), ("third", 8, -0.57341)],
)
def test_the_spin_up_of_kane_ryan_and_banerjee(coupling, elements, wanted):
    found, at, solution = peak(coupling, elements)
    assert abs(found - wanted) <= 3e-5
    assert abs(at - 6.762) <= 5e-3
    # Stretched by its own centrifugal force: rho A Om^2 L^3 / (3 EA), and a little more.
    assert abs(solution.tip_u[-1] / 5.143e-4 - 1.0) <= 1e-3
    # No membrane locking: few elements bend as far.
    assert found < -0.57


def test_zeroth_order_coupling_diverges_where_it_is_known_to():
    beam = kane(coupling="zoac")
    solution = spim.integrate(beam, beam.state(), (0.0, 7.5), 5e-3, method="srk2", throw=False)
    reached = solution.t[np.abs(solution.tip_v) > 1.0]
    assert 6.3 < reached[0] < 7.3


def test_a_joint_tends_to_a_locked_one_with_the_inverse_of_its_stiffness():
    """Turned by a smooth torque, so that the joint's own vibration is not excited."""
    springs = (1e3, 1e5, 1e7)
    torque = {"coupling": "third", "hub_torque": lambda t: 20.0 * np.sin(np.pi * t) ** 2}
    z0 = paper(**torque).state()
    wanted = spim.integrate(paper(**torque), z0, (0.0, 1.0), 1e-3, method="srk2").tip_xy
    off = []
    for spring in springs:
        beam = paper(**torque, joint_spring=spring)
        solution = spim.integrate(beam, beam.state(), (0.0, 1.0), 1e-3, method="srk2")
        off.append(np.abs(solution.tip_xy - wanted).max())
        assert np.abs(solution.balance_error).max() <= 1e-3 * np.abs(solution.work).max()
    slopes = np.diff(np.log(off)) / np.diff(np.log(springs))
    assert np.abs(slopes + 1.0).max() <= 0.1


def test_a_jointed_beam_keeps_its_energy_and_the_momentum_of_its_hub():
    beam = paper(coupling="third", joint_spring=1e4)
    z0 = beam.state(v=[0.05, 0.1], theta=[0.02, 0.02], omega=0.5)
    off = []
    for step in (2e-3, 1e-3):
        solution = spim.integrate(beam, z0, (0.0, 20.0), step, method="srk2")
        off.append(np.abs(solution.energy / solution.energy[0] - 1.0).max())
        assert (solution.p_phi[:, 0] == solution.p_phi[0, 0]).all()
    assert off[0] <= 1e-2
    assert 3.0 <= off[0] / off[1] <= 5.0


def test_loads_damping_and_gravity_balance_in_implicit_steps():
    beam = paper(
        coupling="third",
        gravity=(0.0, -9.8),
        damping=(0.05, 1e-4),
        hub_torque=lambda t: 20.0 * np.sin(t),
        tip_force=lambda t, z: (0.0, -0.1 * z[7]),
        distributed_force=(0.5, 0.0),
        follower=True,
    )
    z0 = beam.state(v=[0.02, 0.06], theta=[0.01, 0.01])
    off = []
    for step in (2e-3, 1e-3, 5e-4):
        solution = spim.integrate(beam, z0, (0.0, 1.0), step, method="srk2")
        size = np.abs(solution.work).max() + solution.dissipated[-1]
        off.append(abs(solution.balance_error[-1]) / size)
    # Of second order: by four where the step is halved.
    assert off[2] <= 1e-3
    assert off[2] < off[0] / 6.0


def test_a_run_that_leaves_its_model_says_so_and_keeps_what_it_has():
    beam = paper(hub_inertia=3.0)
    z0 = beam.state(v=[0.72, 2.4], theta=[0.36, 0.48], v_rate=[6.0, 20.0])
    with pytest.raises(spim.ModelError, match="third") as caught:
        spim.integrate(beam, z0, (0.0, 5.0), 1e-3, method="srk2")
    partial = caught.value.partial
    assert len(partial.t) > 10
    assert np.abs(partial.energy / partial.energy[0] - 1.0).max() <= 0.2
    assert caught.value.step == len(partial.t) - 1


def test_steps_that_are_not_solved_are_an_error_of_their_own():
    beam = paper(coupling="zoac")
    z0 = beam.state(u=[0.1, 0.2], v=[0.5, 1.0], omega=3.0)
    with pytest.raises(spim.ConvergenceError, match="reduce the step") as caught:
        spim.integrate(beam, z0, (0.0, 20.0), 0.1, method="gauss16")
    assert caught.value.iterations > 0
    assert caught.value.partial.t[0] == 0.0


@pytest.mark.parametrize("method", ["srk2", "rk4", "gauss4"])
@pytest.mark.parametrize("bad", ["raises", "nan", "shape"])
def test_a_torque_that_goes_wrong_is_seen_by_the_caller(method, bad):
    def torque(t):
        if t < 0.005:
            return 1.0
        if bad == "raises":
            raise ZeroDivisionError("mine")
        return np.nan if bad == "nan" else [1.0, 2.0]

    beam = paper(hub_torque=torque)
    error = ZeroDivisionError if bad == "raises" else ValueError
    words = "mine" if bad == "raises" else "hub_torque"
    with pytest.raises(error, match=words) as caught:
        spim.integrate(beam, beam.state(), (0.0, 1.0), 1e-4, method=method)
    assert 40 <= len(caught.value.partial.t) <= 52


def test_a_torque_that_depends_on_the_momentum_keeps_the_order():
    """A brake, -p_phi / T: the momentum decays by exp(-t/T)."""
    beam = paper(hub_torque=lambda t, z: -z[-1] / 2.0)
    z0 = beam.state(omega=1.0)
    off = []
    for step in (0.02, 0.01):
        solution = spim.integrate(beam, z0, (0.0, 1.0), step, method="srk2")
        off.append(abs(solution.p_phi[-1] / solution.p_phi[0] - np.exp(-0.5)))
    assert 3.9 <= off[0] / off[1] <= 4.1


def test_a_torque_turns_a_rigid_system_as_it_must():
    """Constant torque on a stiff beam: p_phi = torque t, omega = torque t / inertia."""
    section = models.DistributedSection(1.2, 2.8e9, 1.4e7)
    beam = models.RotatingBeam(
        length=10.0, section=section, elements=3, hub_inertia=50.0, hub_torque=10.0
    )
    solution = spim.integrate(beam, beam.state(), (0.0, 1.0), 1e-3, method="srk2")
    inertia = 50.0 + 1.2 * 1000.0 / 3.0
    assert np.abs(solution.p_phi - 10.0 * solution.t).max() <= 1e-12
    # The beam swings a little about the rigid motion.
    assert abs(solution.omega[-1] / (10.0 / inertia) - 1.0) <= 0.05
    assert abs(solution.work[-1] - 10.0 * solution.phi1[-1]) <= 1e-12


def test_explicit_runs_beyond_their_limit_warn():
    beam = paper()
    z0 = beam.state(v=[0.01, 0.02])
    with pytest.warns(UserWarning, match="w_max h = 3.05"), pytest.raises(spim.ModelError):
        spim.integrate(beam, z0, (0.0, 10.0), 1e-3, method="rk4")


def test_user_tableaus_run_and_are_judged():
    srk2 = spim.RungeKutta([[0.25, 0.0], [0.5, 0.25]], [0.5, 0.5], symplectic=True)
    assert srk2.symplectic_defect == 0.0
    beam = paper()
    z0 = beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    one, other = (last(beam, z0, 0.005, 1e-4, method) for method in (srk2, "srk2"))
    assert np.abs(one - other).max() <= 1e-9 * np.abs(other).max()
    with pytest.raises(ValueError, match="not symplectic"):
        spim.RungeKutta([[0.0, 0.0], [1.0, 0.0]], [0.5, 0.5], symplectic=True)
    assert abs(spim.tableau.symplectic_defect([[0.0]], [1.0]) - 1.0) == 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"length": -1.0}, "length: must be positive"),
        ({"length": np.nan}, "length"),
        ({"elements": 0}, "elements"),
        ({"elements": 2.5}, "elements"),
        ({"tip_mass": -1.0}, "tip_mass"),
        ({"coupling": "fourth"}, "coupling"),
        ({"damping": (-1.0, 0.0)}, "damping"),
        ({"joint_torque": 1.0}, "joint_spring"),
        ({"tip_force": [1.0, 2.0, 3.0]}, "tip_force"),
        ({"rotation": models.SpinUp(1.0, 1.0), "hub_torque": 1.0}, "hub_torque"),
        ({"rotation": 3.0}, "rotation"),
        ({"section": 3}, "section"),
    ],
)
def test_bad_beams_are_refused_by_name(changes, words):
    with pytest.raises((ValueError, TypeError), match=words):
        paper(**changes)


def test_a_free_hub_needs_inertia_where_it_is_asked_to_move():
    for inertia in (None, 0.0):
        beam = paper(hub_inertia=inertia)
        assert beam.modal("clamped").frequencies[0] > 3.8
        with pytest.raises(ValueError, match="hub_inertia"):
            beam.state()


def test_a_taper_must_not_close():
    with pytest.raises(ValueError, match="taper closes"):
        models.TaperedSection((0.05, 0.002), (0.0, 0.002), 2700.0, 7e10)
    with pytest.raises(ValueError, match="mass_per_length: must be positive"):
        models.RotatingBeam(
            length=2.0,
            section=models.DistributedSection(lambda x: 1.0 - x, 1e6, 1e3),
            elements=4,
        )


def test_beams_and_their_runs_can_be_pickled():
    beam = kane(elements=3)
    solution = spim.integrate(beam, beam.state(), (0.0, 1.0), 1e-2, method="srk2")
    again = pickle.loads(pickle.dumps(solution))
    assert (again.tip_v == solution.tip_v).all()
    assert (again.energy == solution.energy).all()


def test_rotations_of_all_kinds_agree():
    up = models.SpinUp(3.0, 2.0)
    t = np.linspace(0.0, 2.5, 5001)
    kinds = [up, models.RotationTable(t, up.omega(t)), lambda t: float(up.omega(t))]
    tips = []
    for rotation in kinds:
        beam = kane(elements=3, rotation=rotation, gravity=(0.0, -9.8))
        solution = spim.integrate(beam, beam.state(), (0.0, 2.5), 1e-2, method="srk2")
        tips.append(solution.tip_xy)
        assert abs(solution.phi1[-1] - float(up.angle(2.5))) <= 1e-6
    for tip in tips[1:]:
        assert np.abs(tip - tips[0]).max() <= 1e-5


def test_trapezoids_rise_hold_and_fall():
    rotation = models.Trapezoid(2.0, rise=1.0, hold=2.0, fall=0.5, start=1.0)
    times = [0.5, 1.5, 3.0, 4.25, 9.0]
    assert np.abs(rotation.omega(times) - [0.0, 1.0, 2.0, 1.0, 0.0]).max() <= 1e-15
    assert abs(rotation.angle(9.0) - 5.5) <= 1e-14


def test_outputs_and_times_of_beams():
    beam = kane(elements=3)
    whole = spim.integrate(beam, beam.state(), (0.0, 1.0), 1e-2, method="srk2")
    outputs = spim.integrate(
        beam, beam.state(), (0.0, 1.0), 1e-2, method="srk2", outputs=[7]
    ).outputs
    assert (outputs[:, 0] == whole.tip_v).all()
    some = spim.integrate(
        beam, beam.state(), (0.0, 1.0), 1e-2, method="srk2", t_eval=[0.5, 0.755, 1.0]
    )
    assert (some.z[0] == whole.z[50]).all()
    assert np.abs(some.work - [whole.work[50], some.work[1], whole.work[100]]).max() <= 1e-18
    assert min(whole.work[75:77]) < some.work[1] < max(whole.work[75:77])
