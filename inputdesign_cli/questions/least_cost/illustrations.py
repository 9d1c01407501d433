"""Tables and curves of a convex design: its spectrum, r_u, the loop, the proof, and ellipses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import ModelError, OnModelError, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.objectives import white_labels
from inputdesign_cli.outcome.results import Result, Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound import bound_curves, equal_white
from inputdesign_cli.questions.common.ellipses import Pairs, experiment_ellipses
from inputdesign_cli.questions.common.nyquist import nyquist_curves
from inputdesign_cli.questions.common.spectrum import optimality_curves, spectrum_curves, with_periodogram
from inputdesign_cli.questions.least_cost.outcome import Designed
from inputdesign_cli.signal import Record


def illustrations(
    units: Units,
    done: Designed,
    result: Result,
    *,
    record: Record | None,
    known: Array | None,
    as_long: Callable[[], Array | None],
    unstated: Sequence[ModelError],
    ellipses: Pairs | None,
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """Those of a design; of one that needs no excitation the spectrum alone.

    Args:
        known: the information (k, k) of the record, None where it leaves a parameter undetermined; `as_long`
            gives that of one like it as long as the design.
        unstated: errors of entries of G where nothing is asked of them.
    """
    design = done.design
    found, problem = design.result, design.problem
    level = design.white_power if units.inputs == 1 else None
    spectrum = spectrum_curves(units, found.basis, found.x, problem.experiment.band, white=level)
    if record is not None:
        spectrum = with_periodogram(units, *spectrum, record.samples)
    tables: dict[str, Table] = {"spectrum": spectrum[0]}
    curves: dict[str, Curves] = {"spectrum": spectrum[1]}
    if not found.x.any():
        return tables, curves
    white = design.white.informations[0] / (design.white.s if problem.goal == "factor" else 1.0)
    asked = (*problem.requirements, *problem.side)
    stated = model_errors(asked)
    errors = stated or [replace(error, experiment=done.experiment) for error in unstated]
    active = [found.active_at(i) for i, r in enumerate(asked) if isinstance(r, OnModelError)]
    with suppress(np.linalg.LinAlgError):  # a parameter that a T-optimal design does not excite
        tables["bound"], curves["bound"] = bound_curves(
            units,
            errors,
            done.information,
            white=white,
            equal=equal_white(design, done.experiment.samples, result["baseline"]["white"]["ratio"]),
            white_labels=white_labels(result),
            record=known if stated else as_long(),
            stated=bool(stated),
            active=active,
            of_several=done.plants is not None,
        )
        loops = nyquist_curves(units, errors[:1], done.information, active)
        tables, curves = tables | loops[0], curves | loops[1]
    optimality = optimality_curves(units, design)
    if optimality is not None:
        tables["optimality"], curves["optimality"] = optimality
    shown = white if problem.demands.definite else None
    drawn = experiment_ellipses(done.experiment, done.information, shown, ellipses)
    if drawn is not None:
        curves["ellipses"] = drawn
    return tables, curves
