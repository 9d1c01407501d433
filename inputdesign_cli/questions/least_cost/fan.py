"""fan.png and fan.csv: r_u / r_adm over frequency at every plant that the design is for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.accuracy import OnModelError, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.curves import FanCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.questions.common.robust import delivered
from inputdesign_cli.questions.common.spectrum import axis
from inputdesign_cli.questions.least_cost.outcome import Designed

_GRID_POINTS = 300


def fan_curves(
    done: Designed, numbers: Sequence[int], active: Sequence[int]
) -> tuple[Table, FanCurves] | None:
    """The curves, and a table: the plant of the spec, the largest of all plants, and each active one.

    None where no model error is bounded.

    Args:
        numbers: what the scenarios are called, in their order; the plant of the spec is 0.
        active: the places of those that bind, in that order.
    """
    problem, units = done.problem, done.units
    bounded = [model_errors((*one.requirements, *one.side)) for one in problem.scenarios]
    if not bounded[0]:
        return None
    peaks = done.design.result.active_frequencies
    grid = np.unique(np.concatenate([error.grid for errors in bounded[:1] for error in errors]))
    lo, hi = bounded[0][0].band
    w = axis(lo, hi, np.concatenate([np.clip(peaks, lo, hi), grid[:: max(grid.size // _GRID_POINTS, 1)]]))
    informations = delivered(problem, done.design, done.experiment.samples)
    ratios = np.array([_largest(errors, M, w) for errors, M in zip(bounded, informations, strict=True)])
    named = {f"plant {numbers[place]}": ratios[place] for place in active if place > 0}
    frequency = w / units.frequency
    columns = {units.frequency_header: frequency, "nominal": ratios[0], "largest": ratios.max(axis=0)}
    columns |= {name.replace(" ", "_"): values for name, values in named.items()}
    return Table(columns), FanCurves(frequency, ratios[1:], ratios[0], named)


def _largest(errors: Sequence[OnModelError], information: Array, w: Array) -> Array:
    """(n,): of several entries of G the largest ratio."""
    return np.max([error.ratios(information, w) for error in errors], axis=0)
