"""What `result.json`, tables and figures say of an exploration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.explore import Candidate, Chosen, Fits, Found, levelled
from inputdesign_cli.identification.response_chance import driving_nothing
from inputdesign_cli.outcome.curves import Curves, FitCurves, FitPanel, OrderCurves
from inputdesign_cli.outcome.results import Json, Table
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.exploration.unidentified import untold_parameters
from inputdesign_cli.records import Record

# An input that changes no more often excites little but its steps.
_FEW_CHANGES = 10


def validation_entry(found: Fits) -> dict[str, Json]:
    """`validation` of `result.json`: numbers for one output, else lists."""
    return {
        "simulation_fit_percent": _finite(found.simulation),
        "prediction_fit_percent": _finite(found.prediction),
    }


def _finite(values: Sequence[float]) -> Json:
    listed = [value if np.isfinite(value) else None for value in values]
    return listed[0] if len(listed) == 1 else listed


def without_drift(log: Record, found: Found) -> Record:
    """The log without the lines that were found to be no work of the inputs, which its steps tell."""
    if found.slopes is None:
        return log
    single = len(found.slopes) == 1
    words = (
        "the line through {} was partly the work of the inputs: one that rises by {} is left beside the plant"
        if log.lined
        else "{} drifts, whatever the inputs do, along a line that rises by {}, found beside the plant"
    )
    told = [
        words.format("y" if single else f"y{i + 1}", f"{slope / log.step:.4g} per {log.time_unit}")
        + "; it was taken away (what is left of it was estimated along), which --detrend linear does for "
        "identify and assess"
        for i, slope in enumerate(found.slopes)
        if slope
    ]
    outputs = [y for _, y in levelled(log.parts, found.slopes)]
    return replace(log, y=np.concatenate(outputs), remarks=(*log.remarks, *told))


def exploration_entry(
    log: Record, found: Found, loops: Sequence[tuple[int, float]], reasons: Sequence[str]
) -> dict[str, Json]:
    """`exploration` of `result.json`."""
    return {
        "channels": dict(log.names),
        "sample_time": log.step,
        "time_unit": log.time_unit,
        "samples": len(log.y),
        "segments": list(log.lengths),
        "steps": list(log.notes),
        "split": found.split,
        "loop": [{"input": f"u{j + 1}", "probability": p} for j, p in loops],
        "outputs": [
            {
                "output": f"y{i + 1}",
                "structure": _structure(taken),
                "delay": list(taken.orders.delays),
                "delay_range": [list(pair) for pair in ranges],
                "output_error_by_order": {str(n): rms for n, rms in chosen.by_order.items()},
                "structures": [_structure(candidate) for candidate in chosen.candidates],
                "not_estimated": list(chosen.dropped),
                "noise_integrates": wanders,
            }
            for i, (chosen, taken, ranges, wanders) in enumerate(
                zip(found.outputs, found.taken, found.ranges, found.wanders, strict=True)
            )
        ],
        "trusted": not reasons,
        "reasons": list(reasons),
    }


def _between(low: int, high: int | None) -> str:
    return f"{low} to {high}" if high is not None else f"{low} at least; no upper limit is told"


def _structure(candidate: Candidate) -> dict[str, Json]:
    return {
        "family": candidate.orders.family,
        "orders": candidate.orders.numbers,
        "delay": list(candidate.orders.delays),
        "parameters": candidate.orders.size,
        "estimation_fit_percent": _finite([candidate.estimation]),
        "simulation_fit_percent": _finite([candidate.validation]),
        "prediction_fit_percent": _finite([candidate.prediction]),
        "criterion": candidate.criterion,
        "failed": list(candidate.failed),
        "converged": candidate.converged,
    }


def exploration_notes(log: Record, found: Found, loops: Sequence[tuple[int, float]]) -> list[str]:
    """What a user should know of the record and of how the model was chosen."""
    single, alone = found.model.outputs == 1, found.model.inputs == 1
    notes = []
    for i, (chosen, taken, ranges) in enumerate(zip(found.outputs, found.taken, found.ranges, strict=True)):
        name = "y" if single else f"y{i + 1}"
        orders = ", ".join(f"{letter} {n}" for letter, n in taken.orders.numbers.items())
        orders += f"; times in {log.time_unit}" if taken.orders.physical else ""
        delays = " and ".join(
            f"{delay} from {'u' if alone else f'u{j + 1}'} (95 %: {_between(low, high)})"
            for j, delay, (low, high) in zip(found.moving, taken.orders.delays, ranges, strict=True)
        )
        notes.append(
            f"{name}: {taken.orders.family} ({orders}), delay in samples {delays}; chosen of "
            f"{len(chosen.candidates)} structures, {_beside_the_best(found, chosen, taken)}"
        )
    notes += [
        f"{'y' if single else f'y{i + 1}'}: no {' or '.join(chosen.dropped)} model could be estimated: the "
        f"record does not tell all its parameters{_least_moved(log, found)}"
        for i, (chosen, taken) in enumerate(zip(found.outputs, found.taken, strict=True))
        if chosen.dropped and taken.orders.order
    ]
    notes += [
        f"{'y' if single else f'y{i + 1}'} wanders as a random walk does, whatever the inputs do: its noise "
        "integrates (noise: {drift: true}), structures are ranked by prediction errors, and the gain is that "
        "of the steps, not of levels that lie far apart"
        for i, wanders in enumerate(found.wanders)
        if wanders
    ]
    notes += [
        f"u{j + 1} never moves in this record: the model has no part of it, and an experiment must move it"
        for j in found.still
    ]
    notes += [
        f"the noise of the outputs helps to tell {'u' if alone else f'u{j + 1}'} (probability {chance(p)} by "
        "chance): the data may come from a loop, or the input was logged late, or the columns are swapped. "
        "They are taken for those of a loop. The direct method is used; the noise model must then be "
        "right, and without a reference that moves the plant may not be identifiable: add a reference or "
        "dither, and write experiment.controller. An input that answers at once is taken to act with a delay"
        for j, p in loops
    ]
    if not alone:
        notes += [
            f"no effect of u{j + 1} on the outputs can be told from none: its delays and parameters say "
            "nothing"
            for j in driving_nothing(found.model, found.estimate)
        ]
    untold = untold_parameters(found)
    if untold:
        notes.append(
            f"{', '.join(untold)}: not told to one digit; G may be right at the frequencies that the inputs "
            "excite, but these numbers say nothing of the plant"
        )
    used = sum(len(y) for _, y in found.used)
    if used < len(log.y):
        notes.append(f"the model is estimated from the {used} samples in which the inputs move most")
    if found.split == "blocks in turn":
        notes.append("an input rests in one part of the record: blocks in turn estimate and judge")
    return notes


def _beside_the_best(found: Found, chosen: Chosen, taken: Candidate) -> str:
    """By how much another structure simulates the part that judges better: other rules count, too."""
    judge = "the record" if found.split == "none" else "the part that judges"
    better = max(c.validation for c in chosen.candidates) - taken.validation
    if better <= 0.0:
        return f"of which it simulates {judge} best"
    return f"of which the best simulates {judge} by {better:.2g} points better"


def _least_moved(log: Record, found: Found) -> str:
    """The input that changes in the fewest samples, of several, where these are few."""
    if len(found.moving) < 2:
        return ""
    changes = {j: sum(int(np.sum(np.diff(u[:, j]) != 0.0)) for u, _ in log.parts) for j in found.moving}
    least = min(found.moving, key=lambda j: changes[j])
    few = changes[least] <= _FEW_CHANGES
    return f" (u{least + 1} changes in {changes[least]} of its samples only)" if few else ""


def structure_curves(found: Found) -> dict[str, Curves]:
    """structures.png, one an output."""
    curves: dict[str, Curves] = {}
    for i, (chosen, taken) in enumerate(zip(found.outputs, found.taken, strict=True)):
        usable = [c for c in chosen.candidates if np.isfinite(c.validation)]
        families = sorted({c.orders.family for c in usable})
        fits = {
            family: (
                np.array([float(c.orders.size) for c in usable if c.orders.family == family]),
                np.array([c.validation for c in usable if c.orders.family == family]),
            )
            for family in families
        }
        single = len(found.outputs) == 1
        mark = (float(taken.orders.size), taken.validation)
        curves["structures" if single else f"structures_{i + 1}"] = OrderCurves(
            fits, mark, taken.orders.family, None if single else i, found.split != "none"
        )
    return curves


def validation_curves(units: Units, data: Record, found: Fits) -> tuple[Table, FitCurves]:
    """fit.csv with its figure: a given model against data. In the figure files follow each other."""
    u, y, lengths = data.u, data.y, data.lengths
    columns = {units.time_header: data.time}
    if len(lengths) > 1:
        columns["record"] = np.repeat(np.arange(1.0, len(lengths) + 1), lengths)
    panels = []
    for j, values in enumerate(u.T):
        columns["u" if units.single else f"u{j + 1}"] = values
    for i, values in enumerate(y.T):
        name = "y" if units.single else f"y{i + 1}"
        predicted = values - found.errors[:, i]
        runs = np.all(np.isfinite(found.simulated[:, i]))
        columns |= {name: values, f"{name}_predicted": predicted}
        columns |= {f"{name}_simulated": found.simulated[:, i]} if runs else {}
        panels.append(
            FitPanel(
                values,
                predicted,
                found.simulated[:, i] if runs else None,
                found.simulation[i] if runs else None,
                i,
                units.label(f"y{i + 1}"),
            )
        )
    one = bool(np.all(np.diff(data.time) > 0.0))
    instants = data.time if one else units.sample_time * np.arange(len(y), dtype=np.float64)
    return Table(columns), FitCurves(instants, tuple(panels), lengths)
