"""Data -> does the real experiment meet the target, and if not, what is still to be done.

A verdict holds for one estimate and its information: that of the given records together, and of the prior
where the spec states the estimate that it belongs to. A prior without it counts for designs only.
"""

from __future__ import annotations

import bisect
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

from inputdesign_cli.accuracy import model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.identification import frequency_response, response_delays
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Json, Results, Table, typed
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.assessment.faults import faults
from inputdesign_cli.questions.assessment.identify import (
    Identification,
    Identified,
    ModelQuestion,
    identification_results,
    identified,
    speaking_against,
    told,
)
from inputdesign_cli.questions.assessment.levels import level_notes
from inputdesign_cli.questions.assessment.neglected import Neglected, neglected, objections, unseen
from inputdesign_cli.questions.assessment.nominal import from_nominal, of_first_part
from inputdesign_cli.questions.assessment.refutations import contradictions, differences, unsettled
from inputdesign_cli.questions.assessment.responses import response_note, response_of_data
from inputdesign_cli.questions.common.rivals import beyond_admissible, beyond_errors, rival_notes
from inputdesign_cli.questions.least_cost.outcome import requirement_entry
from inputdesign_cli.tasks.build.preparation import Preparation

_ROUNDING = 1e-9
# What a record that is rounded to a file may be off.
_REACHED = 1e-6
_MOST_EXPERIMENTS = 10**9
_PRIOR_LEFT_OUT = (
    "experiment.prior does not count for the experiment below either, since no verdict after it could rest "
    "on that: spec.yaml has the information of the data in its place"
)
Part = TypeVar("Part", Table, Curves)
Verdict = Literal["met", "missed", "undecided"]


@dataclass(frozen=True)
class Assessment:
    """Whether the data meet what the spec asks for; the results of the identification or of the top-up."""

    verdict: Verdict
    results: Results

    @property
    def met(self) -> bool:
        """Whether the data meet it."""
        return self.verdict == "met"


def assess(task: Identification, paths: Sequence[Path], preparation: Preparation) -> Assessment:
    """Identify the model from real experiments and compare what the data buy with what is asked.

    Both sides are evaluated at the new estimate: r_u by the information of the data themselves, r_adm by the
    new model. Where tests refute the structure, or the question cannot be asked of the estimate, nothing is
    decided. Where the data fall short, the experiment that this model still needs is designed as `solve`
    does, with the data as prior information; where there is none, the result says why.

    Raises:
        SpecError: nothing is asked that data could meet.
        DataError: a file cannot be used.
    """
    check_assessable(task)
    started = time.perf_counter()
    found = identified(task, paths, preparation)
    assessment = judge(task, found, started)
    if assessment.verdict != "missed" or found.question is None or found.question.top_up is None:
        return assessment
    try:
        topped = found.question.top_up(found.preparation.levels)
    except IdesignError as error:
        return replace(assessment, results=_without_top_up(assessment.results, told(error)))
    needed = partial(_experiments, found.question)
    topped = _with_notes(topped, _remarks(task, found, topped))
    return Assessment(assessment.verdict, _topped_up(assessment.results, topped, needed))


def check_assessable(task: Identification) -> None:
    """Raise `SpecError` (`nothing-to-assess`) where no accuracy is asked for."""
    if not task.assessable:
        raise bad_spec(
            "nothing-to-assess",
            "the spec states no accuracy that data could meet or miss",
            hint="state one, such as accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )


def judge(
    task: Identification, found: Identified, started: float, *, first: bool | None = None
) -> Assessment:
    """What an estimate and its data say of what is asked, without a top-up.

    Args:
        started: `time.perf_counter()` when the work began.
        first: of an experiment in parts, whose plans rest on estimates, whether this is the first one.
    """
    identification = identification_results(task, found, started)
    listed: list[dict[str, Json]] = []
    if found.question is not None:
        units, information = task.header.units, found.question.information
        listed = [requirement_entry(units, r, information) for r in found.question.requirements]
    without: list[Neglected] = []
    if found.question is not None:
        errors = model_errors(found.question.requirements)
        without = neglected(found.model, found.estimate, errors, information)
    met = all(entry["worst_ratio"] <= 1.0 + _ROUNDING for entry in listed)
    broken = bool(faults(task.header.units, found.estimate, found.data))
    notes = [] if broken else objections(task.header.units, without)
    causes = {
        "unsettled": unsettled(found.model, found.estimate),
        "contradicted": [
            *speaking_against(task, found),
            *differences(found.estimate, [name for name, _ in found.data.files]),
            *contradictions(found.estimate),
            *(notes if met else []),  # more parameters miss it all the more
        ],
        "unasked": [found.unasked] if found.unasked else [],
        "undetermined": [] if found.question is None else _rivals(task.header.units, found, found.question),
    }
    reasons = [reason for told_of in causes.values() for reason in told_of]
    verdict: Verdict = "undecided" if reasons else "met" if met else "missed"
    assessment: dict[str, Json] = {"verdict": verdict, "met": verdict == "met", "requirements": listed}
    if reasons:
        assessment["undecided"] = reasons
        assessment["causes"] = [cause for cause, told_of in causes.items() if told_of]
    if without:
        entries = [(one.directed.of_structure, one.entry(task.header.units)) for one in without]
        assessment["neglected"] = [entry for of_structure, entry in entries if of_structure]
        assessment["variations"] = [entry for of_structure, entry in entries if not of_structure]
    if found.question is not None:
        assessment["nominal"], told_apart = _from_nominal(task, found, found.question)
        if first is not None and told_apart:
            told_apart = of_first_part(assessment["nominal"]) if first else []
        notes += [] if broken else told_apart
    if verdict == "met":
        notes += unseen(task.header.units, without)
    judged = _with_notes(_judged(identification, verdict, assessment), notes)
    if verdict == "undecided":
        judged = _without_model(judged, task.header.units, found)
    return Assessment(verdict, judged)


def _without_top_up(judged: Results, why: str) -> Results:
    was = judged.result
    return replace(judged, outcome=typed({**was, "assessment": {**was["assessment"], "no_top_up": why}}))


def _rivals(units: Units, found: Identified, question: ModelQuestion) -> list[str]:
    """The other explanations of the data that the verdict would not hold for."""
    errors, model, estimate = model_errors(question.requirements), found.model, found.estimate
    apart = (
        beyond_admissible(model, estimate, errors)
        if errors
        else beyond_errors(model, estimate, question.entries, question.information)
    )
    return rival_notes(units, estimate, apart)


def _remarks(task: Identification, found: Identified, topped: Results) -> list[str]:
    """What is to be known of a top-up: about what its record varies, and what it does not count on."""
    notes = []
    if "signal" in topped.tables and not task.header.units.closed_loop:
        point, levels = topped.result["signal"].get("operating_point"), found.preparation.levels
        notes += level_notes(levels, point, found.data.means, found.data.u.std(axis=0))
    if task.has_prior and found.estimate.agreement is None:
        notes.append(_PRIOR_LEFT_OUT)
    return notes


def _judged(identification: Results, verdict: Verdict, assessment: dict[str, Json]) -> Results:
    """The results of the identification with the verdict."""
    return replace(
        identification, outcome=typed({**identification.result, "status": verdict, "assessment": assessment})
    )


def _without_model(judged: Results, units: Units, found: Identified) -> Results:
    """The results with the frequency response of the data alone beside the model, where it can be had."""
    data = found.data
    delays = partial(response_delays, found.model, step=units.step)
    response = frequency_response(data.u, data.y, data.r, lengths=data.lengths, delays=delays)
    if response is None:
        return judged
    table, curves, told = response_of_data(units, found.model, response, by_reference=data.r is not None)
    assessment = {**judged.result["assessment"], "frequency_response": told}
    shown = replace(
        judged,
        outcome=typed({**judged.result, "assessment": assessment}),
        tables={**judged.tables, "frequency_response": table},
        curves={**judged.curves, "frequency_response": curves},
    )
    return _with_notes(shown, response_note(told))


def _from_nominal(
    task: Identification, found: Identified, question: ModelQuestion
) -> tuple[dict[str, Json], list[str]]:
    """How far the estimate is from the plant of the spec, and a note where that is far."""
    asked = model_errors(question.requirements)
    information, estimate = question.information, found.estimate
    told, notes = from_nominal(
        task.header.units,
        task.nominal,
        found.model,
        estimate,
        asked or question.entries,
        information,
        asked=bool(asked),
    )
    if task.foreseen is None or not task.foreseen(estimate.theta, estimate.covariance):
        return told, notes
    return told | {"within_uncertainty": True}, []


def _with_notes(results: Results, notes: Sequence[str]) -> Results:
    """The same with further notes."""
    if not notes:
        return results
    return replace(
        results, outcome=typed({**results.result, "notes": [*results.result.get("notes", []), *notes]})
    )


def _experiments(question: ModelQuestion, both: Array) -> int | None:
    """How many experiments meet all after the data, with whom one has information (k, k); None: too many."""
    data = question.information
    more = question.experiment.whiten_matrix(both) - data

    def enough(times: int) -> bool:
        return all(r.worst(data + times * more).ratio <= 1.0 + _REACHED for r in question.requirements)

    most = 2
    while not enough(most):
        if most >= _MOST_EXPERIMENTS:
            return None
        most *= 2
    return bisect.bisect_left(range(most), True, lo=most // 2, key=enough)


def _topped_up(judged: Results, topped: Results, needed: Callable[[Array], int | None]) -> Results:
    """The top-up, with what was found in the data beside it.

    Args:
        needed: how many such experiments it takes, by the information (k, k) after one of them.
    """
    was, design = judged.result, topped.result
    left = max(
        [entry["worst_ratio"] for entry in design.get("requirements", [])]
        + [design.get("signal", {}).get("worst_ratio", 0.0)]
    )
    more: dict[str, Json] = {"top_up_status": design["status"], "left": left}
    if left > 1.0 + _REACHED:
        more["experiments"] = needed(np.asarray(design["information"]["matrix"]))
    result = {
        **design,
        "title": was["title"],
        "status": "missed",
        "identification": was["identification"],
        "assessment": {**was["assessment"], **more},
        "notes": [*design.get("notes", []), *was.get("notes", [])],
    }
    return replace(
        topped,
        outcome=typed(result),
        tables={**topped.tables, **_of_data(judged.tables)},
        curves={**topped.curves, **_of_data(judged.curves)},
        files={**topped.files, **judged.files},
    )


def _of_data(parts: Mapping[str, Part]) -> dict[str, Part]:
    return {f"data_{name}": part for name, part in parts.items()}
