"""Claims about sweeps: order, failures, executors."""

import signal
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import spim

STIFFNESSES = [1.0, 4.0, -1e6, 9.0, 0.0, 16.0, "soft"]


def build(stiffness):
    """An oscillator; unstable for a negative stiffness, none at all for text."""
    system = spim.StructuralSystem([[1.0]], [[stiffness]])
    return system, system.state(q=[1.0]), (0.0, 2.0), 0.01, {"every": 10}


def check(results):
    assert len(results) == len(STIFFNESSES)
    for stiffness, result in zip(STIFFNESSES, results, strict=True):
        if stiffness == "soft":
            assert isinstance(result, spim.FailedCase)
            assert isinstance(result.error, TypeError)
            assert result.parameter == "soft"
            assert "stiffness: needs real numbers" in result.message
        elif stiffness < 0.0:
            assert isinstance(result.error, spim.ModelError)
            assert not result.success
            assert 0.0 < result.t[-1] < 2.0
        else:
            assert result.error is None
            assert np.allclose(result.q[:, 0], np.cos(np.sqrt(stiffness) * result.t), atol=1e-12)


def test_cases_come_back_in_order_and_failures_are_not_lost():
    seen = []
    check(spim.sweep(build, STIFFNESSES, progress=lambda *x: seen.append(x)))
    assert seen[-1] == (1.0, len(STIFFNESSES))
    assert spim.sweep(build, []) == []


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_any_executor_of_the_standard_library(kind):
    with kind(max_workers=2) as executor:
        check(spim.sweep(build, STIFFNESSES, executor=executor))


def test_a_dask_cluster():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        check(spim.sweep(build, STIFFNESSES, executor=client.get_executor()))


def die(_):
    """Takes its process down."""
    import os

    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(sys.platform == "win32", reason="kills a process by a signal")
def test_a_killed_worker_is_an_error_of_its_case():
    with ProcessPoolExecutor(max_workers=1) as executor:
        (result,) = spim.sweep(die, [1], executor=executor)
    assert isinstance(result, spim.FailedCase)
    assert "terminated" in result.message


def test_build_must_be_callable():
    with pytest.raises(TypeError, match="build: must be callable"):
        spim.sweep(3, [1])
