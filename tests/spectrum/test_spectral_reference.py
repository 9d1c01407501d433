"""The design paper's example: reference optima by plain programs, and a hill-climb that stays below."""

from functools import cache

import numpy as np
import pytest

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.hillclimb import QuadraticDesign, hill_climb
from inputdesign_cli.spectrum import PolynomialBasis
from tests.support.plants import paper_experiment
from tests.support.spectral_oracle import Spectral, textbook_value


@cache
def problem(hermitian):
    return Spectral(paper_experiment(), PolynomialBasis(2, 13, (0.0, 2.0), hermitian))


@pytest.mark.first(4)
@pytest.mark.parametrize(
    ("hermitian", "criterion", "expected", "close"),
    [
        *((False, "D", 59.2036, 2e-6), (False, "A", -0.510071, 1e-4)),
        *((False, "E", 5.03225, 1e-4), (False, "T", 164322.7, 1e-5)),
        *((True, "D", 60.990, 5e-5), (True, "A", -0.4944, 1e-3)),
        *((True, "E", 5.116, 1e-3), (True, "T", 164998, 1e-4)),
    ],
)
def test_coefficients_reach_the_reference(hermitian, criterion, expected, close):
    asked = problem(hermitian)
    x, weight = asked.solve(criterion)
    value, bound = asked.value(x, criterion), asked.bound(x, criterion, weight)
    assert value == pytest.approx(expected, rel=close)
    assert hermitian or value <= bound * (1 + 1e-12) + 1e-12
    assert bound - value <= (1e-4 if hermitian else 1e-5) * abs(value)


def design(problem, criterion):
    basis, k = problem.basis, problem.experiment.size
    maps = np.array([[basis.gram(problem.maps[:, i, j]) for j in range(k)] for i in range(k)])
    limits = tuple((basis.gram(limit), 1.0) for limit in problem.limits)
    return QuadraticDesign(maps, np.zeros((k, k)), limits, Criterion(criterion, problem.experiment.factor))


@pytest.fixture(scope="module")
def real():
    return Spectral(paper_experiment(), PolynomialBasis(2, 3, (0.0, 2.0)))


@pytest.mark.first(2)
@pytest.mark.parametrize("criterion", ["E", "T", "A", "D"])
def test_the_hill_climb_ascends_and_stays_below_the_optimum(real, criterion):
    problem = design(real, criterion)
    found = hill_climb(problem, 2, starts=1, rng=np.random.default_rng(0))
    history = np.array(found.histories[0])
    assert np.all(np.diff(history) >= 0)
    x, weight = real.solve(criterion)
    bound = real.bound(x, criterion, weight)
    assert found.value <= bound + 1e-9 * abs(bound)
    assert abs(bound - found.value) <= 5e-3 * abs(bound)
    # The reported value is attained by the factor.
    S = found.factor @ found.factor.T
    M = np.array([[np.sum(A * S) for A in row] for row in problem.maps])
    assert textbook_value(real.experiment.to_raw(M), criterion) == pytest.approx(found.value, rel=1e-9)
    assert max(np.sum(P * S) for P, _ in problem.limits) == pytest.approx(1.0)


def test_a_factor_of_the_optimum_as_a_guess_loses_little_with_twice_the_columns(real):
    """2 r real columns hold any spectrum: from the root of the optimal S, cut to them, nothing is missing."""
    x, _ = real.solve("D")
    values, vectors = np.linalg.eigh(real.basis.matrix(x))
    root = vectors * np.sqrt(np.maximum(values, 0))
    found = hill_climb(design(real, "D"), 4, starts=0, rng=np.random.default_rng(2), guesses=[root])
    assert found.value == pytest.approx(real.value(x, "D"), abs=2e-2)


def test_complex_factors_reach_the_optimum_over_complex_spectra():
    complex_ = Spectral(paper_experiment(), PolynomialBasis(2, 3, (0.0, 2.0), True))
    found = hill_climb(design(complex_, "T"), 2, starts=1, rng=np.random.default_rng(3))
    x, _ = complex_.solve("T")
    assert np.iscomplexobj(found.factor)
    assert found.value == pytest.approx(complex_.value(x, "T"), rel=1e-3)
    S = found.factor @ found.factor.conj().T
    assert complex_.basis.gram(complex_.limits[0]).shape == S.shape
