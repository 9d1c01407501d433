"""The linear conditions of the finite program: power limits, and density limits at single frequencies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.design.convex.limits import DensityPlace
from inputdesign_cli.design.convex.master import Row
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.spectrum import first_directions

# Rows that nearly coincide, in frequency (of the band) and direction, spoil the solver's linear algebra.
_SAME_ROW = 3e-6
_SAME_DIRECTION = 1e-8
_MORE = 6


def power_rows(problem: Problem) -> list[Row]:
    """One row for each power limit."""
    pairs = zip(problem.limits, problem.limit_functionals, strict=True)
    return [
        Row(functional, limit.bound, limit.upper, limit=index)
        for index, (limit, functional) in enumerate(pairs)
    ]


def density_row(problem: Problem, place: DensityPlace) -> Row:
    """A density limit at one frequency in one direction."""
    limit = problem.densities[place.limit]
    level = float(limit.level(np.array([place.frequency]))[0])
    return Row(problem.density_at(place), level, limit.upper, density=place)


def first_density_rows(problem: Problem) -> list[Row]:
    """Rows to begin with: spread over the band, along each channel and pair of channels."""
    w = np.linspace(*problem.experiment.band, 2 * (problem.basis.degree + 1) + _MORE)
    directions = first_directions(np.ones(problem.experiment.inputs))
    return [
        density_row(problem, DensityPlace(index, float(frequency), v))
        for index in range(len(problem.densities))
        for frequency in w
        for v in directions
    ]


def on_basis(problem: Problem, row: Row) -> Row:
    """Return the row for the basis of `problem`."""
    if row.limit is not None:
        return replace(row, functional=problem.limit_functionals[row.limit])
    assert row.density is not None
    return density_row(problem, row.density)


def alike(problem: Problem, row: Row, place: DensityPlace) -> bool:
    """Whether the row stands for the same limit at nearly the same place."""
    if row.density is None or row.density.limit != place.limit:
        return False
    lo, hi = problem.experiment.band
    if abs(row.density.frequency - place.frequency) >= _SAME_ROW * (hi - lo):
        return False
    along = float(np.abs(np.vdot(row.density.direction, place.direction)))
    return along**2 > 1.0 - _SAME_DIRECTION
