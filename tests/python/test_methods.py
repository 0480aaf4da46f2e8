"""The records of the methods and what was measured of them."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

import spim
from spim import models

PAGE = Path(__file__).parents[2] / "docs" / "methods.md"
METHODS = spim.methods()


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_the_measured_figures_bear_the_labels_out(method):
    if method.order is None:
        assert method.measured_order is None
    else:
        assert abs(method.measured_order - method.order) <= 0.15
    # What differences of order 8 leave; 10 u; u a step, all of one sign.
    assert (method.symplectic_defect < 3e-14) == method.symplectic
    assert (method.reversibility_defect < 1e-15) == method.symmetric
    if method.energy_preserving:
        assert method.energy_error < 1e-11
    assert method.evaluations + method.products > 0


def test_energies_of_symplectic_methods_do_not_drift():
    for method in METHODS:
        if method.symplectic:
            assert method.energy_drift <= max(2e-3 * method.energy_error, 1e-12), method.name


def test_the_cost_is_that_of_a_run():
    # The problem of the table; whole evaluations, the first step among them.
    for name in ("verlet", "mclachlan84", "rk4", "sofroniou_spaletta10"):
        record = next(method for method in METHODS if method.name == name)
        run = spim.integrate(
            models.HenonHeiles(), [0.1, 0.0, 0.2, 0.2], (0.0, 125.0), 0.125, method=name
        )
        assert math.isclose(run.stats["evaluations"] / 1000, record.evaluations, rel_tol=2e-3)


def test_the_energy_error_is_that_of_a_run():
    record = next(method for method in METHODS if method.name == "verlet")
    run = spim.integrate(
        models.HenonHeiles(), [0.1, 0.0, 0.2, 0.2], (0.0, 12_500.0), 0.125, method="verlet"
    )
    error = np.max(np.abs(run.energy / run.energy[0] - 1.0))
    assert f"{error:.1e}" == f"{record.energy_error:.1e}"


def test_both_tables_are_printed_and_all_options():
    *text, options = str(METHODS).split("\n\n")
    assert [len(table.splitlines()) for table in text] == [len(METHODS) + 1, len(METHODS) + 2]
    for method in METHODS:
        for name, doc in method.options.items():
            lines = options.split(f"\n{name}: of ")
            assert any(method.name in line and doc[:40] in line for line in lines), name
    line = next(line for line in text[1].splitlines() if line.startswith("gauss16 "))
    assert line.split()[1] == "16.00"
    assert line.split()[-1] == "0"


def test_a_method_without_figures_prints():
    record = next(method for method in METHODS if method.name == "rk4")
    bare = type(record)(**{k: getattr(record, k) for k in list(vars(record))[:11]})
    assert bare.energy_drift is None
    assert type(METHODS)([bare]).__str__().splitlines()[-1].split() == ["rk4", *"-------"]


def test_the_page_is_what_its_script_prints():
    made = runpy.run_path(str(PAGE.with_suffix(".py")))["page"]()
    assert PAGE.read_text(encoding="utf-8") == made, "run `make methods`"
