"""State how a frequency response is asked for, and what a record designed for it does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Weight, weighted_sum, weights_of
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.response_lines import Goal, ResponseDesign, ResponseLines, ResponseProblem
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.outcome import Powers
from inputdesign_cli.outcome.curves import DeviationCurves, DeviationPanel
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.signal.selection import Record

KEY = "accuracy.frequency_response"


@dataclass(frozen=True)
class ResponseTerms:
    """The lines and their accuracy, limits and cost.

    Attributes:
        experiment: with the samples that count (one where the shortest is asked for).
        asked: samples that the spec gives the experiment.
        most_samples: of the longest record, where the spec limits it.
        tabulated: whether the noise comes from a table, so that there is no model of it.
    """

    header: Header
    experiment: Experiment
    grid: HarmonicGrid
    lines: ResponseLines
    periods: Periods
    goal: Goal
    cost: Mapping[PowerKind, Weight]
    limits: tuple[PowerLimit, ...]
    tolerance: float
    asked: int
    most_samples: int | None
    tabulated: bool

    @property
    def frequency(self) -> Array:
        """Return the frequencies (L,) of the lines in the unit of the spec."""
        return self.grid.frequencies / self.header.units.frequency

    def gains(self, kind: PowerKind) -> Array:
        """Return what a unit of power of each line adds to each power, (L, channels, r)."""
        return np.asarray(np.abs(self.experiment.response(kind, self.grid.frequencies)) ** 2)

    def problem(self, samples: int) -> ResponseProblem:
        """Return the prices and limits of the lines, and the powers that meet the accuracy in `samples`."""

        def added(kind: PowerKind, channel: int | None) -> NDArray[np.float64]:
            gains = self.gains(kind)
            return np.asarray(gains.sum(axis=1) if channel is None else gains[:, channel]).ravel()

        needed = self.lines.needed(samples).ravel()
        paid = (w * added(kind, channel) for kind, channel, w in weights_of(self.cost))
        rows = [added(limit.kind, limit.channel) for limit in self.limits]
        return ResponseProblem(
            needed, sum(paid, np.zeros(needed.size)), self.limits, np.array(rows).reshape(-1, needed.size)
        )

    def powers(self, lines: NDArray[np.float64]) -> tuple[Powers, float]:
        """Return mean squares by channel, and the cost, of lines with powers (L, r)."""
        found = {kind: np.einsum("lar,lr->a", self.gains(kind), lines).tolist() for kind in POWER_KINDS}
        return Powers(**{kind: tuple(power) for kind, power in found.items()}), weighted_sum(self.cost, found)


@dataclass(frozen=True)
class Planned:
    """The experiment to be applied: powers (L, r), the samples that count, the record, its deviations.

    Attributes:
        problem: for the samples that count.
        deviations: (L, p, r): of the record; by a model of the noise it is seen through the finite length.
        shift: by the start, in these deviations.
    """

    design: ResponseDesign
    problem: ResponseProblem
    powers: NDArray[np.float64]
    counted: int
    record: Record
    deviations: NDArray[np.float64]
    shift: float

    @property
    def length(self) -> int:
        """The number of samples of the record, transient included."""
        return len(self.record.samples)

    @property
    def applied(self) -> NDArray[np.float64]:
        """Return the powers (L, r) of the record."""
        return self.powers * (1.0 + self.record.extra_power)

    @property
    def flat(self) -> NDArray[np.float64]:
        """Return equal lines (L, r) with the power of the record in each input."""
        return np.broadcast_to(self.applied.mean(axis=0), self.powers.shape)


def deviation_curves(
    units: Units,
    w: Array,
    lines: ResponseLines,
    listed: Mapping[str, NDArray[np.float64]],
    found: tuple[str, str] | None = None,
) -> tuple[dict[str, Array], DeviationCurves]:
    """Return the columns of deviations.csv and its figure, for the entries of G that are bounded.

    Args:
        w: (L,), the lines in the user's unit.
        listed: columns (L, p, r), of which `deviation` is the designed one.
        found: another column to draw, and its label.
    """
    columns: dict[str, Array] = {units.frequency_header: w}
    panels = []
    for i, j in np.ndindex(lines.admitted.shape[1:]):
        admitted, size = lines.admitted[:, i, j], np.abs(lines.G[:, i, j])
        if not np.all(np.isfinite(admitted)):
            continue
        of_entry = {"G_abs": size, "r_adm": admitted, **{name: x[:, i, j] for name, x in listed.items()}}
        columns |= {f"{name}{units.suffix(i, j)}": values for name, values in of_entry.items()}
        entry = None if units.single else (i, j)
        drawn, label = (None, "") if found is None else (of_entry[found[0]], found[1])
        shown = (w, size, admitted, of_entry["deviation"], drawn, label)
        panels.append(DeviationPanel(*shown, entry, units.passage(entry)))
    return columns, DeviationCurves(tuple(panels))
