"""Convex designs for tests, and what holds of every one of them."""

import dataclasses

import numpy as np

from inputdesign_cli.accuracy import Criterion, ModelError, Relative
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.spectrum import FirBasis, LinesBasis

GRID = np.unique(np.concatenate([np.linspace(0.0, np.pi, 4001), np.geomspace(1e-4, np.pi, 4001)]))
ORDER = 8


def solve(experiment, goal="cost", requirements=(), order=ORDER, **more):
    basis = more.pop("basis", FirBasis(1, order))
    if goal == "cost":
        more.setdefault("cost", {"input": 1.0})
    question = Question(experiment, basis, goal, list(requirements), **more)
    return solve_design(question, tolerance=1e-7)


def model_error(experiment, fraction, alpha, kind=ModelError):
    """The error of G of one input and output, relative to |G|, at every frequency."""
    admissible = Relative(experiment.model, fraction, (0, 0))
    return kind(experiment=experiment, band=(0.0, np.pi), entry=(0, 0), admissible=admissible, alpha=alpha)


def relative(fraction=0.01, alpha=2.45):
    return [lambda e: model_error(e, fraction, alpha)]


def anywhere():
    return LinesBasis.anywhere(0.0, np.pi, 1)


def criterion(letter):
    return [lambda e: Criterion(letter, e.factor)]


def check(design, tolerance=1e-6):
    """Proof, limits and requirements of a design, recomputed on a dense grid."""
    result, problem = design.result, design.problem
    assert result.certificate.bound <= result.objective * (1 + 1e-9)
    assert result.gap <= tolerance
    assert design.any_spectrum.certificate.bound <= result.objective * (1 + 1e-9)
    basis, x = result.basis, result.x
    for limit in problem.limits:
        power = dataclasses.replace(problem, basis=basis, finer=None).power(limit.kind).at(x)
        assert power <= limit.bound * (1 + 1e-9) if limit.upper else power >= limit.bound * (1 - 1e-9)
    if isinstance(basis, FirBasis) and basis.inputs == 1:
        phi = basis.density(x, GRID)
        assert phi.min() >= -1e-9 * phi.max()
        for density in problem.densities:
            level = density.level(GRID)
            assert np.all(phi <= level * (1 + 1e-6)) if density.upper else np.all(phi >= level * (1 - 1e-6))


def resonant():
    """A lightly damped OE system, where cheap inputs and quiet outputs are different things."""
    model = PolynomialModel.single([0, 1.0, 0.3], F=[1, -1.4, 0.81], variance=0.2)
    return Experiment(model, 300)
