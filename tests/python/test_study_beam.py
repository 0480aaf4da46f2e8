"""Claims of study 6.1: the cantilever on a rotating base."""

import re

import numpy as np
import pytest

from spim import studies
from spim.studies import beam as study


@pytest.fixture(scope="module")
def runs():
    return study.study()


def test_srk2_stays_in_a_band_that_shrinks_with_the_square_of_the_step(runs):
    fine, coarse = (
        np.abs(runs.energy_error("srk2", step)).max() for step in (study.FINE, study.COARSE)
    )
    assert abs(fine / 2.104e-5 - 1.0) <= 1e-3
    assert abs(coarse / 5.16e-4 - 1.0) <= 2e-3
    assert abs(coarse / fine / 25.0 - 1.0) <= 0.03


def test_rk4_loses_the_energy_it_was_found_to_lose(runs):
    solution = runs.solutions["rk4", study.FINE]
    for t, wanted in study.RK4_ENERGIES.items():
        row = int(np.searchsorted(solution.t, t - 1e-9))
        assert abs(solution.energy[row] - wanted) <= 6e-4, t
    coarse = runs.solutions["rk4", study.COARSE]
    ten = int(np.searchsorted(coarse.t, 10.0 - 1e-9))
    assert abs(1.0 - coarse.energy[ten] / coarse.energy[0] - 0.977) <= 1e-3


def test_the_momentum_of_the_hub_is_conserved_to_the_last_bit(runs):
    for solution in runs.solutions.values():
        assert not solution.p_phi.any()


def test_the_state_at_a_hundredth_of_a_second():
    found = study.reference_state()
    assert np.abs(found - study.REFERENCE).max() <= 1e-9
    found = study.reference_state("rk4", 1e-5, 4)
    assert np.abs(found - study.REFERENCE).max() <= 1e-9


@pytest.mark.parametrize(("method", "order"), [("srk2", 2), ("rk4", 4), ("midpoint", 2)])
def test_orders_are_the_stated_ones(method, order):
    slopes = study.orders(method, (5e-5, 2.5e-5, 1.25e-5))
    assert np.abs(slopes - order).max() <= 0.1


def test_means_over_long_windows_stay():
    """A tenth of the thousand seconds, windows a hundredth as long as its."""
    _, _, means, slope, momentum = study.drift(100.0)
    assert np.ptp(means) <= 1e-6
    assert abs(slope) <= 1e-8
    assert momentum == 0.0


def test_the_report_has_its_figures_and_numbers(tmp_path):
    files, summary = studies.reproduce("beam", tmp_path, quick=True)
    names = {file.name for file in files}
    assert {"report.md", "fig1-3.svg", *(f"fig{k}.svg" for k in range(4, 10))} <= names
    report = (tmp_path / "beam" / "report.md").read_text(encoding="utf-8")
    assert "$" not in re.sub(r"\$[^$\n]*\$", "", report)
    assert "12169.894 | 12169.894" in report
    for name in re.findall(r"\]\((\w[\w.-]*)\)", report):
        assert name in names
    assert "2.104e-5" in summary


def test_exponential_methods_beat_srk2_at_its_own_step():
    found = study.semilinear_runs()
    at = study.SEMILINEAR_STEPS.index(1e-4)
    errors = {method: errors[at] for method, (errors, _) in found.items()}
    for method in ("spim_explicit", "spim_pc", "spim_implicit", "lawson_gauss2"):
        assert errors[method] <= 0.1 * errors["srk2"], method
    for method, limit in {
        "lawson_gauss4": 1e-6,
        "lawson_gauss6": 1e-9,
        "lawson_gauss8": 1e-12,
    }.items():
        assert errors[method] <= limit, method
    for method, order in {"spim_pc": 2, "spim_implicit": 2, "lawson_gauss4": 4}.items():
        coarse, fine = found[method][0][1:3]
        assert abs(np.log2(coarse / fine) - order) <= 0.15, method
