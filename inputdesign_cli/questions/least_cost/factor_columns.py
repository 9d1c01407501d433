"""`spectrum.factor_columns`: the design held to a factor of few columns, as in [mohan-spectral]."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.hillclimb import QuadraticDesign, hill_climb
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.spectrum import PolynomialBasis, hvec, svec

_STARTS = 3


@dataclass(frozen=True)
class FewColumns:
    """How many columns a factor may have, and the seed of the random starts."""

    columns: int
    seed: int


def restrict_columns(asked: FewColumns, design: Design) -> tuple[Design, dict[str, Json]]:
    """Climb from the optimum cut to so few columns and from random factors; what the result says of it.

    The bound of the design over all factors stays: it is the upper bound of [mohan-spectral].
    """
    problem, x = design.problem, design.result.x
    basis, criterion = problem.basis, problem.demands.criterion
    if not isinstance(basis, PolynomialBasis) or criterion is None:
        raise ValueError("a factor of few columns is for a criterion and a polynomial spectrum")
    columns = min(asked.columns, basis.gram_order)
    quadratic = _quadratic(problem, basis, criterion)
    values, vectors = np.linalg.eigh(basis.matrix(x))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng = np.random.default_rng(asked.seed)
    found = hill_climb(quadratic, columns, starts=_STARTS, rng=rng, guesses=[root])
    S = found.factor @ found.factor.conj().T
    climbed = hvec(S) if basis.hermitian else svec(S.real)
    informations = problem.informations(climbed)
    objective = 1.0 / criterion.level(informations[0])
    result = replace(design.result, x=climbed, informations=informations, objective=objective, s=objective)
    reached = [history[-1] for history in found.histories]
    how: dict[str, Json] = {"method": "hill_climb", "status": "lower_bound", "starts": reached}
    return replace(design, result=result), how


def _quadratic(problem: Problem, basis: PolynomialBasis, criterion: Criterion) -> QuadraticDesign:
    k = problem.experiment.size
    maps = np.array([[basis.gram(problem.information_map[:, i, j]) for j in range(k)] for i in range(k)])
    limits = tuple(
        (basis.gram(functional.vector), limit.bound)
        for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True)
    )
    baseline: Array = problem.baseline_information
    return QuadraticDesign(maps, baseline, limits, criterion.letter, criterion.scaling)
