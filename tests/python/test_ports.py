"""A few outputs under a few inputs: stepped without the states between blocks."""

import numpy as np
import pytest
from structures import chain

import spim

N = 40
PULL = np.eye(N)[3]
RECORD = np.sin(np.arange(150.0) ** 1.1)
LOADS = {
    "none": None,
    "closed": spim.loads.Harmonic(PULL, 0.7) + spim.loads.Polynomial([PULL]),
    "held": spim.loads.GroundMotion(spim.loads.Sampled(RECORD, 0.1, hold="zero"), np.ones(N)),
    "joined": spim.loads.GroundMotion(spim.loads.Sampled(RECORD, 0.1, start=0.5), np.ones(N)),
    "two": spim.loads.GroundMotion(spim.loads.Sampled(RECORD, 0.1), np.ones(N))
    + spim.loads.GroundMotion(spim.loads.Sampled(RECORD[::-1], 0.1, hold="zero"), PULL)
    + spim.loads.Exponential(PULL, -0.3),
}


@pytest.mark.parametrize("name", LOADS)
@pytest.mark.parametrize("damping", [0.0, 0.05])
@pytest.mark.parametrize("span", [(0.0, 13.0), (0.0, 0.4), (13.0, 3.0)])
@pytest.mark.filterwarnings("ignore:the run")
def test_outputs_are_those_of_whole_states(name, damping, span):
    M, K = chain(N)
    system = spim.StructuralSystem(M, K, damping=damping * K, load=LOADS[name])
    z0 = np.random.default_rng(0).normal(size=2 * N)
    matrix = np.zeros((3, 2 * N))
    matrix[0, 5], matrix[1, N + 7], matrix[2] = 1.0, 1.0, 0.1
    for every in (1, 9):
        few = spim.integrate(system, z0, span, 0.1, outputs=matrix, every=every)
        whole = spim.integrate(system, z0, span, 0.1, every=every)
        assert "outputs alone" in few.method
        assert (few.t == whole.t).all()
        scale = np.abs(whole.z).max()
        assert np.abs(few.outputs - whole.z @ matrix.T).max() <= 2e-13 * scale
        assert np.abs(few.last - whole.z[-1]).max() <= 2e-13 * scale


def test_whole_states_where_those_cost_no_more():
    M, K = chain(N)
    everywhere = spim.loads.Sampled(np.ones((150, N)), 0.1)
    cases = [
        (spim.StructuralSystem(M, K), list(range(N)), {}),
        (spim.StructuralSystem(M, K), [0], {"correction": "exact"}),
        (spim.StructuralSystem(M, K, load=everywhere), [0], {}),
        (spim.StructuralSystem(*chain(3)), [0], {}),
        (spim.StructuralSystem(M, K), [0], {"method": "spim"}),
    ]
    for system, outputs, options in cases:
        z0 = np.ones(system.size)
        few = spim.integrate(system, z0, (0.0, 5.0), 0.1, outputs=outputs, **options)
        whole = spim.integrate(system, z0, (0.0, 5.0), 0.1, **options)
        assert "outputs alone" not in few.method
        assert (few.outputs == whole.z[:, outputs]).all()


def test_growth_ends_with_what_was_there():
    M, K = chain(N)
    system = spim.StructuralSystem(M, -100.0 * K)
    run = spim.integrate(system, np.ones(2 * N), (0.0, 100.0), 0.1, outputs=[0], throw=False)
    whole = spim.integrate(system, np.ones(2 * N), (0.0, 100.0), 0.1, throw=False)
    assert isinstance(run.error, spim.ModelError)
    assert abs(len(run.t) - len(whole.t)) <= 64
    assert np.isfinite(run.outputs).all()


def test_a_bad_load_is_the_error_it_is():
    M, K = chain(N)
    system = spim.StructuralSystem(M, K, load=spim.loads.Function(lambda t: np.nan * PULL))
    with pytest.raises(ValueError, match="nan"):
        spim.integrate(system, np.zeros(2 * N), (0.0, 1.0), 0.1, outputs=[0])
