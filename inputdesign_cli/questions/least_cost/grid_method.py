"""The papers' own program: a requirement on a grid of frequencies, and a spectrum positive by a matrix."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.spectrum import flat_basis

# The second frequency of a grid that begins at zero, as a share of the last.
_ABOVE_ZERO = 1e-3


@dataclass(frozen=True)
class GridMethod:
    """On how many frequencies, and how positivity is written."""

    lines: int
    positivity: Literal["gram", "kyp"]

    def design(
        self, question: Question, *, tolerance: float, any_spectrum_tolerance: float | None
    ) -> tuple[Design, dict[str, Json]]:
        """The design, and what the solver did. The baseline and the bound over every spectrum are exact.

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
        how = {"method": "lmi", "status": "optimal_on_grid", "grid": self.lines}
        return replace(baseline, problem=problem, result=on_grid), how

    def frequencies(self, lo: float, hi: float) -> Array:
        """(lines,): the ends of the band, and evenly spread on a logarithmic axis between them."""
        if lo > 0.0:
            return np.geomspace(lo, hi, self.lines)
        return np.append(0.0, hi * np.geomspace(1.0, _ABOVE_ZERO, self.lines - 1)[::-1])

    def note(self, result: Mapping[str, Json]) -> str:
        """Say where the accuracy holds, and what is missed between."""
        most = result["model_error"]["worst_ratio"]
        return (
            f"the accuracy holds on the grid of {self.lines} frequencies; over the whole band r_u / r_adm is "
            f"at most {most:.6g} (solver.method: exchange keeps it at every frequency)"
        )
