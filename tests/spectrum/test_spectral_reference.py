"""The maps of the spectral design paper's example: a plain program on them has the reference optima."""

import numpy as np
import pytest

from inputdesign_cli.spectrum import PolynomialBasis
from tests.support.plants import paper_experiment
from tests.support.spectral_oracle import Spectral

REAL = {"D": (59.2036, 1e-4, 0), "A": (-0.510071, 0, 1e-4), "E": (5.03225, 0, 1e-4), "T": (164322.7, 0, 1e-5)}
COMPLEX = {"D": (60.990, 3e-3, 0), "A": (-0.4944, 0, 1e-3), "E": (5.116, 0, 1e-3), "T": (164998, 0, 1e-4)}


@pytest.fixture(scope="module")
def real():
    return Spectral(paper_experiment(), PolynomialBasis(2, 13, (0.0, 2.0)))


@pytest.mark.parametrize("criterion", "DAET")
def test_real_coefficients_reach_the_reference(real, criterion):
    x, weight = real.solve(criterion)
    expected, absolute, relative = REAL[criterion]
    value = real.value(x, criterion)
    assert value == pytest.approx(expected, abs=absolute or None, rel=relative or None)
    bound = real.bound(x, criterion, weight)
    assert value <= bound * (1 + 1e-12) + 1e-12
    assert bound - value <= 1e-5 * abs(value)


@pytest.mark.slow
@pytest.mark.parametrize("criterion", "DAET")
def test_complex_coefficients_reach_the_reference(criterion):
    problem = Spectral(paper_experiment(), PolynomialBasis(2, 13, (0.0, 2.0), True))
    x, weight = problem.solve(criterion)
    expected, absolute, relative = COMPLEX[criterion]
    value = problem.value(x, criterion)
    assert value == pytest.approx(expected, abs=absolute or None, rel=relative or None)
    assert problem.bound(x, criterion, weight) - value <= 1e-4 * abs(value)


def test_coordinates_do_not_matter(real):
    """Whitened for another power: the information in raw parameters is the same."""
    other = Spectral(paper_experiment(power=3.0), PolynomialBasis(2, 13, (0.0, 2.0)))
    x = real.basis.even * 500
    np.testing.assert_allclose(other.information(x), real.information(x), rtol=1e-8, atol=1e-6)
