"""Spec and data -> does the real experiment meet the target, and if not, what is still to be done."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from inputdesign_cli.accuracy import EntryOfPlant, worst_violation
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.channel_design import solve_channels
from inputdesign_cli.tasks.channel_identification import ChannelIdentified
from inputdesign_cli.tasks.design import solve_convex
from inputdesign_cli.tasks.identification import Identified, identified

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Assessment:
    """Whether the data meet what the spec asks for; the outcome of the identification or of the top-up."""

    met: bool
    outcome: Results


def assess(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Assessment:
    """Identify the model from a real experiment and compare what the data buy with what is asked.

    Both sides are evaluated at the new estimate: r_u by the information of the data themselves (and of
    `experiment.prior`), r_adm by the new model. Where it falls short, the experiment that makes up for it
    is designed as `solve` does, with the data as prior information.

    Raises:
        SpecError: nothing is asked that data could meet; see `identify` and `solve`.
        DataError: the file cannot be used.
        InfeasibleError, InaccurateError: of the top-up.
    """
    try:
        return _assess(spec, Path(data), remove_means)
    except IdesignError as error:
        raise spec.place(error) from error


def _assess(spec: Spec, path: Path, remove_means: bool) -> Assessment:
    if not spec.accuracy.requirements:
        raise spec.complain(
            "nothing-to-assess",
            "the spec states no accuracy that data could meet or miss",
            hint="state one, such as accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )
    started = time.perf_counter()
    found = identified(spec, path, remove_means=remove_means)
    information = found.estimate.information + found.experiment.prior_information
    met, listed = _requirements(found, information)
    identification = found.outcome(spec, started)
    if met or not spec.designs:
        verdict = {"met": met, "requirements": listed}
        result = {**identification.result, "status": "met" if met else "missed", "assessment": verdict}
        return Assessment(met, replace(identification, result=result))
    topped = _top_up(found, information)
    result = {
        **topped.result,
        "title": spec.title,
        "status": "missed",
        "identification": found.entry,
        "assessment": {"met": False, "requirements": listed, "top_up_status": topped.result["status"]},
        "notes": [*topped.result.get("notes", []), *found.notes],
    }
    tables = {**topped.tables, **{f"data_{k}": t for k, t in identification.tables.items()}}
    curves = {**topped.curves, **{f"data_{k}": c for k, c in identification.curves.items()}}
    return Assessment(
        False,
        replace(
            topped,
            result=result,
            tables=tables,
            curves=curves,
            files={**topped.files, **identification.files},
        ),
    )


def _requirements(
    found: Identified | ChannelIdentified, information: Array
) -> tuple[bool, list[dict[str, Any]]]:
    """Whether the information of the data meets what is asked, and each requirement with its worst ratio."""
    listed: list[dict[str, Any]] = []
    for make in found.requirements():
        requirement = make(found.experiment)
        violation = worst_violation(requirement, information)
        entry: dict[str, Any] = {"name": requirement.name, "worst_ratio": violation.ratio}
        if violation.frequency is not None:
            entry["frequency"] = violation.frequency / found.frequency_unit
        if isinstance(requirement, EntryOfPlant):
            entry["entry"] = requirement.label
        listed.append(entry)
    return all(entry["worst_ratio"] <= 1.0 + _ROUNDING for entry in listed), listed


def _top_up(found: Identified | ChannelIdentified, information: Array) -> Results:
    """The design on the new estimate with the data as prior information."""
    prior = {
        "parameters": list(found.estimate.names),
        "information": (0.5 * (information + information.T)).tolist(),
    }
    spec = parse_spec(
        found.spec.to_yaml(),
        file="top-up",
        overrides=[f"experiment.prior={json.dumps(prior)}"],
        folder=found.spec.resolve_path("."),
    )
    return solve_channels(spec) if has_channels(spec) else solve_convex(spec)
