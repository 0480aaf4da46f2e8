"""Claims about structures: matrices, states, modes, energies, and what bad input raises."""

import numpy as np
import pytest

import spim

M = np.diag([2.0, 1.0, 0.5])
K = np.array([[300.0, -100.0, 0.0], [-100.0, 150.0, -50.0], [0.0, -50.0, 50.0]])
G = np.array([[0.0, 3.0, 0.0], [-3.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def test_first_order_form_is_that_of_the_second_order_equation():
    C = spim.damping.rayleigh(M, K, alpha=0.1, beta=0.01)
    system = spim.StructuralSystem(M, K, damping=C, gyroscopic=G)
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(2, 3))
    z = system.state(q=q, v=v)
    assert np.allclose(system.velocity(z), v, rtol=1e-14)
    rates = system.A @ z
    a = np.linalg.solve(M, -(C + G) @ v - K @ q)
    assert np.allclose(system.acceleration(z), a, rtol=1e-13)
    # q' = v and p' = M a + G v / 2.
    assert np.allclose(rates, np.concatenate([v, M @ a + 0.5 * G @ v]), rtol=1e-13)


def test_gyroscopic_structures_are_hamiltonian_and_keep_their_energy():
    system = spim.StructuralSystem(M, K, gyroscopic=G)
    assert system.hamiltonian
    z0 = system.state(q=[0.1, 0.0, -0.1], v=[0.0, 1.0, 0.0])
    solution = spim.integrate(system, z0, (0.0, 2000.0), 0.2, correction="exact", every=10)
    assert np.abs(solution.energy / solution.energy[0] - 1.0).max() <= 2e-15


def test_energies_are_those_of_the_motion():
    system = spim.StructuralSystem(M, K)
    z = system.state(q=[1.0, 2.0, 3.0], v=[-1.0, 0.5, 2.0])
    assert system.strain_energy(z) == 0.5 * np.array([1, 2, 3]) @ K @ [1, 2, 3]
    assert system.kinetic_energy(z) == pytest.approx(0.5 * (2 + 0.25 + 0.5 * 4), rel=1e-15)
    assert system.energy(z) == system.strain_energy(z) + system.kinetic_energy(z)


def test_sparse_matrices_integers_and_duplicates():
    sparse = pytest.importorskip("scipy.sparse")
    rows, columns = [0, 0, 1, 1, 0], [0, 1, 0, 1, 0]
    for kind in (sparse.coo_matrix, sparse.coo_array):
        stiffness = kind(([2, -1, -1, 1, 1], (rows, columns)), shape=(2, 2))
        system = spim.StructuralSystem(sparse.eye_array(2), stiffness)
        assert np.array_equal(system.stiffness, [[3.0, -1.0], [-1.0, 1.0]])
    assert spim.StructuralSystem([[1, 0], [0, 1]], [[3, -1], [-1, 1]]).A.dtype == np.float64


def test_modes_are_orthonormal_and_rigid_ones_are_zero():
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    modes = spim.StructuralSystem(np.eye(2), 1e6 * free).modal()
    assert modes.frequencies[0] == 0.0
    assert modes.frequencies[1] == pytest.approx(np.sqrt(2e6), rel=1e-14)
    assert np.isnan(modes.damping_ratios[0])
    system = spim.StructuralSystem(M, K, damping=spim.damping.modal(M, K, [0.02, 0.03, 0.05]))
    modes = system.modal(2)
    assert modes.shapes.shape == (3, 2)
    assert np.allclose(modes.shapes.T @ M @ modes.shapes, np.eye(2), atol=1e-14)
    assert np.allclose(modes.damping_ratios, [0.02, 0.03], rtol=1e-12)
    whole = system.modal()
    assert np.sum(whole.participation**2) == pytest.approx(M.sum(), rel=1e-13)


def test_rayleigh_meets_its_ratios():
    w = spim.StructuralSystem(M, K).modal().frequencies
    C = spim.damping.rayleigh(M, K, frequencies=(w[0], w[2]), ratios=(0.02, 0.04))
    ratios = spim.StructuralSystem(M, K, damping=C).modal().damping_ratios
    assert ratios[[0, 2]] == pytest.approx([0.02, 0.04], rel=1e-12)
    assert np.allclose(spim.damping.modal(M, K, 0.0), 0.0)


def test_frequency_response_is_what_a_run_settles_to():
    C = spim.damping.rayleigh(M, K, alpha=1.0, beta=0.01)
    force, w = np.array([0.0, 0.0, 2.0]), 9.0
    load = spim.loads.Harmonic(force, w)
    system = spim.StructuralSystem(M, K, damping=C, gyroscopic=G, load=load)
    response = system.frequency_response(w, force)[0]
    end = 40 * 2.0 * np.pi / w
    solution = spim.integrate(system, system.state(), (0.0, end), end / 400)
    settled = (response * np.exp(1j * w * solution.t[-20:, None])).real
    assert np.allclose(solution.q[-20:], settled, atol=1e-9 * np.abs(response).max())
    one = system.frequency_response([w], outputs=[2])
    assert one.shape == (1, 1, 3)
    assert np.allclose(one[0] @ force, response[2])


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((np.diag([1.0, -1.0, 1.0]), K), ValueError, "mass.*degree of freedom 1 "),
        ((np.diag([1.0, 1.0, 0.0]), K), ValueError, "mass.*degree of freedom 2 "),
        ((M, K + np.eye(3, k=1)), ValueError, r"stiffness: must be symmetric; entries \(0, 1\)"),
        ((M, K[:2, :2]), ValueError, r"stiffness: must be \(3, 3\)"),
        ((M, K, np.eye(2)), ValueError, "damping: must be"),
        ((M, K, None, np.eye(3)), ValueError, "gyroscopic: must be skew"),
        ((M, np.where(K > 200, np.nan, K)), ValueError, r"stiffness: entry \(0, 0\) is nan"),
        ((np.ones(3), K), ValueError, "mass: must be square"),
        ((np.zeros((0, 0)), np.zeros((0, 0))), ValueError, "not empty"),
        ((M * 1j, K), TypeError, "mass: needs real"),
        ((M, "stiff"), TypeError, "stiffness: needs real"),
    ],
)
def test_bad_structures_say_what_is_wrong(arguments, error, words):
    with pytest.raises(error, match=words):
        spim.StructuralSystem(*arguments)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.state(q=[1.0]), r"q: must have shape \(3,\)"),
        (lambda s: s.modal(4), "count: must be 1 to 3"),
        (lambda s: s.frequency_response([1.0], np.ones(2)), "force"),
        (lambda s: spim.damping.rayleigh(M, K), "give frequencies="),
        (lambda s: spim.damping.rayleigh(M, K, frequencies=(1.0, 1.0), ratios=0.1), "different"),
        (lambda s: spim.damping.modal(M, K, [0.1] * 4), "at most 3"),
    ],
)
def test_bad_requests_say_what_is_wrong(call, words):
    with pytest.raises(ValueError, match=words):
        call(spim.StructuralSystem(M, K))


def test_energies_beyond_doubles_are_errors():
    system = spim.StructuralSystem(M, K)
    states = np.ones((3, 6))
    states[1] *= 1e200
    with pytest.raises(OverflowError, match="exceeds 1.8e308 for state 1"):
        system.energy(states)
    limp = spim.StructuralSystem(1e-200 * M, K)
    with pytest.raises(OverflowError, match="velocity: exceeds"), np.errstate(all="ignore"):
        limp.velocity(1e200 * np.ones(6))
