"""Find what invalidates the other objections to an estimate, and the one command to run next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.drift import slopes_of
from inputdesign_cli.finding import NOTE, Finding, undecided
from inputdesign_cli.findings.places import Record, argument
from inputdesign_cli.findings.refuted_structure import DRIFT, drifting, leaking, no_leak
from inputdesign_cli.identification import Estimate
from inputdesign_cli.plant.loop import INTEGRATES
from inputdesign_cli.plant.model import SampledPlant

# SPEC and options of the command that was typed are filled in where they are known, on the command line.
_ASSESS = "idesign assess SPEC "
_AGAIN = _ASSESS + "{logs} "
_ALONE = _ASSESS + "{last} --output {alone}"  # where the run of all records does not stand
_EXPLORE = "idesign explore {columns}{logs}"
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
    # Of a frequency response without a model.
    "spiked-periods": _AGAIN + "--without ROWS",
    "drifting-periods": _AGAIN + "--detrend linear",
    "nonlinear-response": "idesign solve SPEC --set signal.phases=random  # and apply half of it",
    "response-within-chance": _AGAIN + "MORE.csv  # a further record of this signal",
}
"""The command after each finding that leaves a verdict open; an earlier one silences the later ones."""
_DETREND = _AGAIN + "--detrend linear"
_ORDER = list(_NEXT)
_LEAK = 1e-3  # a sample, to begin with
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
        estimate: of a model from the `data`; None for a response without one.
    """
    against = [one for one in findings if undecided([one])]
    if not against:
        return None
    first = min(against, key=lambda one: _ORDER.index(one.code) if one.code in _ORDER else len(_ORDER))
    alike, command = [one for one in against if one.code == first.code], _NEXT.get(first.code, _EXPLORE)
    lined = data.lined or (estimate is not None and _integrates(estimate))
    if estimate and not lined and _may_drift(first, data) and np.any(slopes_of(data.parts)):
        found = [one for one in against if one.code == DRIFT.code]
        alike = found or [DRIFT.found("they follow a line", remedy="Remove the trend.", where="y")]
        command = _DETREND
    drifts, own = [one for one in against if one.code == DRIFT.code], command == _NEXT[DRIFT.code]
    shifts = first.code == "level-shift" and _may_drift(first, data)
    if estimate is not None and ((drifts and (own or first.code == "plant-structure")) or shifts):
        # Past inputs, or a shift of most of a record, explain what a leak takes away.
        if leaks := _leaking(estimate, data.time):
            model = estimate.search.records.kind.model
            alike, command = drifts or [drifting(model, "its level shifts for most of the record")], leaks
        elif own and _drifts(estimate):
            command = _EXPLORE
    option = str(alike[0].figures.get("option", "--without ROWS"))
    if option == "--without" and "{rows}" in command:  # too many rows to be listed
        command = _EXPLORE
    middle, files = float(data.time[len(data.time) // 2]), [*map(argument, data.paths or ("DATA",))]
    figures = {
        "columns": data.columns_option,
        "logs": shlex.join(files),
        "last": shlex.quote(files[-1]),
        "alone": shlex.quote(f"runs/{Path(files[-1]).stem}_alone"),
        "rows": option,
        "half": f"{float(data.time[0]):g}:{middle:g}",
    }
    return Leading(alike, command.format(**figures))


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


def _integrates(estimate: Estimate) -> bool:
    """Return whether the plant integrates, so that a line in the output may be its answer to the input."""
    points = estimate.search.records.kind.model.plant_points
    return bool(np.any(np.abs(points) < INTEGRATES))


def _leaking(estimate: Estimate, time: Array) -> str:
    """Return the command that lets a plant leak which is known to integrate; empty if it does not leak."""
    if no_leak(estimate) or not (denominator := leaking(estimate.search.records.kind.model)):
        return ""
    rate = _LEAK / float(np.median(np.diff(time)))
    return (
        f"{_AGAIN}--set plant.parameters.leak={rate:.1g} "
        f'--set "plant.continuous.denominator={denominator}"  # it may leak'
    )


def _drifts(estimate: Estimate) -> bool:
    """Return whether the noise of the model drifts already."""
    model = estimate.search.records.kind.model
    return not model.continuous and cast(SampledPlant, model).integrates


def _may_drift(first: Finding, data: Record) -> bool:
    """Return whether a drift along a line may explain a finding."""
    rows = first.figures.get("rows")
    if first.code == "level-shift" and isinstance(rows, list):
        return any(last - begin > _WIDE * len(data.y) for begin, last in rows)
    return _ORDER.index(first.code) > _ORDER.index("level-shift") if first.code in _ORDER else True
