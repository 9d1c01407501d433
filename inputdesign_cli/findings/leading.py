"""Find the objection to an estimate that may explain the others, and the one command to run next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from inputdesign_cli.explore.drift import slopes_of
from inputdesign_cli.explore.relation import unstable_pole
from inputdesign_cli.finding import NOTE, Finding, undecided
from inputdesign_cli.findings.places import Record, argument
from inputdesign_cli.findings.refuted_structure import DRIFT, PLANT
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.loop import INTEGRATES
from inputdesign_cli.plant.model import SampledPlant

# SPEC and options of the command that was typed are filled in where they are known, on the command line.
_ASSESS = "idesign assess SPEC "
_AGAIN = _ASSESS + "{logs} "
_ALONE = _ASSESS + "{last}"
_EXPLORE = "idesign explore {columns}{logs}"
_STATED = _AGAIN + " # with the finding mended: explore finds stable plants only, and this one is unstable"
_NEXT = {
    # Samples that are wrong or of another system upset every test.
    "samples-repeated": _ALONE,
    "columns-misaligned": _EXPLORE,
    "sensor-stands-still": _AGAIN + "{rows}",
    "spikes": _AGAIN + "{rows}",
    "sensor-too-coarse": "idesign solve SPEC  # and apply it with larger moves, or log with more digits",
    "input-logged-late": _EXPLORE,
    "input-answers-output": _AGAIN
    + '--set "experiment.controller={{numerator: [..], denominator: [..]}}"  # the controller of the loop',
    # Effects that differ may cancel in the estimate from all records.
    "records-differ": _ALONE,
    "input-without-effect": _EXPLORE,
    "prior-of-these-data": _AGAIN + "--set experiment.prior=null",
    "prior-contradicted": _AGAIN + "--set experiment.prior=null",
    "level-shift": _AGAIN + "{rows}",
    # An error of G, or a trend, makes tests of the noise and of constant parameters fail.
    "plant-structure": _EXPLORE,
    "drift": _AGAIN + "--set noise.drift=true",
    "noise-structure": _EXPLORE,
    "search-not-settled": _EXPLORE,
    "stopped-at-an-end": _EXPLORE,
    "parameter-missing": _EXPLORE,
    "plant-nonlinear": _EXPLORE,
    "plant-changed": _AGAIN + "--range {half}",
    "no-accuracy-here": _EXPLORE,
    "neglected-parameter": _EXPLORE,
    "other-minimum": "idesign solve SPEC --set signal.seed=2 --set spectrum=null"
    "  # a smooth spectrum, of more frequencies; then assess both records",
    # Findings on a frequency response without a model.
    "spiked-periods": _AGAIN + "--without ROWS",
    "drifting-periods": _AGAIN + "--detrend linear",
    "nonlinear-response": "idesign solve SPEC --set signal.phases=random  # and apply half of it",
    "response-within-chance": _AGAIN + "MORE.csv  # a further record of this signal",
}
"""The command after each finding that leaves a verdict open; earlier entries precede later ones."""
_DETREND = _AGAIN + "--detrend linear"
_ORDER = list(_NEXT)
_LEAK = 1e-3  # per sample, the nominal value of a leak
# Notes that may follow from a wrong model as well.
_ALSO = ("start-estimated",)
# A shift of level that takes more than this share of a record is a drift.
_WIDE = 0.1


class Leading(NamedTuple):
    """The findings that come first, usually one, and the command to run next."""

    findings: list[Finding]
    command: str


def leading(findings: Sequence[Finding], estimate: Estimate | None, data: Record) -> Leading | None:
    """Return the findings that leave a verdict open and explain the others; None if nothing does.

    A drift that explains them is a finding of its own, even if no test has found it.

    Args:
        estimate: the estimate of a model from the `data`; None for a response without a model.
    """
    against = [one for one in findings if undecided([one])]
    if not against:
        return None
    first = min(against, key=lambda one: _rank(one.code))
    alike, command = [one for one in against if one.code == first.code], _NEXT.get(first.code, _EXPLORE)
    instead = "" if estimate is None else _slow_cause(first, against, estimate, data)
    if instead:
        drifts = [one for one in against if one.code == DRIFT.code]
        alike, command = drifts or [DRIFT.found("they follow a line", where="y")], instead
    elif estimate is not None and first.code == DRIFT.code and _drifts(_model(estimate)):
        command = _EXPLORE
    option = str(alike[0].figures.get("option", "--without ROWS"))
    if option == "--without" and "{rows}" in command:  # too many rows to be listed
        command = _EXPLORE
    if command == _EXPLORE and any(unstable_pole(data.parts, i) for i in range(data.y.shape[1])):
        command = _STATED
    middle, files = float(data.time[len(data.time) // 2]), [*map(argument, data.paths or ("DATA",))]
    figures = {
        "columns": data.columns_option,
        "logs": shlex.join(files),
        "last": shlex.quote(files[-1]),
        "rows": option,
        "half": f"{float(data.time[0]):g}:{middle:g}",
    }
    return Leading(alike, command.format(**figures))


def _slow_cause(first: Finding, against: Sequence[Finding], estimate: Estimate, data: Record) -> str:
    """Return the command for a drift along a line, or for a leak of an integrator, that explains the rest.

    Past inputs, or a shift of most of a record, may stand for the effect of a leak. A line in the output of a
    plant that integrates may be its response to the input. Noise that integrates explains a line already.
    """
    model, rows = _model(estimate), first.figures.get("rows")
    wide = isinstance(rows, list) and any(last - begin > _WIDE * len(data.y) for begin, last in rows)
    shift = first.code == "level-shift"
    if _rank(first.code) < _rank("level-shift") or (shift and not wide):
        return ""
    integrates = bool(np.any(np.abs(model.plant_points) < INTEGRATES))
    if not (data.lined or integrates or _drifts(model)) and np.any(slopes_of(data.parts)):
        return _DETREND
    of_drift = first.code in (DRIFT.code, PLANT.code) and any(one.code == DRIFT.code for one in against)
    if not (shift or of_drift) or _no_leak(estimate) or not (denominator := _leaking(model)):
        return ""
    rate = _LEAK / float(np.median(np.diff(data.time)))
    return (
        f"{_AGAIN}--set plant.parameters.leak={rate:.1g} "
        f'--set "plant.continuous.denominator={denominator}"  # it may leak'
    )


def _rank(code: str) -> int:
    return _ORDER.index(code) if code in _ORDER else len(_ORDER)


def _model(estimate: Estimate) -> Model:
    return estimate.search.records.kind.model


def _leaking(model: Model) -> str:
    """Return the denominator with a leak of a plant that is known to integrate; empty for another plant.

    A tank whose outflow grows with its level looks as if its noise drifted.
    """
    plant = blocks_of(model)["plant"]
    match plant, plant.get("continuous", {}):
        case {"parameters": known}, {"denominator": [*others, 0 | "0"]} if "leak" not in known and not any(
            isinstance(one, list) for one in others
        ):
            return f"[{', '.join(f'{one}' for one in others)}, leak]"
    return ""


def _no_leak(estimate: Estimate) -> bool:
    """Return whether past inputs explain the residuals better than a leak: a lag is missing, for example."""
    failing = (test.probability for test in estimate.tests.failed_besides if test.fault == "plant")
    leak = (test.probability for test in estimate.tests.scores if test.name == "leak")
    return min(failing, default=1.0) < min(leak, default=1.0)


def _drifts(model: Model) -> bool:
    """Return whether the noise of the model drifts already."""
    return not model.continuous and cast(SampledPlant, model).integrates


def following(findings: Sequence[Finding], first: Leading) -> list[Finding]:
    """Return all findings; what may follow from the first ones alone says so.

    A lag that a model lacks looks like a drift, a wrong level, or another plant than the spec has.
    """
    leaders, follow = {one.code for one in first.findings}, f"This may follow from {first.findings[0].code}"
    return [
        one
        if one.code in leaders or (one.severity == NOTE and one.code not in _ALSO)
        else replace(one, message=f"{follow}: {one.message}")
        for one in findings
    ]
