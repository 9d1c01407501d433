"""A requirement that the package does not know: one class, and designs meet it with a proof."""

from dataclasses import dataclass

import numpy as np
import pytest

from inputdesign_cli.accuracy import MatrixCut
from inputdesign_cli.accuracy.requirement import OneCondition, inverse_factor
from inputdesign_cli.design.convex.designs import Question, solve_design
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import FirBasis

VARIANCE, SAMPLES, LIMIT = 0.5, 200, 0.01


@dataclass(frozen=True)
class StaticGain(OneCondition):
    """The standard deviation of G(1) is at most `limit`: M >= g g^T / limit^2, g the gradient of G(1)."""

    experiment: Experiment
    limit: float

    @property
    def name(self) -> str:
        return "static_gain"

    @property
    def gradient(self) -> Array:
        return self.experiment.plant_gradient(np.zeros(1))[0, :, 0, 0].real / self.limit

    def ratio(self, information: Array) -> float:
        return float(np.linalg.norm(inverse_factor(information) @ self.gradient))

    def cut(self, frequency: float | None) -> MatrixCut:
        return MatrixCut(np.outer(self.gradient, self.gradient))


def solved(goal, **more):
    """y = b1 u(t - 1) + b2 u(t - 2) + e, and spectra c_0 + 2 c_1 cos(w)."""
    model = PolynomialModel.single([0.0, 1.0, 0.5], variance=VARIANCE)
    samples = 1 if goal == "samples" else SAMPLES
    question = Question(
        Experiment(model, samples), FirBasis(1), goal, [lambda e: StaticGain(e, LIMIT)], **more
    )
    return solve_design(question, tolerance=1e-8)


# var (b1 + b2) = 2 variance / (N (c_0 + c_1)), and c_1 <= c_0 / 2 for a spectrum of this order.
LEAST = 4.0 / 3.0 * VARIANCE / (SAMPLES * LIMIT**2)


def test_the_cheapest_experiment_is_that_of_the_formula():
    design = solved("cost", cost={"input": 1.0})
    assert design.result.objective == pytest.approx(LEAST, rel=1e-6)
    assert design.result.x == pytest.approx([LEAST, LEAST / 2], rel=1e-3)
    assert design.result.gap <= 1e-6
    assert design.problem.worst_ratio(design.result.information).ratio <= 1 + 1e-9


def test_any_spectrum_does_best_with_a_constant():
    """All power at frequency zero has c_1 = c_0."""
    design = solved("cost", cost={"input": 1.0})
    assert design.any_spectrum.certificate.bound == pytest.approx(0.75 * LEAST, rel=1e-3)


def test_the_other_goals_know_it_too():
    limits = [PowerLimit("input", LEAST)]
    assert solved("factor", limits=limits).result.objective == pytest.approx(1.0, rel=1e-6)
    assert solved("samples", limits=limits).result.objective == pytest.approx(SAMPLES, rel=1e-6)
