"""Data -> does the real experiment meet the target, and if not, what is still to be done."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Curves, Json, Results, Table
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.identification import (
    Identification,
    ModelQuestion,
    identification_results,
    identified,
)
from inputdesign_cli.tasks.result.design import requirement_entry
from inputdesign_cli.tasks.result.estimates import identification_entry

_ROUNDING = 1e-9
Part = TypeVar("Part", Table, Curves)


@dataclass(frozen=True)
class Assessment:
    """Whether the data meet what the spec asks for; the results of the identification or of the top-up."""

    met: bool
    results: Results


def assess(task: Identification, path: Path, *, remove_means: bool = False) -> Assessment:
    """Identify the model from a real experiment and compare what the data buy with what is asked.

    Both sides are evaluated at the new estimate: r_u by the information of the data themselves (and of
    `experiment.prior`), r_adm by the new model. Where it falls short, the experiment that makes up for it
    is designed as `solve` does, with the data as prior information.

    Raises:
        SpecError: nothing is asked that data could meet; see `identify` and `solve`.
        DataError: the file cannot be used.
        InfeasibleError, InaccurateError: of the top-up.
    """
    if not task.assessable:
        raise bad_spec(
            "nothing-to-assess",
            "the spec states no accuracy that data could meet or miss",
            hint="state one, such as accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )
    started = time.perf_counter()
    found = identified(task, path, remove_means=remove_means)
    question = found.question
    information = found.estimate.information + question.experiment.prior_information
    met, listed = _evaluated(task.header.units, question, information)
    assessment: dict[str, Json] = {"met": met, "requirements": listed}
    identification = identification_results(task, found, started)
    if met or question.top_up is None:
        status = {"status": "met" if met else "missed", "assessment": assessment}
        return Assessment(met, replace(identification, result={**identification.result, **status}))
    topped = question.top_up(information)
    notes = [*topped.result.get("notes", []), *identification.result.get("notes", [])]
    result = {
        **topped.result,
        "title": task.header.title,
        "status": "missed",
        "identification": identification_entry(found.estimate),
        "assessment": {**assessment, "top_up_status": topped.result["status"]},
        "notes": notes,
    }
    return Assessment(
        False,
        replace(
            topped,
            result=result,
            tables={**topped.tables, **_of_data(identification.tables)},
            curves={**topped.curves, **_of_data(identification.curves)},
            files={**topped.files, **identification.files},
        ),
    )


def _of_data(parts: Mapping[str, Part]) -> dict[str, Part]:
    return {f"data_{name}": part for name, part in parts.items()}


def _evaluated(
    units: Units, question: ModelQuestion, information: Array
) -> tuple[bool, list[dict[str, Json]]]:
    """Whether the information of the data meets what is asked, and each requirement with its worst ratio."""
    listed = [requirement_entry(units, r, information) for r in question.requirements]
    return all(entry["worst_ratio"] <= 1.0 + _ROUNDING for entry in listed), listed
