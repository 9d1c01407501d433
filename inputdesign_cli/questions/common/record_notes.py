"""What a user should know before applying a record."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.questions.common.record import RecordRequest, worst_ratio
from inputdesign_cli.signal import Record

_FALLS_SHORT = 5e-3
_DEAR = 1.0  # beyond the cost of the design, relative to it
_NO_RECORD = (
    "there is no record: it would have {} samples, and at most {} are computed for this model; "
    "signal.samples sets a shorter one"
)


def record_notes(
    request: RecordRequest,
    experiment: int,
    record: Record | None,
    of_limits: Mapping[str, float],
    *,
    of_powers: bool = False,
) -> list[str]:
    """What a user should know before applying the record.

    Args:
        experiment: its samples.
        of_limits: the share of each limit on single samples that the record takes.
        of_powers: whether powers are limited.
    """
    if record is None:
        too_long = request.length(experiment) > request.longest
        return [_NO_RECORD.format(request.length(experiment), request.longest)] if too_long else []
    notes = []
    if not record.met and not np.isfinite(record.worst_ratio):
        notes.append(
            "the record does not tell all parameters apart to working precision, so that nothing can be said "
            "of the accuracy that it reaches: take more samples (signal.samples), or a model of lower order"
        )
    elif not record.met:
        held = of_powers or bool(of_limits) or request.bounds.hard or request.settings.level is not None
        why = (
            "the limits on the powers, the level asked for or its length leave no room: a little more power "
            "or a few more samples would do"
            if held
            else "no level of it would do, since too little of what it causes comes before its last sample: "
            "take more samples"
        )
        notes.append(f"the record misses the accuracy: its worst ratio is {record.worst_ratio:.7g}; {why}")
    asked = request.samples or experiment
    longer = record.method != "given" and len(record.samples) > asked + request.settings.block
    if record.method != "given" and record.extra_power > _DEAR and not longer:
        notes.append(
            f"the record costs {1.0 + record.extra_power:.3g} times what the designed spectrum does: its "
            f"{len(record.samples)} samples are few beside the dead times and time constants of the plant, "
            "and much of what they cause comes after the last one; take more samples"
        )
    if longer:
        nearest = max(of_limits, key=lambda name: of_limits[name], default=None)
        share = f"; the record takes {100 * of_limits[nearest]:.3g} % of limits.{nearest}" if nearest else ""
        notes.append(
            f"within the limits on single samples {len(record.samples)} samples are the shortest record that "
            f"was found, by trying, to one per cent; the spectrum alone would take {asked}{share}"
        )
    return notes


def shortfall(design: Design, record: Record, information: Array) -> list[str]:
    """What a record of the best accuracy misses: the accuracy that the design has, and what else is required.

    Args:
        information: (k, k) of the record.
    """
    problem, notes = design.problem, []
    best = float(np.sqrt(design.result.objective))
    if problem.goal == "factor" and problem.demands.criterion is None:
        more = record.worst_ratio / best - 1.0
        if more > _FALLS_SHORT:
            notes.append(
                f"the record reaches {record.worst_ratio:.4g} times the admissible error, the design "
                f"{best:.4g}: {per_cent(more)} more, by its length or by the limits on single samples"
            )
    missed = worst_ratio(problem.side)(information)
    if missed > 1.0 + _FALLS_SHORT:
        names = " and ".join(dict.fromkeys(requirement.name for requirement in problem.side))
        notes.append(f"the record misses {names}, which the design meets: its worst ratio is {missed:.4g}")
    return notes
