"""Any band, order and criterion: the bound closes, or the design says that it did not."""

import numpy as np
import pytest

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel
from inputdesign_cli.spectrum import PolynomialBasis
from tests.support.plants import arrays, two_by_two


def random_plant(rng):
    """2 x 2, entries of second order, poles within a decade of 1 rad/s."""
    size = (2, 2)
    numerator = [[[rng.uniform(0.5, 5.0)] for _ in range(2)] for _ in range(2)]
    denominator = np.empty((*size, 3))
    for index in np.ndindex(*size):
        frequency, damping = 10 ** rng.uniform(-0.5, 0.5), rng.uniform(0.1, 1.0)
        denominator[index] = [frequency**2, 2 * damping * frequency, 1.0]
    return ContinuousModel.monic(arrays(numerator), arrays(denominator.tolist()), np.eye(2))


def solved(model, band, order, criterion, *, hermitian=False):
    question = Question(
        Experiment(model, 1, band),
        PolynomialBasis(2, order, band, hermitian),
        "factor",
        [lambda experiment: Criterion(criterion, experiment.factor)],
        limits=[PowerLimit("input", 1000.0), PowerLimit("output", 1000.0)],
    )
    power = white_power(question)
    problem = whitened_problem(question, np.full(2, power / 2))
    return problem, exchange(problem, power * problem.basis.even, tolerance=1e-7)


@pytest.mark.slow
def test_order_40_is_proved_and_no_worse_than_order_13():
    _, low = solved(two_by_two(), (0.0, 2.0), 13, "E")
    problem, high = solved(two_by_two(), (0.0, 2.0), 40, "E")
    assert high.gap <= 1e-6
    assert high.objective <= low.objective * (1 + 1e-6)
    w = np.linspace(0.0, 2.0, 400)
    eigenvalues = np.linalg.eigvalsh(problem.basis.density(high.x, w))
    assert eigenvalues.min() >= -1e-9 * eigenvalues.max()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_random_plants_bands_orders_and_criteria(seed):
    rng = np.random.default_rng(seed)
    lo = float(rng.choice([0.0, 0.1, 0.5]))
    band = (lo, lo + float(rng.choice([0.5, 2.0, 6.0])))
    order = int(rng.integers(4, 31))
    criterion = "DAET"[seed % 4]
    _, found = solved(random_plant(rng), band, order, criterion, hermitian=seed % 3 == 0)
    assert found.gap <= 1e-5
