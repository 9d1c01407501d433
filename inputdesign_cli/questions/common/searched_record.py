"""The best record of two levels within an amplitude that a search finds, and its distance to the bound."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import criterion_of
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import time_is_over
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.record_bound import RecordBound
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.signal.flips import FlipSearch, PlantGoal
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import SignalSettings

# Random signs of the best spectrum to begin with, and random changes of the best record at last.
_STARTS, _CHANGES = 8, 40


def searches(design: Design, settings: SignalSettings, *, amplitude_alone: bool) -> bool:
    """Return whether a record is searched: two levels, the best accuracy, and no limit but the amplitude."""
    free = settings.periods == 1 and not settings.ramp and settings.level is None
    two_levels = kind_of(settings.method).switched
    return (
        amplitude_alone and free and two_levels and design.any_record is not None and best_is_sought(design)
    )


def best_is_sought(design: Design) -> bool:
    """Return whether the accuracy is what is optimised, so that every record takes all of the amplitude."""
    return design.problem.goal == "factor" and not design.problem.side


def searched(
    design: Design, record: Record, settings: SignalSettings, plants: Mapping[int, FiniteRecord]
) -> Array:
    """Return the best record (samples, r) of two levels that is found from a first one.

    The search ends at `settings.tolerance` above the bound over all records, after `settings.seconds`, or
    after a number of tries.

    Args:
        plants: the scenarios whose requirements count, by their numbers.
    """
    bound, hold = design.any_record, settings.hold
    assert bound is not None
    amplitude = np.abs(bound.best).max(axis=0)
    goals = [PlantGoal(plant, design.problem.scenarios[n].requirements) for n, plant in plants.items()]
    rng, ends = np.random.default_rng(settings.seed), time.monotonic() + settings.seconds

    def starts() -> Iterator[Array]:
        yield np.where(record.samples[::hold] >= 0.0, amplitude, -amplitude)
        yield bound.best
        for _ in range(_STARTS):
            yield np.where(_drawn(bound, len(bound.best), rng) >= 0.0, amplitude, -amplitude)

    search = FlipSearch(goals, np.array([-amplitude, amplitude]), len(bound.best), hold)
    samples, _ = search.best(
        starts(),
        rng,
        enough=(1.0 + settings.tolerance) * float(np.sqrt(bound.bound)),
        over=lambda: time_is_over() or time.monotonic() >= ends,
        changes=_CHANGES,
    )
    return samples


def _drawn(bound: RecordBound, values: int, rng: np.random.Generator) -> Array:
    """Return values (n, r) of the spectrum that belongs to the bound, with random phases."""
    lines = Lines(*bound.result.basis.lines(bound.result.x))
    phases = np.exp(2j * np.pi * rng.random((len(lines.powers), lines.inputs)))
    vectors = np.einsum("lab,lb->la", lines.roots, phases)
    turns = np.exp(1j * np.outer(np.arange(values), lines.frequencies))
    return np.asarray((turns @ vectors).real)


def distance_to_best(design: Design, information: Array) -> float | None:
    """Return how far the errors of a record of this information lie above the bound over all records.

    None where no record was bounded, or where the accuracy is not what is optimised.
    """
    bound, problem = design.any_record, design.problem
    if bound is None or not best_is_sought(design):
        return None
    criterion = criterion_of(problem.requirements)
    worst = max(requirement.worst(information).ratio for requirement in problem.requirements)
    if criterion is not None:  # errors fall as the root of its level grows
        worst = float(1.0 / np.sqrt(criterion.level(information)))
    return float(worst / np.sqrt(bound.bound) - 1.0)


def improved(
    design: Design, record: Record, settings: SignalSettings, plants: Mapping[int, FiniteRecord], score
) -> Record:
    """Return the record that a search finds, or the first one where that is no worse."""
    samples = searched(design, record, settings, plants)
    found = score(samples)
    return record if found >= record.worst_ratio else replace(record, samples=samples, worst_ratio=found)
