"""Claims about the balance of energy: each part is integrated on its own."""

import numpy as np
import pytest

import spim
from spim import loads

N = 5
M = np.diag(1.0 + np.arange(N) / N)
K = 200.0 * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
C = spim.damping.rayleigh(M, K, alpha=0.2, beta=2e-3)
G = np.diag([3.0] * (N - 1), 1) - np.diag([3.0] * (N - 1), -1)
RECORD = np.random.default_rng(0).normal(size=(401, N))


def run(load, damping=C, gyroscopic=None, step=0.05):
    system = spim.StructuralSystem(M, K, damping=damping, gyroscopic=gyroscopic, load=load)
    z0 = system.state(q=0.1 * np.arange(N), v=np.ones(N))
    return spim.integrate(system, z0, (0.0, 400 * step), step, correction="exact")


@pytest.mark.parametrize(
    "load",
    [
        None,
        loads.Polynomial([np.ones(N), 0.1 * np.arange(N)]) + loads.Harmonic(np.arange(N), 7.0, 0.3),
        loads.Sampled(RECORD, 0.05),
        loads.Sampled(RECORD, 0.05, hold="zero") + loads.Exponential(np.ones(N), -0.3),
        loads.GroundMotion(loads.Sampled(RECORD[:, 0], 0.05, start=1.0), np.ones(N)),
    ],
)
@pytest.mark.parametrize("gyroscopic", [None, G])
@pytest.mark.filterwarnings("ignore:the run")
def test_energy_is_what_work_and_dissipation_leave(load, gyroscopic):
    solution = run(load, gyroscopic=gyroscopic)
    size = solution.energy.max() + np.abs(solution.work).max() + solution.dissipated[-1]
    assert np.abs(solution.balance_error).max() <= 1e-13 * size
    assert (np.diff(solution.dissipated) >= 0.0).all()
    assert solution.dissipated[-1] > 0.1 * size or load is not None


def test_the_parts_are_those_of_quadrature():
    load = loads.Harmonic(np.arange(N), 7.0, 0.3)
    coarse, fine = run(load, step=0.04), run(load, step=0.0025)
    power = np.einsum("ki,ki->k", fine.v, load(fine.t))
    loss = np.einsum("ki,ij,kj->k", fine.v, C, fine.v)
    for mine, rate in ((coarse.work, power), (coarse.dissipated, loss)):
        # Simpson's rule over pairs of fine steps.
        pairs = 0.0025 / 3.0 * (rate[:-2:2] + 4.0 * rate[1:-1:2] + rate[2::2])
        by_hand = np.concatenate([[0.0], np.cumsum(pairs)])[::8]
        assert np.abs(mine[: len(by_hand)] - by_hand).max() <= 1e-5 * np.abs(by_hand).max()


def test_a_wrong_damping_matrix_shows():
    solution = run(None)
    wrong = C.copy()
    wrong[2, 2] *= 1.001
    solution.system = spim.StructuralSystem(M, K, damping=wrong)
    assert np.abs(solution.balance_error).max() >= 1e-6 * solution.energy[0]


def test_undamped_and_free_is_zero_both():
    solution = run(None, damping=None)
    assert not solution.dissipated.any()
    assert not solution.work.any()


@pytest.mark.parametrize(
    "load",
    [
        loads.Sampled(RECORD, 0.03, start=0.11),
        loads.Sampled(RECORD, 0.013, hold="zero") + loads.Harmonic(np.ones(N), 5.0),
        loads.Sampled(RECORD[:20], times=np.sort(np.random.default_rng(1).uniform(1.0, 9.0, 20))),
        loads.Function(lambda t: np.cos(t) * np.arange(N), degree=4),
        loads.GroundMotion(loads.Function(np.sin, degree=2), np.ones(N)),
    ],
)
@pytest.mark.parametrize("span", [(0.0, 10.0), (10.0, 0.0), (7.0, 20.0)])
@pytest.mark.filterwarnings("ignore:the run")
def test_whatever_the_load_is_made_of(load, span):
    system = spim.StructuralSystem(M, K, damping=C, load=load)
    z0 = system.state(q=0.01 * np.arange(N), v=np.ones(N))
    solution = spim.integrate(system, z0, span, 0.05, correction="exact")
    size = solution.energy.max() + np.abs(solution.work).max() + np.abs(solution.dissipated[-1])
    assert np.abs(solution.balance_error).max() <= 1e-13 * size
    # Backward, damping makes motions grow beyond all loads.
    assert np.abs(solution.work).max() > (1e-3 if span[1] > 0.0 else 1e-6) * size


def test_wherever_states_are_stored():
    load = loads.Sampled(RECORD, 0.03) + loads.Polynomial([np.ones(N)])
    system = spim.StructuralSystem(M, K, damping=C, load=load)
    z0 = system.state(v=np.ones(N))

    def go(**options):
        return spim.integrate(system, z0, (0.0, 10.0), 0.05, correction="exact", **options)

    whole = go()
    for stored, rows in [
        (go(every=7), [*range(0, 200, 7), 200]),
        (go(t_eval=whole.t[[3, 90, 111]]), [3, 90, 111]),
    ]:
        for name in ("work", "dissipated"):
            wanted = getattr(whole, name)
            off = np.abs(getattr(stored, name) - wanted[rows]).max()
            assert off <= 1e-14 * np.abs(wanted).max(), name
    between = go(t_eval=[0.001, 1.23, 1.24, 9.999])
    size = whole.energy.max() + np.abs(whole.work).max()
    energy = between.energy - whole.energy[0] + between.dissipated - between.work
    assert np.abs(energy).max() <= 1e-13 * size


def test_what_it_cannot_do_it_says():
    system = spim.StructuralSystem(M, K, load=loads.Exponential(np.ones(N), 40.0))
    late = spim.integrate(system, system.state(), (-20.0, -15.0), 0.05)
    with pytest.raises(spim.UnsupportedError, match="start later"):
        _ = late.work
    free = spim.integrate(spim.LinearSystem(system.A), system.state(), (0.0, 1.0), 0.1)
    with pytest.raises(spim.UnsupportedError, match="structures have"):
        _ = free.dissipated


def test_balance_of_a_large_damped_and_loaded_chain():
    """240 degrees of freedom, 2000 steps."""
    n, step, steps = 240, 0.02, 2000
    M = np.diag(1.0 + 0.5 * np.arange(n) / n)
    K = 4e4 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    C = spim.damping.rayleigh(M, K, alpha=0.1, beta=1e-4)
    record = spim.loads.Sampled(np.random.default_rng(0).normal(size=steps + 1), step)
    load = spim.loads.GroundMotion(record, np.ones(n)) + spim.loads.Harmonic(np.ones(n), 3.0)
    chain = spim.StructuralSystem(M, K, damping=C, load=load)
    for correction, bound in [("none", 5e-12), ("exact", 2e-14)]:
        end = steps * step
        start = chain.state(v=np.ones(n))
        run = spim.integrate(chain, start, (0.0, end), step, correction=correction)
        size = max(run.energy.max(), np.abs(run.work).max(), run.dissipated[-1])
        assert np.abs(run.balance_error).max() <= bound * size
