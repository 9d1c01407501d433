"""Report in `result.json`, tables and figures how a model was found and how it fits other data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Fits
from inputdesign_cli.explore.joint import Found
from inputdesign_cli.explore.search import Candidate
from inputdesign_cli.identification.nonlinearity import SilentLines
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.curves import Curves, OrderCurves
from inputdesign_cli.outcome.estimate import (
    Exploration,
    ExploredOutput,
    FeedbackInput,
    Fit,
    Structure,
    Validation,
)
from inputdesign_cli.questions.frequency_response.measure import silent_entry
from inputdesign_cli.records import Record


def validation_of(found: Fits, reasons: tuple[str, ...] | None = None) -> Validation:
    """Return the entry `validation` of the result: numbers for one output, else lists."""

    def entry(values: Sequence[float]) -> Fit:
        finite = tuple(float(x) if np.isfinite(x) else None for x in values)
        return finite[0] if len(finite) == 1 else finite

    return Validation(entry(found.simulation), entry(found.prediction), reasons)


def exploration_of(
    log: Record,
    found: Found,
    loops: Sequence[tuple[int, float]],
    reasons: tuple[str, ...],
    lines: MeasuredLines | None,
    silent: Mapping[str, SilentLines],
) -> Exploration:
    """Return the entry `exploration` of the result."""
    return Exploration(
        channels=dict(log.names),
        sample_time=log.step,
        time_unit=log.time_unit,
        samples=len(log.y),
        segments=log.lengths,
        steps=log.notes,
        split=found.split,
        loop=tuple(FeedbackInput(f"u{j + 1}", p) for j, p in loops),
        outputs=tuple(
            ExploredOutput(
                output=f"y{i + 1}",
                structure=_structure(taken),
                delay=taken.orders.delays,
                delay_range=taken.ranges,
                output_error_by_order={
                    str(n): float(np.sqrt(one.loss)) for n, one in chosen.swept.by_order.items()
                },
                structures=tuple(map(_structure, chosen.candidates)),
                not_estimated=chosen.dropped,
                noise_integrates=wanders,
            )
            for i, (chosen, taken, wanders) in enumerate(
                zip(found.outputs, found.taken, found.wanders, strict=True)
            )
        ),
        trusted=not reasons,
        reasons=reasons,
        frequency_response=lines,
        nonlinearity=silent_entry(silent) or None,
    )


def _structure(candidate: Candidate) -> Structure:
    fits = (candidate.estimation, candidate.validation, candidate.prediction)
    return Structure(
        candidate.orders.family,
        candidate.orders.numbers,
        candidate.orders.delays,
        candidate.orders.size,
        candidate.criterion,
        candidate.failed,
        candidate.converged,
        candidate.certain,
        *(fit if np.isfinite(fit) else None for fit in fits),
    )


def structure_curves(found: Found) -> dict[str, Curves]:
    """Return the curves of structures.png, one for each output."""
    curves: dict[str, Curves] = {}
    for i, (chosen, taken) in enumerate(zip(found.outputs, found.taken, strict=True)):
        single, fits = len(found.outputs) == 1, dict[str, tuple[Array, Array]]()
        for family in sorted({c.orders.family for c in chosen.candidates}):
            own = [(c.orders.size, c.validation) for c in chosen.candidates if c.orders.family == family]
            sizes, shares = np.array(own, dtype=float).T
            fits[family] = sizes, shares
        at, output = (float(taken.orders.size), taken.validation), None if single else i
        drawn = OrderCurves(fits, at, output, found.split != "none")
        curves["structures" if single else f"structures_{i + 1}"] = drawn
    return curves
