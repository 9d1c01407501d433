"""The linear conditions of the finite program: power limits, and density limits at single frequencies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.design.limits import DensityBreach
from inputdesign_cli.design.master import Row
from inputdesign_cli.design.problem import Problem

# Rows that nearly coincide (rad/sample) spoil the solver's linear algebra.
_SAME_ROW = 1e-5


def power_rows(problem: Problem) -> list[Row]:
    """One row for each power limit."""
    pairs = zip(problem.limits, problem.limit_functionals, strict=True)
    return [
        Row(functional, limit.bound, limit.upper, limit=index)
        for index, (limit, functional) in enumerate(pairs)
    ]


def density_row(problem: Problem, index: int, frequency: float) -> Row:
    """The density limit of this index at one frequency (rad/sample)."""
    limit = problem.densities[index]
    level = float(limit.level(np.array([frequency]))[0])
    return Row(problem.density_at(frequency), level, limit.upper, density=(index, frequency))


def on_basis(problem: Problem, row: Row) -> Row:
    """The same row for the basis of `problem`."""
    if row.limit is not None:
        return replace(row, functional=problem.limit_functionals[row.limit])
    assert row.density is not None
    return density_row(problem, *row.density)


def alike(row: Row, breach: DensityBreach) -> bool:
    """Whether the row stands for the same limit at nearly the same frequency."""
    if row.density is None or row.density[0] != breach.limit:
        return False
    return abs(row.density[1] - breach.frequency) < _SAME_ROW
