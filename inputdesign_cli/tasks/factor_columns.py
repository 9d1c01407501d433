"""`spectrum.factor_columns`: the design held to a factor of few columns, as in the spectral design paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.hillclimb import QuadraticDesign, hill_climb
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import PolynomialBasis, hvec, svec

_STARTS = 3


@dataclass(frozen=True)
class Climbed:
    """The design of few columns, with what the result says of the climb."""

    design: Design
    how: dict[str, Any]
    entry: dict[str, Any]


def restrict_columns(spec: Spec, design: Design) -> Climbed | None:
    """Climb from the optimum cut to `factor_columns` and from random factors; None when not asked for.

    The bound of the design over all factors stays: it is the paper's upper bound.
    """
    columns = getattr(spec.spectrum, "factor_columns", None)
    if columns is None:
        return None
    problem, x = design.problem, design.result.x
    basis, criterion = problem.basis, problem.requirements[0]
    assert isinstance(basis, PolynomialBasis)
    assert isinstance(criterion, Criterion)
    columns = min(columns, basis.gram_order)
    quadratic = _quadratic(problem, basis, criterion)
    values, vectors = np.linalg.eigh(basis.matrix(x))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng = np.random.default_rng(spec.signal.seed or 0)
    found = hill_climb(quadratic, columns, starts=_STARTS, rng=rng, guesses=[root])
    S = found.factor @ found.factor.conj().T
    climbed = hvec(S) if basis.hermitian else svec(S.real)
    information = problem.information(climbed)
    objective = 1.0 / criterion.level(information)
    result = replace(design.result, x=climbed, information=information, objective=objective, s=objective)
    reached = [history[-1] for history in found.histories]
    return Climbed(
        replace(design, result=result),
        {"method": "hill_climb", "status": "lower_bound", "starts": reached},
        {"factor_columns": columns},
    )


def _quadratic(problem: Problem, basis: PolynomialBasis, criterion: Criterion) -> QuadraticDesign:
    k = problem.experiment.size
    maps = np.array([[basis.gram(problem.information_map[:, i, j]) for j in range(k)] for i in range(k)])
    limits = tuple(
        (basis.gram(functional.vector), limit.bound)
        for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True)
    )
    baseline: Array = problem.baseline_information
    return QuadraticDesign(maps, baseline, limits, criterion.letter, criterion.scaling)
