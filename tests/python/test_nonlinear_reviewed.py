"""What readers of the nonlinear part found, so that it stays mended."""

import numpy as np
import pytest

import spim
from spim import models


def test_long_chains_are_stepped_without_a_matrix():
    chain = models.FermiPastaUlamTsingou(springs=100_000)
    for method in ("rk4", "yoshida4", "verlet"):
        run = spim.integrate(chain, chain.state(), (0.0, 0.004), 0.001, method=method)
        assert abs(run.energy[-1] / run.energy[0] - 1.0) < 1e-3


@pytest.mark.parametrize(("springs", "method"), [(65, "gauss16"), (2000, "sofroniou_spaletta10")])
def test_auto_takes_no_exponentials_of_long_chains(springs, method):
    # Their eigenvalues would take minutes as well.
    chain = models.FermiPastaUlamTsingou(springs)
    run = spim.integrate(chain, chain.state(), (0.0, 0.02), 0.01)
    assert run.method.startswith(f"{method} (auto: ")
    assert abs(run.energy[-1] / run.energy[0] - 1.0) < 1e-12


def test_chains_too_long_for_a_matrix_say_so():
    chain = models.FermiPastaUlamTsingou(springs=257)
    for method in ("lawson_gauss4", "eavf", "strang", "spim_explicit"):
        with pytest.raises(spim.UnsupportedError, match="beyond 1024 components take none"):
            spim.integrate(chain, chain.state(), (0.0, 0.02), 0.01, method=method)


def test_frequencies_of_a_chain_are_those_of_its_matrix():
    chain = models.FermiPastaUlamTsingou(3, 50.0)
    assert chain._fastest() == 50.0
    assert np.isclose(np.abs(np.linalg.eigvals(chain._core.matrix).imag).max(), 50.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((2.5, 50.0), "springs: must be a whole number from 1 to 1e6, got 2.5"),
        ((3, -1.0), "frequency: must be positive and finite, got -1"),
    ],
)
def test_numbers_of_a_chain_are_named_with_their_value(given, message):
    with pytest.raises(ValueError, match=message):
        models.FermiPastaUlamTsingou(*given)


def test_true_is_no_number_of_springs():
    with pytest.raises(TypeError, match="springs"):
        models.FermiPastaUlamTsingou(springs=True)


def timed_systems():
    """An oscillator with a potential 0.15 t that says nothing of the motion, in every form."""
    A = [[0.0, 2.0], [-0.5, 0.0]]
    whole = spim.HamiltonianSystem(
        1,
        lambda t, z: [0.5 * z[0], 2.0 * z[1]],
        hamiltonian=lambda t, z: 0.25 * z[0] ** 2 + z[1] ** 2 + 0.15 * t,
    )
    yield whole
    yield spim.SeparableSystem(
        lambda t, q: -0.5 * q, mass=[0.5], potential=lambda t, q: 0.25 * q[0] ** 2 + 0.15 * t
    )
    yield spim.SemilinearSystem(A, lambda t, z: 0.0 * z, potential=lambda t, z: 0.15 * t)
    yield spim.SemilinearSystem(A, force=lambda t, q: 0.0 * q, potential=lambda t, q: 0.15 * t)
    yield spim.SemilinearSystem.about(whole, [0.0, 0.0])


@pytest.mark.parametrize("system", list(timed_systems()))
def test_energies_of_a_run_are_those_at_its_times(system):
    run = spim.integrate(system, [1.0, 0.5], (3.0, 4.0), 0.25)
    # The motion's own energy is conserved: 0.25 + 0.25.
    assert np.abs(run.energy - (0.5 + 0.15 * run.t)).max() < 1e-12
    assert np.abs(run.energy - system.energy(run.z, run.t)).max() == 0.0


def test_energies_of_symbols_are_those_at_their_times():
    sympy = pytest.importorskip("sympy")
    q, p, t = sympy.symbols("q p t")
    system = spim.from_sympy((p**2 + q**2) / 2 + t**2, q, p, t=t)
    run = spim.integrate(system, [1.0, 0.0], (3.0, 4.0), 0.25)
    assert np.abs(run.energy - (0.5 + run.t**2)).max() < 1e-12


def test_last_is_what_the_run_has_reached_not_the_last_time_asked_for():
    circle = spim.HamiltonianSystem(1, lambda t, z: z)
    run = spim.integrate(circle, [1.0, 0.0], (0.0, 1.0), 0.25, t_eval=[0.1, 0.5])
    assert np.abs(run.last - [np.cos(1.0), -np.sin(1.0)]).max() < 1e-14
    assert np.array_equal(run.last, run.state.z)


def test_oscillators_take_the_method_of_modes_or_a_sentence():
    system = models.Oscillators([1.0, 1.0], [1.0, 9.0])
    run = spim.integrate(system, [1.0, 1.0, 0.0, 0.0], (0.0, 1.0), 0.25, method="modal")
    assert np.abs(run.q[-1] - np.cos([1.0, 3.0])).max() < 1e-14
    with pytest.raises(spim.UnsupportedError, match="coordinates.*needs a structure"):
        spim.integrate(system, [1.0] * 4, (0.0, 1.0), 0.25, coordinates="energy")


@pytest.mark.parametrize("approximation", ["quadratic", "cubic", ("trigonometric", 1.0)])
@pytest.mark.parametrize("method", ["spim_explicit", "spim_pc", "spim_implicit"])
def test_steps_from_several_states_have_no_tangent_map(method, approximation):
    system, z0 = models.HenonHeiles(), [0.1, 0.0, 0.2, 0.2]
    run = spim.integrate(system, z0, (0.0, 2.0), 0.125, method=method, approximation=approximation)
    with pytest.raises(spim.UnsupportedError, match="go on from several states"):
        run.jacobian()


def test_the_tangent_map_of_straight_lines_is_that_of_the_run():
    system, z0 = models.HenonHeiles(), np.array([0.1, 0.0, 0.2, 0.2])

    def end(z):
        return spim.integrate(
            system, z, (0.0, 1.0), 0.125, method="spim_implicit", approximation="linear"
        )

    J, d = end(z0).jacobian(), 1e-5
    column = (end(z0 + [d, 0, 0, 0]).last - end(z0 - [d, 0, 0, 0]).last) / (2.0 * d)
    assert np.abs(J[:, 0] - column).max() < 1e-9


def test_a_tableau_is_taken_as_options_too():
    system, z0 = models.HenonHeiles(), [0.1, 0.0, 0.2, 0.2]
    a, b = np.array([[0.25, 0.0], [0.5, 0.25]]), [0.5, 0.5]
    one = spim.integrate(system, z0, (0.0, 1.0), 0.125, method="runge_kutta", a=a, b=b)
    other = spim.integrate(system, z0, (0.0, 1.0), 0.125, method=spim.RungeKutta(a, b))
    assert np.array_equal(one.z, other.z)
    with pytest.raises(TypeError, match="both a= and b="):
        spim.integrate(system, z0, (0.0, 1.0), 0.125, method="runge_kutta", a=a)


def test_labels_of_auto_are_said_to_be_those_of_linear_systems():
    auto = next(method for method in spim.methods() if method.name == "auto")
    assert "of others lawson_gauss16, gauss16 or srk2, with theirs" in auto.summary
    docs = [m.options["approximation"] for m in spim.methods() if "approximation" in m.options]
    assert len(docs) == 3
    assert all("so not symmetric" in doc for doc in docs)


@pytest.mark.parametrize("kind", [SystemExit, GeneratorExit, KeyboardInterrupt])
def test_throw_false_returns_exceptions_alone(kind):
    def rate(t, z):
        if t > 0.5:
            raise kind
        return -z

    with pytest.raises(kind) as caught:
        spim.integrate(spim.FlowSystem(1, rate), [1.0], (0.0, 1.0), 0.1, method="rk4", throw=False)
    assert len(caught.value.partial.t) > 3


def flow(function):
    return spim.FlowSystem(1, lambda t, z: [function(z[0])])


@pytest.mark.parametrize(
    ("function", "z", "slope"),
    [
        (lambda z: np.sin(1000.0 * z), 1.0, 1000.0 * np.cos(1000.0)),
        (lambda z: np.tanh(1e6 * (z - 1.0)), 1.0, 1e6),
        (lambda z: np.exp(-1e10 * z) - 1.0, 0.0, -1e10),
        (lambda z: z + 1e-6 * np.sin(1e6 * z), 0.0, 2.0),
    ],
)
def test_linearisation_finds_scales_below_its_differences(function, z, slope):
    assert abs(spim.linearize(flow(function), [z])[0, 0] / slope - 1.0) < 1e-10


def test_linearisation_warns_of_scales_it_cannot_find_and_takes_one_given():
    fine = flow(lambda z: np.sin(1e18 * z))
    with pytest.warns(UserWarning, match="component 0 of the state do not agree"):
        spim.linearize(fine, [0.0])
    assert abs(spim.linearize(fine, [0.0], scale=1e-18)[0, 0] / 1e18 - 1.0) < 1e-10
    for scale in (0.0, -1.0, [1.0, 2.0]):
        with pytest.raises(ValueError, match="scale: must be a positive number or 1"):
            spim.linearize(fine, [0.0], scale=scale)


@pytest.mark.parametrize("scale", [None, [1e-10, 1e-23]])
def test_a_molecule_in_si_units_is_split_at_its_frequency(scale):
    # Hydrogen: J, 1/m, m, kg.
    depth, a, rest, mass = 7.2e-19, 1.9e10, 7.4e-11, 8.4e-28

    def gradient(t, z):
        pull = np.exp(-a * (z[0] - rest))
        return [2.0 * depth * a * pull * (1.0 - pull), z[1] / mass]

    molecule = spim.HamiltonianSystem(1, gradient)
    split = spim.SemilinearSystem.about(molecule, [rest, 0.0], scale=scale)
    found = np.sqrt(-split.linear[0, 1] * split.linear[1, 0])
    assert abs(found / (a * np.sqrt(2.0 * depth / mass)) - 1.0) < 1e-10


def test_linearisation_takes_rounded_rates_as_they_are():
    # Ten digits are lost; a kink has the mean of its slopes.
    assert abs(spim.linearize(flow(lambda z: (z + 1e6) - 1e6), [0.3])[0, 0] - 1.0) < 1e-7
    assert abs(spim.linearize(flow(lambda z: max(z, 0.0)), [0.0])[0, 0] - 0.5) < 1e-12


def test_a_forgotten_args_is_named_not_taken_for_a_nan():
    system = spim.FlowSystem(1, lambda t, z, k: -k * z)
    with pytest.raises(ValueError, match=r"rate: has three arguments.*written nothing.*args="):
        spim.integrate(system, [1.0], (0.0, 1.0), 0.1, method="rk4")

    def writes_and_returns(t, z, out):
        out[:] = -z
        return out

    system = spim.FlowSystem(1, writes_and_returns)
    run = spim.integrate(system, [1.0], (0.0, 1.0), 0.1, method="gauss8")
    assert abs(run.last[0] - np.exp(-1.0)) < 1e-10


@pytest.mark.parametrize("batch", [False, True])
def test_a_compiled_energy_that_writes_a_gradient_spoils_nothing(batch):
    numba = pytest.importorskip("numba")

    @numba.cfunc(spim.cfunc_signature(batch))
    def energy(t, z, out):
        for i in range(8 if batch else 1):
            out[i] = 0.5 * z[i]
        for i in range(8 if batch else 1, 512 if batch else 64):
            out[i] = 1e300

    system = spim.HamiltonianSystem(32, lambda t, z: z, hamiltonian=energy)
    z = np.arange(1.0, 65.0) * np.ones((50, 1))
    assert (system.energy(z) == 0.5).all()


def circle(step, **options):
    return spim.integrate(
        spim.HamiltonianSystem(1, lambda t, z: z), [1.0, 0.0], (0.0, 1.0), step, **options
    )


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda run: run(0.3), "states at any time"),
        (lambda run: run.jacobian(), "jacobian"),
        (lambda run: run.z, "z"),
    ],
)
def test_what_needs_states_says_that_outputs_were_stored(call, words):
    with pytest.raises((AttributeError, spim.UnsupportedError), match=f"{words}: only outputs"):
        call(circle(0.1, outputs=[0]))


def test_a_run_of_outputs_can_still_be_asked_for_what_it_may_have():
    run = circle(0.1, outputs=[0])
    assert not hasattr(run, "z")
    assert hasattr(run, "outputs")


@pytest.mark.parametrize("terminal", [2.0, np.float64(2.0)])
def test_a_count_of_events_may_be_a_whole_float(terminal):
    def crosses(t, z):
        return z[0]

    crosses.terminal = terminal
    system = spim.HamiltonianSystem(1, lambda t, z: z)
    run = spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.1, events=crosses)
    assert abs(run.t[-1] - 1.5 * np.pi) < 1e-12
    crosses.terminal = 2.5
    with pytest.raises(ValueError, match="terminal: must be True, False or a count, got 2.5"):
        spim.integrate(system, [1.0, 0.0], (0.0, 10.0), 0.1, events=crosses)


def test_a_number_of_coordinates_must_be_that_of_the_masses():
    with pytest.raises(ValueError, match="dof: is 3, but mass is of 2"):
        spim.SeparableSystem(lambda t, q: -q, mass=[1.0, 1.0], dof=3)
    assert spim.SeparableSystem(lambda t, q: -q, mass=[1.0, 1.0], dof=2).size == 4


def test_velocities_may_be_written_in_place():
    def velocity(p, out):
        out[:] = 2.0 * p

    writes = spim.SeparableSystem(lambda t, q: -q, velocity=velocity, dof=1)
    returns = spim.SeparableSystem(lambda t, q: -q, velocity=lambda p: 2.0 * p, dof=1)
    one, other = (
        spim.integrate(system, [1.0, 0.0], (0.0, 1.0), 0.1, method="verlet")
        for system in (writes, returns)
    )
    assert np.array_equal(one.z, other.z)

    def scaled(p, out, k):
        out[:] = k * p

    with_args = spim.SeparableSystem(
        lambda t, q, k: -q, velocity=scaled, dof=1, args=(2.0,), vectorized=True
    )
    again = spim.integrate(with_args, [1.0, 0.0], (0.0, 1.0), 0.1, method="verlet")
    assert np.array_equal(again.z, other.z)


def test_a_velocity_takes_its_args():
    system = spim.SeparableSystem(
        lambda t, q, k: -q, velocity=lambda p, k: k * p, dof=1, args=(2.0,)
    )
    assert (system.rate([1.0, 3.0]) == [6.0, -1.0]).all()


@pytest.mark.parametrize("name", ["angular_momentum", "eccentricity_vector"])
def test_states_of_other_lengths_are_named(name):
    with pytest.raises(ValueError, match=r"z: must have shape \(\.\.\., 4\), got \(3,\)"):
        getattr(models.Kepler(), name)([1.0, 2.0, 3.0])


def test_states_of_the_solar_system_and_of_chains_are_checked_as_well():
    for call in (
        lambda: models.OuterSolarSystem().momentum([1.0]),
        lambda: models.OuterSolarSystem().angular_momentum(np.ones((2, 35))),
        lambda: models.FermiPastaUlamTsingou().oscillatory_energy(np.ones(11)),
    ):
        with pytest.raises(ValueError, match="z: must have shape"):
            call()


@pytest.mark.parametrize(
    ("method", "option"),
    [
        ("gauss8", {"roundoff": "minimal"}),
        ("spim_pc", {"approximation": "linear"}),
        ("midpoint", {"newton": "constant"}),
        ("eavf", {"nodes": 8}),
    ],
)
def test_a_resumed_run_may_name_a_default(method, option):
    system, z0 = models.HenonHeiles(), [0.1, 0.0, 0.2, 0.2]
    whole = spim.integrate(system, z0, (0.0, 2.0), 0.125, method=method)
    half = spim.integrate(system, z0, (0.0, 1.0), 0.125, method=method)
    rest = spim.integrate(system, None, (1.0, 2.0), resume=half, **option)
    assert np.array_equal(rest.last, whole.last)


def test_a_resumed_run_takes_no_other_option_and_no_other_matrix():
    def split(stiffness):
        return spim.SemilinearSystem([[0.0, 1.0], [-stiffness, 0.0]], force=lambda t, q: -(q**3))

    half = spim.integrate(split(4.0), [0.1, 0.0], (0.0, 1.0), 0.125, method="gauss8")
    with pytest.raises(ValueError, match="resume: .*options"):
        spim.integrate(split(4.0), None, (1.0, 2.0), resume=half, roundoff="tolerance")
    with pytest.raises(ValueError, match="that of a system of other parameters"):
        spim.integrate(split(5.0), None, (1.0, 2.0), resume=half)


def test_a_numba_cfunc_comes_to_solve_ivp_as_its_docstring_says():
    numba = pytest.importorskip("numba")
    scipy = pytest.importorskip("scipy")

    @numba.cfunc(spim.cfunc_signature())
    def rate(t, z, out):
        out[0] = -z[0]

    fun = scipy.LowLevelCallable(rate.ctypes)
    run = scipy.integrate.solve_ivp(fun, (0.0, 1.0), [1.0], method=spim.Gauss8, step=0.1)
    assert abs(run.y[0, -1] - np.exp(-1.0)) < 1e-14


def symbolic_faults():
    sympy = pytest.importorskip("sympy")
    q, p, k, m, t = sympy.symbols("q p k m t")
    theta, free = sympy.Function("theta")(t), p**2 / 2 + q**2 / 2
    spring = p**2 / 2 + k * q**2
    yield (p**2 / 2 + sympy.Function("V")(q), q, p), {}, ValueError, r"H: no code for V\(q\)"
    yield (free + sympy.I * q, q, p), {}, ValueError, "H: must be real"
    yield (sympy.Eq(q, p), q, p), {}, TypeError, "H: must be an expression, got Equality"
    yield (sympy.Matrix([q]), q, p), {}, TypeError, "H: must be an expression"
    for value in (m, np.ones(2), 1j, "1", None):
        yield (spring, q, p, {k: value}), {}, TypeError, "parameters: k must be a real number, got"
    yield (free, [q, q], [p, p]), {}, ValueError, "q is there twice"
    yield (free, q, q), {}, ValueError, "q is there twice"
    yield (free, q, p, {q: 1.0}), {}, ValueError, "q is there twice"
    yield (free, q, p), {"t": q}, ValueError, "q is there twice"
    yield (p**2 / 2 - sympy.cos(theta), theta, p), {}, TypeError, "q: .*put a symbol in its place"
    yield (free, "q", "p"), {}, TypeError, "q: must be sympy symbols, got 'q'"
    yield (free, 2 * q, p), {}, TypeError, "q: must be sympy symbols, got 2"
    yield (p**2 / (2 * m), q, p, {m: 0.0}), {}, ValueError, "parameters: H is zoo"


def test_symbols_that_cannot_be_used_are_named():
    for given, named, error, words in symbolic_faults():
        with pytest.raises(error, match=words):
            spim.from_sympy(*given, **named)


def test_numbers_of_sympy_are_numbers_of_parameters():
    sympy = pytest.importorskip("sympy")
    q, p, k = sympy.symbols("q p k")
    system = spim.from_sympy(p**2 / 2 + k * q**2 / 2, q, p, {k: sympy.Rational(1, 4)})
    assert system.energy([2.0, 0.0]) == 0.5


def unaligned(numbers):
    """Doubles that begin at an odd address, as those of files and records may."""
    numbers = np.asarray(numbers, float)
    return np.frombuffer(b"x" + numbers.tobytes(), offset=1).reshape(numbers.shape)


class Named(np.ndarray):
    """A subclass, as packages have them."""


def test_numbers_may_lie_anywhere():
    system = spim.HamiltonianSystem(1, lambda t, z: unaligned([np.sin(z[0]), z[1]]))
    right = spim.HamiltonianSystem(1, lambda t, z: np.array([np.sin(z[0]), z[1]]))
    for z0 in (unaligned([1.0, 0.0]), unaligned([1.0, 0.0]).view(Named), [1.0, 0.0]):
        found = spim.integrate(system, z0, (0.0, 1.0), 0.1, method="gauss8")
        assert (found.z == spim.integrate(right, z0, (0.0, 1.0), 0.1, method="gauss8").z).all()
    A = [[0.0, 1.0], [-1.0, 0.0]]
    assert (spim.expm(unaligned(A)) == spim.expm(A)).all()
    assert (spim.expm(unaligned(A).view(Named)) == spim.expm(A)).all()


def test_tangent_maps_do_not_end_iterations_early():
    system, z0 = spim.models.Kepler(), [0.7, 0.0, 0.0, np.sqrt(1.3 / 0.7)]
    maps = [
        spim.integrate(system, z0, (0.0, 5.0), 0.05, method="gauss32", roundoff=roundoff).jacobian()
        for roundoff in ("minimal", ("tolerance", 1e-10))
    ]
    assert abs(np.linalg.det(maps[1]) - 1.0) <= 1e-11
    assert np.abs(maps[1] - maps[0]).max() <= 1e-7 * np.abs(maps[0]).max()


@pytest.mark.parametrize("method", ["gauss4", "gauss6", "gauss8", "gauss12"])
def test_few_stages_take_no_more_iterations_for_oscillators_than_for_groups(method):
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3:, :3] = -np.diag([1.0, 4.0, 9.0])

    def rest(t, z):
        return np.array([0.0, 0.0, 0.0, -z[0] * z[1], -0.5 * z[0] ** 2, 0.0])

    work = []
    for damping in (0.0, 1e-300):
        A[3:, 3:] = -damping * np.eye(3)
        system = spim.SemilinearSystem(A, rest)
        z0 = [0.1, 0.2, 0.1, 0.0, 0.1, 0.2]
        run = spim.integrate(system, z0, (0.0, 10.0), 0.1, method=method, roundoff="tolerance")
        work.append(run.stats["evaluations"])
    assert work[0] <= 1.02 * work[1]


@pytest.mark.parametrize(
    "wrong", [("tolerance", "1e-13"), ("tolerance",), {"tolerance": 1e-13}, ("tolerance", -1e-13)]
)
def test_a_wrong_ending_is_told_what_there_is(wrong):
    start = [1.0, 0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match=r"^roundoff: .*(positive|number\)).*, got "):
        spim.integrate(
            spim.models.Kepler(), start, (0.0, 1.0), 0.1, method="gauss8", roundoff=wrong
        )


def test_a_tolerance_may_come_in_a_list():
    start = [1.0, 0.0, 0.0, 1.0]
    ends = [
        spim.integrate(
            spim.models.Kepler(), start, (0.0, 1.0), 0.1, method="gauss8", roundoff=roundoff
        ).z
        for roundoff in (["tolerance", 1e-12], ("tolerance", 1e-12))
    ]
    assert (ends[0] == ends[1]).all()
