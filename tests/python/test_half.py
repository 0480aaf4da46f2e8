"""Half-size doubling of separable systems, beside the whole exponential in pairs."""

import numpy as np
import pytest
from structures import beam, chain

import spim

CASES = {
    "chain": chain(8),
    "long chain": chain(40),
    "beam": beam(4),
    "free beam": beam(4, free=True),
    "no stiffness": (np.eye(3), np.zeros((3, 3))),
    "unstable": (np.eye(3), -chain(3)[1]),
    "huge": (1e-60 * np.eye(2), 1e60 * chain(2)[1]),
    "one": (np.array([[2.0]]), np.array([[3.0]])),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("angle", [-0.3, 2.0, 50.0])
def test_halves_are_the_whole(name, angle):
    M, K = CASES[name]
    system = spim.StructuralSystem(M, K)
    fastest = np.sqrt(np.abs(np.linalg.eigvals(system.A)).max() ** 2)
    # A power of two: the product with A is then exact in both.
    tau = np.sign(angle) * 2.0 ** np.round(np.log2(abs(angle) / fastest)) if fastest else angle
    if name == "unstable":
        tau = np.clip(tau, -4.0, 4.0)
    whole = spim.expm(tau * system.A, method="exact")
    # What steps in pairs is rounded once, what steps in doubles as increment and as a whole.
    for correction, bound in [("exact", 1.3e-16), ("none", 2.3e-16)]:
        made = spim.Propagator(system, tau, method="exact", correction=correction).matrix
        assert np.abs(made - whole).max() <= bound * np.abs(whole).max()
    quick = spim.Propagator(system, tau, method="half", correction="none").matrix
    assert np.abs(quick - whole).max() <= 2e-14 * max(1.0, abs(angle)) * np.abs(whole).max()


def test_defaults_go_by_halves_where_they_can():
    M, K = chain(30)
    undamped, damped = spim.StructuralSystem(M, K), spim.StructuralSystem(M, K, damping=0.1 * K)
    for system, expected in [(undamped, "by halves"), (damped, "SID 21+")]:
        run = spim.integrate(system, system.state(q=np.ones(30)), (0.0, 1.0), 0.1)
        assert expected in run.method


def test_runs_by_halves_in_doubles():
    system = spim.StructuralSystem(*chain(20))
    z0 = np.ones(40)
    exact = spim.integrate(system, z0, (0.0, 50.0), 0.1, correction="exact")
    quick = spim.integrate(system, z0, (0.0, 50.0), 0.1, method="half")
    assert "in doubles" in quick.method
    assert np.abs(quick.z - exact.z).max() <= 1e-11


def test_half_takes_separable_matrices_alone():
    M, K = chain(3)
    damped = spim.StructuralSystem(M, K, damping=K)
    with pytest.raises(ValueError, match="separable"):
        spim.Propagator(damped, 0.1, method="half")
    with pytest.raises(spim.UnsupportedError, match="half: needs a separable system"):
        spim.integrate(damped, damped.state(), (0.0, 1.0), 0.1, method="half")
    with pytest.raises(ValueError, match="separable"):
        spim.expm(np.ones((3, 3)), method="half")
    with pytest.raises(TypeError, match="doublings"):
        spim.expm(np.zeros((2, 2)), method="half", doublings=3)


def test_exponential_of_a_stack_by_halves():
    stack = np.array([spim.StructuralSystem(*chain(2)).A * tau for tau in (0.1, 3.0)])
    np.testing.assert_allclose(spim.expm(stack, method="half"), spim.expm(stack), atol=1e-14)


def test_beyond_doubles_is_an_error():
    M, K = chain(2)
    with pytest.raises(OverflowError):
        spim.Propagator(spim.StructuralSystem(M, -1e8 * K), 1.0)
