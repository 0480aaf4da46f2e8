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
    chain = models.FermiPastaUlamTsingou(springs=1025)
    for method in ("lawson_gauss4", "eavf", "strang", "spim_explicit"):
        with pytest.raises(spim.UnsupportedError, match="none beyond 4096 components"):
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
