"""Data -> does the real experiment meet the target, and if not, what is still to be done.

A verdict holds for one estimate: that of the given records together, and the information of these records.
Prior information without the estimate that it belongs to counts for designs only.
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

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Curves, Json, Results, Table
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.tasks.identification import Identification, identification_results, identified, told
from inputdesign_cli.tasks.result.design import requirement_entry
from inputdesign_cli.tasks.result.refutations import refutations, unsettled

_ROUNDING = 1e-9
# What a record that is rounded to a file may be off.
_REACHED = 1e-6
_MOST_EXPERIMENTS = 10**9
_PRIOR = (
    "experiment.prior does not count for this verdict: it is information without the estimate that it "
    "belongs to; give the records of earlier experiments as further files"
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
    decided. Where the data fall short, the experiment that makes up for it is designed as `solve` does, with
    the data as prior information; where there is none, the result says why.

    Raises:
        SpecError: nothing is asked that data could meet.
        DataError: a file cannot be used.
    """
    if not task.assessable:
        raise bad_spec(
            "nothing-to-assess",
            "the spec states no accuracy that data could meet or miss",
            hint="state one, such as accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )
    started = time.perf_counter()
    found = identified(task, paths, preparation)
    identification = identification_results(task, found, started)
    listed: list[dict[str, Json]] = []
    if found.question is not None:
        information, units = found.estimate.information, task.header.units
        listed = [requirement_entry(units, r, information) for r in found.question.requirements]
    reasons = [*unsettled(found.estimate), *refutations(found.model, found.estimate)]
    reasons += [found.unasked] if found.unasked else []
    met = all(entry["worst_ratio"] <= 1.0 + _ROUNDING for entry in listed)
    verdict: Verdict = "undecided" if reasons else "met" if met else "missed"
    assessment: dict[str, Json] = {"met": verdict == "met", "requirements": listed}
    if reasons:
        assessment["undecided"] = reasons
    if task.has_prior:
        identification = _with_note(identification, _PRIOR)
    judged = _judged(identification, verdict, assessment)
    if verdict != "missed" or found.question is None or found.question.top_up is None:
        return Assessment(verdict, judged)
    try:
        topped = found.question.top_up(information)
    except IdesignError as error:
        return Assessment(verdict, _judged(identification, verdict, {**assessment, "no_top_up": told(error)}))
    needed = partial(_experiments, found.question.requirements, information)
    return Assessment(verdict, _topped_up(judged, topped, needed))


def _with_note(results: Results, note: str) -> Results:
    return replace(results, result={**results.result, "notes": [*results.result.get("notes", []), note]})


def _judged(identification: Results, verdict: Verdict, assessment: dict[str, Json]) -> Results:
    """The results of the identification with the verdict."""
    return replace(
        identification, result={**identification.result, "status": verdict, "assessment": assessment}
    )


def _experiments(requirements: Sequence[Requirement], data: Array, both: Array) -> int | None:
    """How many experiments of information both - data (k, k) meet all after the data; None: too many."""

    def enough(times: int) -> bool:
        information = data + times * (both - data)
        return all(r.worst(information).ratio <= 1.0 + _REACHED for r in requirements)

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
        result=result,
        tables={**topped.tables, **_of_data(judged.tables)},
        curves={**topped.curves, **_of_data(judged.curves)},
        files={**topped.files, **judged.files},
    )


def _of_data(parts: Mapping[str, Part]) -> dict[str, Part]:
    return {f"data_{name}": part for name, part in parts.items()}
