"""Exponential methods as a user meets them: orders, energies, what they need, what they warn of."""

import pickle

import numba
import numpy as np
import pytest
import sympy

import spim
from spim import models

LAWSON = {2: "lawson_gauss2", 8: "lawson_gauss8", 12: "lawson_gauss12", 16: "lawson_gauss16"}


def energy_error(solution):
    return np.abs(solution.energy / solution.energy[0] - 1.0).max()


def chain():
    system = models.FermiPastaUlamTsingou(3, 50.0)
    return system, system.state()


def test_lawson_gauss_does_not_drift_over_a_million_steps():
    system, z0 = chain()
    run = spim.integrate(system, z0, (0.0, 3000.0), 0.003, method="lawson_gauss8", every=1000)
    assert energy_error(run) <= 1e-14  # 10 u sqrt(N) would be 1e-12


@pytest.mark.parametrize("method", LAWSON.values())
def test_roundoff_is_an_option(method):
    system, z0 = models.HenonHeiles(), [0.0, 0.1, 0.48, 0.0]
    ends = [
        spim.integrate(system, z0, (0.0, 5.0), 0.05, method=method, roundoff=roundoff).z[-1]
        for roundoff in ("minimal", "tolerance")
    ]
    # The same equations, solved to rounding and to somewhat more.
    assert np.abs(ends[0] - ends[1]).max() <= 1e-13
    for wrong in ("none", 1e-13, ("minimal", 1e-13), ("tolerance", 0.0), ("tolerance", 1e-3)):
        with pytest.raises(ValueError, match="roundoff: "):
            spim.integrate(system, z0, (0.0, 5.0), 0.05, method=method, roundoff=wrong)


@pytest.mark.parametrize("method", ["gauss16", "lawson_gauss8"])
def test_a_tolerance_of_iterations_is_an_error_a_step_and_saves_iterations(method):
    system, z0 = models.CompoundPendulum(), [0.1, 0.5, 0.0, 0.0]

    def run(roundoff):
        return spim.integrate(
            system, z0, (0.0, 5.0), 0.05, method=method, every=100, roundoff=roundoff
        )

    exact = run("minimal")
    work = [exact.stats["evaluations"]]
    for tolerance in (1e-16, 1e-12, 1e-8):
        found = run(("tolerance", tolerance))
        assert np.abs(found.z[-1] - exact.z[-1]).max() <= 1e-14 + 100 * tolerance
        assert (np.abs(found.z[-1] - exact.z[-1]).max() >= 1e-11) == (tolerance == 1e-8)
        work.append(found.stats["evaluations"])
    assert work == sorted(work, reverse=True)
    assert len(set(work)) == 4
    assert (run(("tolerance", 1e-16)).z[-1] == run("tolerance").z[-1]).all()


def test_eavf_keeps_the_energy_at_steps_beyond_every_resonance():
    system, z0 = chain()
    run = spim.integrate(system, z0, (0.0, 400.0), 0.2, method="eavf")
    assert energy_error(run) <= 1e-13  # 10 u sqrt(N)
    few = spim.integrate(system, z0, (0.0, 400.0), 0.2, method="eavf", nodes=1)
    assert energy_error(few) >= 1e-6
    with pytest.raises(ValueError, match="nodes"):
        spim.integrate(system, z0, (0.0, 1.0), 0.1, method="eavf", nodes=5)


@pytest.mark.parametrize(
    ("method", "order"),
    [("strang", 2), ("mollified_impulse", 2), ("mclachlan84", 4), ("eavf", 2)],
)
def test_orders_on_a_chain(method, order):
    system = models.FermiPastaUlamTsingou(2, 3.0)
    z0 = system.state()
    exact = spim.integrate(system, z0, (0.0, 2.0), 0.01, method="gauss16").z[-1]
    steps = (0.04, 0.02, 0.01, 0.005)
    errors = [
        np.abs(spim.integrate(system, z0, (0.0, 2.0), h, method=method).z[-1] - exact).max()
        for h in steps
    ]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.abs(slopes - order).max() <= 0.15


def test_impulses_resonate_and_say_so_and_mollified_ones_do_neither():
    system, z0 = chain()
    step, end = np.pi / 50.0, np.pi / 50.0 * 5000
    with pytest.warns(UserWarning, match=r"strang: w_max h = 3\.14 .* mollified_impulse or eavf"):
        impulse = spim.integrate(system, z0, (0.0, end), step, method="strang", throw=False)
    mollified = spim.integrate(system, z0, (0.0, end), step, method="mollified_impulse")
    assert energy_error(mollified) <= 0.05
    assert not impulse.success or energy_error(impulse) >= 1.0
    with pytest.warns(UserWarning, match="lawson_gauss4"):
        spim.integrate(system, z0, (0.0, 1.0), 0.05, method="lawson_gauss4")


def test_a_semilinear_system_of_functions_warns_too():
    system = spim.SemilinearSystem([[0.0, 1.0], [-1e4, 0.0]], lambda t, z: [0.0, -(z[0] ** 3)])
    with pytest.warns(UserWarning, match="w_max h = 10"):
        spim.integrate(system, [0.01, 0.0], (0.0, 1.0), 0.1, method="lawson_gauss2")


STIFF = np.array([[0, 0, 1, 0], [0, 0, 0, 2], [-4, 0, 0, 0], [0, -100, 0, 0.0]])
START = np.array([1.0, 0.1, 0.2, 0.3])


def push(t, q):
    return np.array([-(q[0] ** 3) - q[0] * q[1] ** 2, -q[1] * q[0] ** 2 + 0.0 * t])


def stored(t, q):
    return 0.25 * q[0] ** 4 + 0.5 * q[0] ** 2 * q[1] ** 2


@numba.cfunc(spim.cfunc_signature())
def compiled_push(t, q, out):
    q, out = numba.carray(q, 2), numba.carray(out, 2)
    out[0] = -(q[0] ** 3) - q[0] * q[1] ** 2
    out[1] = -q[1] * q[0] ** 2


@pytest.mark.parametrize(
    "given",
    [{"force": push}, {"force": push, "vectorized": True}, {"force": compiled_push}],
    ids=["plain", "vectorized", "compiled"],
)
def test_a_force_of_coordinates_is_stepped_by_all_methods(given):
    system = spim.SemilinearSystem(STIFF, **given)
    whole = spim.SemilinearSystem(STIFF, lambda t, z: np.concatenate([[0, 0], push(t, z[:2])]))
    exact = spim.integrate(whole, START, (0.0, 5.0), 0.02, method="gauss16").z[-1]
    limits = {
        "strang": 2e-2,
        "mollified_impulse": 5e-2,
        "mclachlan84": 1e-5,
        "lawson_gauss4": 1e-4,
        "lawson_gauss16": 1e-12,
        "gauss16": 1e-12,
        "eavf": 5e-2,
        "spim_pc": 5e-2,
    }
    for method, limit in limits.items():
        run = spim.integrate(system, START, (0.0, 5.0), 0.02, method=method)
        assert np.abs(run.z[-1] - exact).max() <= limit, method


def test_a_force_has_an_energy_a_jacobian_and_pickles():
    def slope(t, q):
        return [[-3 * q[0] ** 2 - q[1] ** 2, -2 * q[0] * q[1]], [-2 * q[0] * q[1], -(q[0] ** 2)]]

    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-4, 0, 0, 0], [0, -100, 0, 0.0]])
    system = spim.SemilinearSystem(A, force=push, jacobian=slope, potential=stored)
    plain = spim.SemilinearSystem(A, force=push)
    given, found = spim.linearize(system, START), spim.linearize(plain, START)
    assert np.abs(given - found).max() <= 1e-9  # of 100, by differences
    assert np.abs(given[:2] - A[:2]).max() == 0.0
    assert np.abs(given[2:, :2] - (A[2:, :2] + slope(0.0, START))).max() <= 1e-14
    run = spim.integrate(system, START, (0.0, 50.0), 0.02, method="mclachlan84")
    assert energy_error(run) <= 1e-4
    by_hand = 0.5 * (START[2:] ** 2 + [4, 100] * START[:2] ** 2).sum() + stored(0.0, START)
    assert abs(run.energy[0] / by_hand - 1.0) <= 1e-14
    again = pickle.loads(pickle.dumps(plain))
    assert (again.rate(START) == plain.rate(START)).all()


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({}, TypeError, "either nonlinear or force="),
        ({"nonlinear": push, "force": push}, TypeError, "either nonlinear or force="),
        ({"force": lambda t, q: q[:1]}, ValueError, "force: must give 2 numbers"),
        ({"force": 3}, TypeError, "force: must be a function"),
    ],
)
def test_wrong_forces_are_named(given, error, words):
    with pytest.raises(error, match=words):
        spim.integrate(spim.SemilinearSystem(STIFF, **given), START, (0.0, 0.1), 0.1)
    with pytest.raises(ValueError, match=r"force: needs a state z = \[q; p\], got .* 3 rows"):
        spim.SemilinearSystem(np.eye(3), force=push)


def test_symbols_tell_forces_of_coordinates_from_others():
    x, y, px, py = sympy.symbols("x y p_x p_y")
    kinetic = (px**2 + py**2) / 2
    springs = (4 * x**2 + 100 * y**2) / 2
    soft = x**2 * y + x**4 / 4
    systems = {
        # Separable, and turned by a rotating frame.
        "plain": spim.from_sympy(kinetic + springs + soft, [x, y], [px, py]),
        "turned": spim.from_sympy(kinetic + springs + x * py - y * px + soft, [x, y], [px, py]),
    }
    z0 = [0.3, 0.02, 0.1, 0.1]
    for system in systems.values():
        exact = spim.integrate(system, z0, (0.0, 5.0), 0.01, method="gauss16").z[-1]
        run = spim.integrate(system, z0, (0.0, 5.0), 0.01, method="mclachlan84")
        assert np.abs(run.z[-1] - exact).max() <= 1e-7
        assert energy_error(run) <= 1e-7
    quartic = spim.from_sympy(kinetic + springs + soft + px**4 / 4, [x, y], [px, py])
    with pytest.raises(spim.UnsupportedError, match="force of the coordinates"):
        spim.integrate(quartic, z0, (0.0, 0.1), 0.01, method="strang")


@pytest.mark.parametrize("method", ["strang", "mollified_impulse", "mclachlan84"])
def test_splittings_refuse_remainders_of_momenta(method):
    system, z0 = models.CompoundPendulum(), [0.1, 0.5, 0.0, 0.0]
    with pytest.raises(spim.UnsupportedError, match="force of the coordinates"):
        spim.integrate(system, z0, (0.0, 1.0), 0.01, method=method)


def test_eavf_refuses_a_damped_linear_part():
    system = spim.SemilinearSystem([[0.0, 1.0], [-1.0, -0.1]], lambda t, z: [0.0, -(z[0] ** 3)])
    with pytest.raises(spim.UnsupportedError, match="Hamiltonian A"):
        spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, method="eavf")
    run = spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.1, method="lawson_gauss8")
    fine = spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.05, method="gauss16")
    assert np.abs(run.z[-1] - fine.z[-1]).max() <= 1e-11


@pytest.mark.parametrize("method", ["spim_explicit", "spim_pc", "spim_implicit"])
@pytest.mark.parametrize(
    ("approximation", "order"),
    [("linear", 2), ("quadratic", 3), ("cubic", 4), (("trigonometric", 3.0), 3)],
)
def test_functions_for_the_remainder_have_their_order(method, approximation, order):
    system, z0 = models.CompoundPendulum(), [0.1, np.pi / 6.0, 0.0, 0.0]
    exact = spim.integrate(system, z0, (0.0, 2.0), 0.01, method="gauss16").z[-1]
    errors = [
        np.abs(
            spim.integrate(system, z0, (0.0, 2.0), h, method=method, approximation=approximation).z[
                -1
            ]
            - exact
        ).max()
        for h in (0.00125, 0.000625)
    ]
    assert abs(np.log2(errors[0] / errors[1]) - order) <= 0.15


@pytest.mark.parametrize(
    "approximation", ["quartic", "trigonometric", ("trigonometric", -1.0), ("cosine", 1.0), 3.0]
)
def test_other_functions_are_refused(approximation):
    with pytest.raises(ValueError, match="approximation"):
        spim.integrate(
            models.HenonHeiles(),
            [0.0, 0.1, 0.4, 0.0],
            (0.0, 1.0),
            0.1,
            method="spim_pc",
            approximation=approximation,
        )
    with pytest.raises(ValueError, match="another frequency or step"):
        spim.integrate(
            models.HenonHeiles(),
            [0.0, 0.1, 0.4, 0.0],
            (0.0, 1.0),
            0.1,
            method="spim_pc",
            approximation=("trigonometric", 10.0 * np.pi),
        )


@pytest.mark.parametrize(
    "method", ["verlet", "yoshida8", "blanes_moan6", "kahan_li8", "sofroniou_spaletta10"]
)
def test_compositions_keep_the_energy_of_kepler_within_a_band(method):
    kepler = models.Kepler()
    z0 = kepler.state(0.3)
    run = spim.integrate(kepler, z0, (0.0, 2000.0), 0.05, method=method, every=50)
    error = np.abs(run.energy / run.energy[0] - 1.0)
    halves = np.array_split(error, 2)
    assert halves[1].max() <= 1.5 * halves[0].max() + 1e-13  # 10 u sqrt(N)


def test_exponential_methods_step_the_rotating_beam():
    section = models.DistributedSection(1.2, 2.8e5, 1.4e3)
    beam = models.RotatingBeam(length=4.0, section=section, elements=2, hub_inertia=10.0)
    z0 = beam.state(v=[0.01, 0.03])
    h = 0.5 / beam._core.fastest
    exact = spim.integrate(beam, z0, (0.0, 200 * h), 0.5 * h, method="gauss16").z[-1]
    limits = {"spim_pc": 1e-5, "spim_implicit": 1e-5, "lawson_gauss4": 1e-7, "lawson_gauss8": 1e-11}
    for method, limit in limits.items():
        run = spim.integrate(beam, z0, (0.0, 200 * h), h, method=method)
        assert np.abs(run.z[-1] - exact).max() <= limit * np.abs(exact).max(), method
    jointed = models.RotatingBeam(
        length=4.0, section=section, elements=2, hub_inertia=10.0, joint_spring=100.0
    )
    with pytest.raises(spim.UnsupportedError, match="joint locked"):
        spim.integrate(jointed, jointed.state(), (0.0, 1.0), 1e-3, method="lawson_gauss4")
