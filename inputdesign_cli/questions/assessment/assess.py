"""Data -> does the real experiment meet the target, and if not, what is still to be done.

A verdict holds for one estimate and its information: from all given records, and from the prior if the spec
states an estimate with it. A prior without an estimate counts for designs only.
"""

from __future__ import annotations

import bisect
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.finding import NOTE, Finding, reasons
from inputdesign_cli.findings.designed_records import level_notes
from inputdesign_cli.findings.designs import loop_not_held, near_its_limit
from inputdesign_cli.findings.far_from_nominal import Distance, far_from_nominal, from_nominal
from inputdesign_cli.findings.faults import faults
from inputdesign_cli.findings.frequency_responses import response_note
from inputdesign_cli.findings.leading import following, leading
from inputdesign_cli.findings.neglected import Neglected, neglected, objections, unseen
from inputdesign_cli.outcome import Assessment as Judged, RequirementMet
from inputdesign_cli.outcome.estimate import Verdict
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.assessment.identify import (
    Identification,
    Identified,
    ModelQuestion,
    identification_results,
    identified,
    sentence_of,
)
from inputdesign_cli.questions.assessment.outcome import response_without_model
from inputdesign_cli.questions.common.delivery import adding
from inputdesign_cli.questions.least_cost.outcome import requirement_met
from inputdesign_cli.records import Preparation

_ROUNDING = 1e-9
# Rounding a record to a file raises its ratio by less than this share.
_REACHED = 1e-6
_MOST_EXPERIMENTS = 10**9


@dataclass(frozen=True)
class Assessment:
    """Holds whether the data meet the spec, with the results of the identification or the top-up."""

    verdict: Verdict
    results: Results

    @property
    def met(self) -> bool:
        """Return whether the data meet the accuracy that the spec asks for."""
        return self.verdict == "met"


def assess(task: Identification, paths: Sequence[Path], preparation: Preparation) -> Assessment:
    """Identify the model from real experiments and compare the accuracy of the data with the one asked.

    Both sides are evaluated at the new estimate: r_u by the information of the data themselves, r_adm by the
    new model. Where tests refute the structure, or the question cannot be asked of the estimate, nothing is
    decided. Where the data fall short, the experiment that this model still needs is designed as `solve`
    does. The data are its prior information. Where there is no such experiment, the result says why.

    Raises:
        SpecError: nothing is asked that data could meet.
        DataError: a file cannot be used.
    """
    if not task.assessable:
        raise bad_spec(
            "nothing-to-assess",
            "the spec states no accuracy that data could meet or miss",
            hint="state one, for example accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )
    began = time.perf_counter()
    task, found = identified(task, paths, preparation)
    assessment = judge(task, found, began)
    if assessment.verdict != "missed" or found.question is None or found.question.top_up is None:
        return assessment
    judged = assessment.results
    try:
        topped = found.question.top_up(found.preparation.levels)
    except IdesignError as error:
        return replace(assessment, results=_assessed(judged, no_top_up=sentence_of(error)))
    return replace(assessment, results=_topped_up(task, found, found.question, judged, topped))


def judge(task: Identification, found: Identified, began: float, *, first: bool | None = None) -> Assessment:
    """Compare an estimate and its data with what is asked, without a top-up.

    Args:
        began: `time.perf_counter()` when the work began.
        first: whether a campaign has no earlier estimate; None: the data are of no campaign.
    """
    units, results = task.header.units, identification_results(task, found, began)
    listed, without, distance = _compared(task, found)
    met = all(one.worst_ratio <= 1.0 + _ROUNDING for one in listed)
    more: list[Finding] = []
    if not faults(units, found.estimate, found.data):
        more += objections(units, without, met=met)
        if distance is not None and not distance.nominal.within_uncertainty:
            far = far_from_nominal(distance)
            # Plans of a campaign rest on its estimates, once it has some.
            more += far if first is None else [replace(one, severity=NOTE) for one in far if first]
    findings = [*(results.outcome.findings or ()), *more]
    first_of_all = leading(findings, found.estimate, found.data)
    against = {} if first_of_all is None else reasons(first_of_all.findings)
    verdict: Verdict = "undecided" if against else "met" if met else "missed"
    if verdict != "undecided":
        more += loop_not_held((one.loop for one in listed), task.hold)
    if verdict == "met":
        more += unseen(units, without)
    elif verdict == "missed":
        more += near_its_limit(one.loop for one in listed)
    entries = [(one.directed.of_structure, one.entry(units)) for one in without]
    assessment = Judged(
        verdict=verdict,
        met=verdict == "met",
        requirements=tuple(listed),
        undecided=tuple(one.message for those in against.values() for one in those) or None,
        causes=tuple(against) or None,
        next=None if first_of_all is None else first_of_all.command,
        neglected=tuple(entry for of_structure, entry in entries if of_structure) if entries else None,
        variations=tuple(entry for of_structure, entry in entries if not of_structure) if entries else None,
        nominal=None if distance is None else distance.nominal,
    )
    if first_of_all is not None:
        known = {one.message for one in findings}
        more = [*(one for one in first_of_all.findings if one.message not in known), *more]
    outcome = replace(results.outcome, status=verdict, assessment=assessment).saying(more)
    if first_of_all is not None:
        outcome = outcome.with_findings(following(outcome.findings or (), first_of_all))
    judged = replace(results, outcome=outcome)
    return Assessment(verdict, _without_model(judged, units, found) if against else judged)


def _compared(
    task: Identification, found: Identified
) -> tuple[list[RequirementMet], list[Neglected], Distance | None]:
    """Return each requirement at the estimate, the parameters neglected, and the distance from the spec."""
    question, estimate = found.question, found.estimate
    if question is None:
        return [], [], None
    units, information, factor = task.header.units, question.information, estimate.factor
    listed = [requirement_met(units, one, information) for one in question.requirements]
    without = neglected(found.model, estimate, question.asked, information)
    uncertain = np.linalg.inv(information) + factor.T @ task.nominal_covariance @ factor
    distance = from_nominal(
        units,
        task.nominal,
        found.model,
        estimate,
        question.errors,
        np.asarray(np.linalg.inv(uncertain), dtype=float),
        asked=bool(question.asked),
        nominal_covariance=task.nominal_covariance,
    )
    if task.foreseen is not None:
        missed = task.foreseen.missed(estimate.theta, estimate.covariance)
        if missed is None:
            distance = replace(distance, nominal=replace(distance.nominal, within_uncertainty=True))
        else:
            outside = tuple(f"{estimate.names[k]} {estimate.theta[k]:.4g}" for k in missed)
            distance = replace(distance, outside=outside)
    return listed, without, distance


def _assessed(judged: Results, **more: Any) -> Results:
    """Return results with further fields of their assessment."""
    was = judged.outcome.assessment
    assert was is not None
    return replace(judged, outcome=replace(judged.outcome, assessment=replace(was, **more)))


def _without_model(judged: Results, units: Units, found: Identified) -> Results:
    """Return the results with the response of the data alone beside the model, where it can be estimated."""
    tables, curves, lines = response_without_model(units, found.model, found.data)
    if lines is None:
        return judged
    outcome = _assessed(judged, frequency_response=lines).outcome
    return adding(judged, outcome, response_note(lines), tables, curves)


def _topped_up(
    task: Identification, found: Identified, question: ModelQuestion, judged: Results, topped: Results
) -> Results:
    """Return the top-up, together with the findings on the data."""
    was, signal, remarks = judged.outcome, topped.outcome.signal, list[Finding]()
    if "signal" in topped.tables and signal is not None and not task.header.units.closed_loop:
        levels, data = found.preparation.levels, found.data
        swings = np.abs(data.u - data.u.mean(axis=0)).max(axis=0)
        remarks += level_notes(levels, signal.operating_point, data.means, swings)
    design = topped.outcome.saying(remarks)
    reached = 0.0 if signal is None else signal.worst_ratio or 0.0
    left = max([one.worst_ratio for one in design.requirements or ()] + [reached])
    if topped.outcome.status == "nothing_needed":  # the loop's own noise does it: no spectrum has a ratio
        left = question.ratio(question.experiment.whiten_matrix(topped.information))
    often = _experiments(question, topped.information) if left > 1.0 + _REACHED else None
    completed = _assessed(judged, top_up_status=design.status, left=left, experiments=often)
    outcome = replace(
        design,
        title=was.title,
        status="missed",
        identification=was.identification,
        assessment=completed.outcome.assessment,
    ).saying(was.findings or ())
    return replace(
        topped,
        outcome=outcome,
        tables={**topped.tables, **{f"data_{name}": table for name, table in judged.tables.items()}},
        curves={**topped.curves, **{f"data_{name}": curves for name, curves in judged.curves.items()}},
        files={**topped.files, **judged.files},
    )


def _experiments(question: ModelQuestion, both: Array) -> int | None:
    """Return the number of top-up experiments that the data lack; None: too many.

    The information of the data and one such experiment is `both` (k, k), in raw parameters.
    """
    data, most = question.information, 2
    more = question.experiment.whiten_matrix(both) - data

    def enough(times: int) -> bool:
        return question.ratio(data + times * more) <= 1.0 + _REACHED

    while not enough(most):
        if most >= _MOST_EXPERIMENTS:
            return None
        most *= 2
    return bisect.bisect_left(range(most), True, lo=most // 2, key=enough)
