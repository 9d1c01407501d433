"""Say in `result.json`, tables and figures how a model was found and how it does on other data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore import Candidate, Fits, Found
from inputdesign_cli.findings.explored_logs import open_parameters
from inputdesign_cli.findings.prepared_records import JITTER_EVENED
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.nonlinearity import SilentLines
from inputdesign_cli.identification.response_chance import perhaps_zero
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
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model
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
                delay_range=ranges,
                output_error_by_order={
                    str(n): float(np.sqrt(one.loss)) for n, one in chosen.swept.by_order.items()
                },
                structures=tuple(map(_structure, chosen.candidates)),
                not_estimated=chosen.dropped,
                noise_integrates=wanders,
            )
            for i, (chosen, taken, ranges, wanders) in enumerate(
                zip(found.outputs, found.taken, found.ranges, found.wanders, strict=True)
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


_IN_WORDS = {
    "FOPDT": "a lag with dead time",
    "SOPDT": "second order of damping zeta, with dead time",
    "TOPDT": "third order with dead time",
}
_DIRECT = "The direct method is used; the noise model must then be right"
_LOOP = (
    "the data may come from a loop, or the input was logged late, or the columns are swapped. They are taken "
    f"for data of a loop. {_DIRECT}, and without a reference that moves the plant may not be identifiable: "
    "add a reference or dither, and write experiment.controller"
)
_BEHIND_REFERENCE = (
    f"the data come from a loop behind the reference. {_DIRECT}. For a design write experiment.controller "
    "in the spec"
)


def exploration_notes(log: Record, found: Found, loops: Sequence[tuple[int, float]]) -> Iterator[str]:
    """Yield remarks on the record and on the choice of the model."""
    outputs, inputs = found.model.outputs, found.model.inputs
    yield from (_chosen(log, found, i) for i in range(outputs))
    for i, (slope, wanders) in enumerate(zip(found.slopes, found.wanders, strict=True)):
        name = signal_name("y", i, outputs)
        if slope:
            yield (
                f"{name} drifts along one line through all records, {slope / log.step:.4g} per "
                f"{log.time_unit} whatever the inputs do: it was taken away, which --detrend linear does "
                "for identify and assess"
            )
        if wanders:
            yield (
                f"{name} wanders as a random walk does, whatever the inputs do: the gain is that of the "
                "steps, not of levels that lie far apart"
            )
    for damping, slow, fast in _real_lags(found.model):
        yield (
            f"{damping:.3g} is a damping above 1: the plant has two lags, {slow:.4g} and {fast:.4g} "
            f"{log.time_unit}"
        )
    if np.any(found.model.dead_times) and any(one.code == JITTER_EVENED.code for one in log.findings):
        yield (
            "a dead time counts from the row in which the input has moved: it is longer by up to "
            f"{log.step:.4g} {log.time_unit} if the input moved between two rows"
        )
    for j in found.still:
        yield (
            f"u{j + 1} never moves in this record: the model has no part of it, and is one in q^-1. An "
            "experiment must move it; or leave it out of --columns, and models in s are tried as well"
        )
    for j, p in loops:
        yield (
            f"the noise of the outputs helps to predict {signal_name('u', j, inputs)} (probability "
            f"{chance(p)} by chance): {_LOOP if log.r is None else _BEHIND_REFERENCE}"
        )
    for j in perhaps_zero(found.model, found.estimate, inputs=True) if inputs > 1 else ():
        yield (
            f"u{j + 1} has no effect on the outputs that differs from none: its delays and parameters say "
            "nothing"
        )
    uncertain = ", ".join(open_parameters(found))
    if uncertain:
        yield (
            f"{uncertain}: not known to one digit; G may be right at the frequencies that the inputs "
            "excite, but these numbers say nothing of the plant"
        )
    used = sum(len(y) for _, y in found.used)
    if used < len(log.y):
        yield f"the model is estimated from the {used} samples in which the inputs move most"
    if found.split == "blocks in turn":
        yield "an input rests in one part of the record: blocks in turn estimate and judge"


def _real_lags(model: Model) -> Iterator[tuple[float, float, float]]:
    """Yield the damping and the two lags of each plant of second order that does not swing."""
    known = blocks_of(model)["plant"].get("parameters", {})
    for name, damping in known.items():
        time = known.get(name.replace("zeta", "T"))
        if name.startswith("zeta") and time is not None and damping > 1.0:
            apart = math.sqrt(damping**2 - 1.0)
            yield damping, time * (damping + apart), time * (damping - apart)


def _chosen(log: Record, found: Found, i: int) -> str:
    """Return the structure that was chosen for an output, beside the others."""
    chosen, taken, ranges = found.outputs[i], found.taken[i], found.ranges[i]
    orders = ", ".join(f"{letter} {n}" for letter, n in taken.orders.numbers.items())
    family, known = taken.orders.family, _IN_WORDS.get(taken.orders.family)
    orders = "; ".join(filter(None, (family if known else "", orders)))
    orders += f"; times in {log.time_unit}" if taken.orders.physical else ""
    delays = " and ".join(
        f"{delay} from {signal_name('u', j, found.model.inputs)} (95 %: "
        f"{f'{low} at least' if high is None else low if low == high else f'{low} to {high}'})"
        for j, delay, (low, high) in zip(found.moving, taken.orders.delays, ranges, strict=True)
    )
    judge = "the record" if found.split == "none" else "the part that judges"
    better = max(c.validation for c in chosen.candidates) - taken.validation
    beside = f"the best explains {better:.2g} % more of {judge}"
    tried = f"chosen of {len(chosen.candidates)} structures, of which "
    tried += beside if better > 0.0 else f"it explains most of {judge}"
    return (
        f"{signal_name('y', i, found.model.outputs)}: {known or family} ({orders}), delay in samples "
        f"{delays}; {tried if len(chosen.candidates) > 1 else 'no other structure was compared'}"
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
        drawn = OrderCurves(fits, at, taken.orders.family, output, found.split != "none")
        curves["structures" if single else f"structures_{i + 1}"] = drawn
    return curves
