"""Many trajectories in one call."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from structures import chain

import spim


def structure(load=None):
    return spim.StructuralSystem(*chain(3), load=load)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize(
    "options", [{}, {"correction": "exact", "every": 5}, {"method": "newmark"}, {"every": 3}]
)
def test_every_case_is_the_run_it_would_be(threads, options):
    system = structure()
    states = np.random.default_rng(0).normal(size=(7, 6))
    found = spim.ensemble(system, states, (0.0, 10.0), 0.1, threads=threads, **options)
    for start, case in zip(states, found, strict=True):
        alone = spim.integrate(system, start, (0.0, 10.0), 0.1, **options)
        assert (case.t == alone.t).all()
        assert np.abs(case.z - alone.z).max() <= 1e-14
        assert (case.last == case.z[-1]).all()
        assert case.error is None
        assert np.abs(case(3.21) - alone(3.21)).max() <= 1e-14


def test_load_cases():
    loads = [spim.loads.Harmonic(np.ones(3), w) for w in (0.5, 1.0, 2.0)] + [None]
    found = spim.ensemble(structure(), np.zeros(6), (0.0, 10.0), 0.1, loads=loads, threads=2)
    for load, case in zip(loads, found, strict=True):
        alone = spim.integrate(structure(load), np.zeros(6), (0.0, 10.0), 0.1)
        assert (case.z == alone.z).all()


def test_one_case_that_fails_leaves_the_others():
    system = spim.LinearSystem([[5.0]])
    fine, bad = spim.ensemble(system, [[0.0], [1e200]], (0.0, 100.0), 1.0)
    assert fine.error is None
    assert isinstance(bad.error, spim.ModelError)
    assert 0 < len(bad.z) < 101


def test_bad_input():
    system = structure()
    with pytest.raises(ValueError, match=r"z0: must have shape \(b, 6\)"):
        spim.ensemble(system, np.zeros((2, 5)), (0.0, 1.0), 0.1)
    with pytest.raises(ValueError, match="loads: 1 for 2 states"):
        spim.ensemble(system, np.zeros((2, 6)), (0.0, 1.0), 0.1, loads=[None])
    with pytest.raises(ValueError, match="threads"):
        spim.ensemble(system, np.zeros((2, 6)), (0.0, 1.0), 0.1, threads=0)
    with pytest.raises(TypeError, match="corection"):
        spim.ensemble(system, np.zeros((2, 6)), (0.0, 1.0), 0.1, corection="exact")
    assert spim.ensemble(system, np.zeros((0, 6)), (0.0, 1.0), 0.1) == []


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("load", [None, spim.loads.Harmonic(np.ones(3), 2.0)])
def test_ctrl_c_ends_an_ensemble(threads, load):
    system = structure(load)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    start = time.perf_counter()
    timer.start()
    states = np.ones((64, 6))
    with pytest.raises(KeyboardInterrupt):
        spim.ensemble(system, states, (0.0, 1e7), 0.01, every=10**6, threads=threads)
    assert time.perf_counter() - start < 5.0
