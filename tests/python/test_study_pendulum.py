"""Claims of study 6.3: the compound pendulum."""

import pickle
import re

import numpy as np
import pytest

import spim
from spim import studies
from spim.studies import pendulum as study


def test_errors_at_two_seconds_are_those_expected():
    errors = study.errors()
    for method, wanted in study.EXPECTED.items():
        assert abs(errors[method] / wanted - 1.0) <= 0.1, method
    assert errors["lawson_gauss8"] <= 1e-12
    assert errors["gauss16"] <= 1e-12


def test_the_state_at_ten_seconds_is_the_reference_to_all_its_digits():
    end = study.run("gauss16", 2.5e-3, study.END).z[-1]
    assert np.abs(end - study.REFERENCE).max() <= 5e-9


@pytest.mark.parametrize(
    ("method", "order"),
    [("spim_explicit", 2), ("spim_pc", 2), ("spim_implicit", 2), ("lawson_gauss4", 4)],
)
def test_orders_are_the_stated_ones(method, order):
    assert abs(study.orders(method) - order) <= 0.15


def step_defect(method):
    """Largest entry of ``W^T J W - J`` of a step's derivative, by differences of order 4."""
    z, d = np.array(study.Z0) + 0.05, 1e-3
    columns = []
    for j in range(4):
        moved = [z + c * d * np.eye(4)[j] for c in (-2.0, -1.0, 1.0, 2.0)]
        ends = [
            spim.integrate(study.pendulum(), x, (0.0, 0.01), 0.01, method=method).z[-1]
            for x in moved
        ]
        columns.append((ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * d))
    W = np.array(columns).T
    J = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(2))
    return np.abs(W.T @ J @ W - J).max()


@pytest.mark.parametrize("method", ["lawson_gauss2", "lawson_gauss4", "lawson_gauss8", "gauss4"])
def test_steps_of_symplectic_methods_are_symplectic(method):
    # Differences leave 1e-15 / d.
    assert step_defect(method) <= 1e-11


@pytest.mark.parametrize("method", ["spim_explicit", "spim_pc", "spim_implicit", "rk4"])
def test_steps_of_the_papers_schemes_are_not(method):
    assert step_defect(method) >= 1e-9


def test_the_symmetric_form_does_not_drift_and_eq_47_does():
    drift = {}
    for method in ("spim_pc", "spim_implicit", "lawson_gauss4"):
        solution = study.run(method, 0.01, 200.0, every=10)
        error = solution.energy / solution.energy[0] - 1.0
        halves = np.array_split(error, 2)
        drift[method] = abs(halves[1].mean() - halves[0].mean())
    assert drift["spim_pc"] > 20.0 * drift["spim_implicit"]
    assert drift["lawson_gauss4"] <= 1e-9


def test_the_default_method_says_why():
    solution = spim.integrate(study.pendulum(), study.Z0, (0.0, 1.0), 0.05)
    assert solution.method.startswith("lawson_gauss16 (auto: ")
    assert np.abs(solution(0.5) - study.reference(0.5)).max() <= 1e-12


def test_rates_are_those_of_the_energy():
    pendulum, z, d = study.pendulum(), np.array([0.1, 0.5, -0.1, 0.3]), 1e-5
    slope = [
        (pendulum.energy(z + d * e) - pendulum.energy(z - d * e)) / (2.0 * d) for e in np.eye(4)
    ]
    rates = pendulum.rate(z)
    assert np.abs(rates - [slope[2], slope[3], -slope[0], -slope[1]]).max() <= 1e-8


def test_bad_pendulums_are_refused_and_good_ones_can_be_pickled():
    with pytest.raises(ValueError, match="stiffness"):
        spim.models.CompoundPendulum(stiffness=-1.0)
    with pytest.raises(ValueError, match="z: must have shape"):
        study.pendulum().energy([1.0, 2.0])
    with pytest.raises(spim.UnsupportedError, match="linear"):
        spim.integrate(study.pendulum(), study.Z0, (0.0, 1.0), 0.1, method="spim")
    again = pickle.loads(pickle.dumps(spim.models.CompoundPendulum(gravity=1.6)))
    assert again.energy(study.Z0) == spim.models.CompoundPendulum(gravity=1.6).energy(study.Z0)


def test_semilinear_methods_take_linear_systems_exactly():
    system = spim.StructuralSystem([[1.0]], [[100.0]])
    z0 = system.state(q=[1.0])
    wanted = spim.integrate(system, z0, (0.0, 2.0), 0.1).z[-1]
    for method in ("spim_explicit", "lawson_gauss4"):
        found = spim.integrate(system, z0, (0.0, 2.0), 0.1, method=method).z[-1]
        assert np.abs(found - wanted).max() <= 1e-13 * np.abs(wanted).max()


def test_the_report_has_its_figures_and_numbers(tmp_path):
    files, _ = studies.reproduce("pendulum", tmp_path, quick=True)
    names = {file.name for file in files}
    assert {"report.md", "fig17.svg", "fig18.svg", "energy.svg"} <= names
    report = (tmp_path / "pendulum" / "report.md").read_text(encoding="utf-8")
    assert "$" not in report
    for name in re.findall(r"\]\((\w[\w.-]*)\)", report):
        assert name in names


def test_fits_through_more_grid_points_are_more_exact():
    _, rows = study.approximation_table()
    found = {(row[0], row[1]): (float(row[3]), int(row[2]), float(row[4])) for row in rows}
    for method in ("spim_pc", "spim_implicit"):
        errors = [found[fit, method][0] for fit in ("linear", "quadratic", "cubic")]
        assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2], method
    for case, (_, order, slope) in found.items():
        assert abs(slope - order) <= 0.2, case
