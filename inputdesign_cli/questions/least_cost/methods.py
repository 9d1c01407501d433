"""Other ways to design than the exchange: the program of the papers, and a factor of few columns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import Criterion, ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.hillclimb import QuadraticDesign, hill_climb
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.outcome import Solver
from inputdesign_cli.questions.least_cost.outcome import Answer
from inputdesign_cli.spectrum import PolynomialBasis, flat_basis, hvec, svec

# The second frequency of a grid that begins at zero, as a share of the last.
_ABOVE_ZERO = 1e-3
_STARTS = 3


@dataclass(frozen=True)
class GridMethod:
    """The papers' own program: the number of frequencies of its grid, and how positivity is written."""

    lines: int
    positivity: Literal["gram", "kyp"]

    def design(self, question: Question, *, tolerance: float, any_spectrum_tolerance: float | None) -> Answer:
        """Return the design. The baseline and the bound over every spectrum are exact.

        Raises:
            UnreachableError, OutOfTimeError: see `solve_design`.
        """
        white = replace(question, basis=flat_basis(question.experiment))
        baseline = solve_design(white, tolerance=tolerance, any_spectrum_tolerance=any_spectrum_tolerance)
        basis = question.basis
        problem = replace(baseline.problem, basis=basis)
        stated = [r for r in problem.requirements if isinstance(r, ModelError)]
        frequencies = self.frequencies(*stated[0].band)
        start = baseline.white_power * basis.even
        answer = solve_on_grid(problem, stated, frequencies, start, positivity=self.positivity)
        on_grid = replace(
            baseline.result,
            basis=basis,
            x=answer.x,
            objective=answer.cost,
            informations=problem.informations(answer.x),
            certificate=answer.certificate,
            active=(),
        )
        solver = Solver("lmi", tolerance, details={"grid": self.lines})
        return Answer(replace(baseline, problem=problem, result=on_grid), "optimal_on_grid", solver)

    def frequencies(self, lo: float, hi: float) -> Array:
        """Return (lines,): the ends of the band, and frequencies evenly spread in log w between them."""
        if lo > 0.0:
            return np.geomspace(lo, hi, self.lines)
        return np.append(0.0, hi * np.geomspace(1.0, _ABOVE_ZERO, self.lines - 1)[::-1])


@dataclass(frozen=True)
class FewColumns:
    """`spectrum.factor_columns`, as in [mohan-spectral]: a number, and the seed of the random starts."""

    columns: int
    seed: int

    def climbed(self, answer: Answer) -> Answer:
        """Return the best of climbs from the optimum cut to few columns, and from random factors.

        The bound of the design over all factors stays: it is the upper bound of [mohan-spectral].
        """
        design = answer.design
        problem, x = design.problem, design.result.x
        basis, criterion = problem.basis, problem.demands.criterion
        if not isinstance(basis, PolynomialBasis) or criterion is None:
            raise ValueError("a factor of few columns is for a criterion and a polynomial spectrum")
        columns = min(self.columns, basis.gram_order)
        values, vectors = np.linalg.eigh(basis.matrix(x))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        quadratic, rng = _quadratic(problem, basis, criterion), np.random.default_rng(self.seed)
        found = hill_climb(quadratic, columns, starts=_STARTS, rng=rng, guesses=[root])
        S = found.factor @ found.factor.conj().T
        climbed = hvec(S) if basis.hermitian else svec(S.real)
        informations = problem.informations(climbed)
        objective = 1.0 / criterion.level(informations[0])
        result = replace(
            design.result, x=climbed, informations=informations, objective=objective, s=objective
        )
        reached = [history[-1] for history in found.histories]
        solver = replace(answer.solver, method="hill_climb", details={"starts": reached})
        return Answer(replace(design, result=result), "lower_bound", solver)


def _quadratic(problem: Problem, basis: PolynomialBasis, criterion: Criterion) -> QuadraticDesign:
    """Return the design as a problem that is quadratic in the factor."""
    k = problem.experiment.size
    maps = np.array([[basis.gram(problem.information_map[:, i, j]) for j in range(k)] for i in range(k)])
    limits = tuple(
        (basis.gram(functional.vector), limit.bound)
        for limit, functional in zip(problem.limits, problem.limit_functionals, strict=True)
    )
    baseline: Array = problem.baseline_information
    return QuadraticDesign(maps, baseline, limits, criterion.letter, criterion.scaling)
