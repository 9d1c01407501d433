"""What the page about a run says."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from inputdesign_cli.compute.executor import Executor, InProcess
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.outcome.record import RESULT, unreadable
from inputdesign_cli.outcome.results import Json, Result
from inputdesign_cli.outcome.run_directory import read_run
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.charts import run_charts
from inputdesign_cli.report.evidence import (
    campaign_answer,
    campaign_facts,
    estimate_answer,
    estimate_facts,
    estimate_table,
    requirement_table,
    simulation_answer,
    simulation_table,
)
from inputdesign_cli.report.facts import facts, proofs, white
from inputdesign_cli.report.followed import Trail
from inputdesign_cli.report.numbers import provenance, shown
from inputdesign_cli.report.question import read_question
from inputdesign_cli.report.sources import assumptions, citations

# Headings and the charts that belong under them; those of data and of simulated runs have their own.
_SECTIONS = (
    ("Accuracy", ("bound", "deviations", "fan")),
    ("The loop", ("nyquist",)),
    ("Spectrum", ("spectrum",)),
    ("Signal", ("signal",)),
    ("The certificate", ("optimality",)),
)
_OF_DATA = ("data_fit", "fit", "data_residuals", "residuals", "data_bound", "frequency_response")
_OF_RUNS = ("errors_", "cloud_", "disturbance_")
_NOT_NUMBERS = frozenset(
    {"format", "title", "files", "environment", "spec_sha256", "asked_sha256", "made_from"}
)
_MOST_ENTRIES = 16
# What these fields of a result are, where it has them: somebody else may have written it.
_FIELDS = {
    str: (("title", "status"), "a text"),
    list: (("requirements", "limits", "notes", "made_from"), "a list"),
    dict: (
        (
            "objective",
            "power",
            "model_error",
            "information",
            "baseline",
            "signal",
            "solver",
            "timing_s",
            "environment",
            "identification",
            "assessment",
            "simulation",
            "robust",
            "moments",
            "mean_squared_error",
        ),
        "a mapping",
    ),
}


def run_page(
    run: Path, trail: Trail, *, pictures: bool = True, painters: Executor | None = None
) -> dict[str, Json]:
    """The content of the template for a run, with pictures or not. Raises `DataError` as `read_run` does.

    Args:
        painters: draw the pictures (default: this process).
    """
    result = trail.follow(read_run(run))
    _check_fields(run, result)
    verb = _verb(result)
    text = read_regular(run / "spec.yaml").decode()
    try:
        question = read_question(text, str(run / "spec.yaml"), verb)
    except SpecError as error:
        message = f"{run / 'spec.yaml'} is no spec of this version: {error}"
        raise DataError.because("run-unreadable", message, hint="run the spec again") from error
    charts = run_charts(run, result, question.time_unit, painters or InProcess()) if pictures else {}
    data = [name for name in _OF_DATA if name in charts]
    runs = [name for name in charts if name.startswith(_OF_RUNS)]
    placed = {*data, *runs, *(name for _, names in _SECTIONS for name in names)}
    sections = [(heading, [n for n in names if n in charts]) for heading, names in _SECTIONS]
    sections.append(("Further figures", [name for name in charts if name not in placed]))
    proved = [f"{text[0].upper()}{text[1:]}." for text in proofs(result)]
    shown = [(h, names) for h, names in sections if names or (h == "The certificate" and proved)]
    estimated, simulated = estimate_table(result), simulation_table(result)
    cited, assumed = citations(question, result), assumptions(question, result)
    status = str(result.get("assessment", {}).get("top_up_status") or result.get("status", ""))
    return {
        "title": question.title or run.resolve().name,
        "contents": [
            "The question",
            "The answer",
            *(["The data"] if estimated or data else []),
            *(heading for heading, _ in shown),
            *(["What was assumed"] if assumed else []),
            *(["Simulation"] if simulated or runs else []),
            "How to reproduce it",
            *(["Methods"] if cited else []),
            "All numbers",
        ],
        "question": question.sentences,
        "answer": " ".join([_answer(verb, result), *simulation_answer(result)]),
        "notes": result.get("notes", []),
        "estimate": estimated,
        "estimate_facts": list(estimate_facts(result)),
        "verdicts": requirement_table(result, question.time_unit),
        "data_figures": data,
        "facts": [
            ("status", status, ""),
            *((name, text, "") for name, text in campaign_facts(result)),
            *facts(result, question.time_unit),
            ("units", question.units, ""),
        ],
        "charts": charts,
        "sections": shown,
        "proofs": proved,
        "simulation": simulated,
        "simulated_runs": result.get("simulation", {}).get("runs"),
        "run_charts": runs,
        "assumptions": assumed,
        "command": _command(verb, result),
        "explored": "exploration" in result,
        "campaign": verb == "campaign",
        "files": _data_files(result),
        "spec": text,
        "provenance": provenance(
            result.get("environment", {}),
            [
                ("SHA-256 of spec.yaml", str(result.get("spec_sha256", "")), ""),
                ("seed of the signal", str(question.seed), ""),
            ],
        ),
        "citations": cited,
        "numbers": flat({key: value for key, value in result.items() if key not in _NOT_NUMBERS}),
    }


def _check_fields(run: Path, result: Result) -> None:
    """Raise `DataError` (`run-unreadable`) that names the first field which is missing or not of its kind."""
    if "spec_sha256" not in result:  # every run has it, of whatever kind
        raise unreadable(run / RESULT, 'it has no "spec_sha256"')
    for kind, (names, called) in _FIELDS.items():
        for name in names:
            if not isinstance(result.get(name, kind()), kind):
                raise unreadable(run / RESULT, f'"{name}" is not {called}')


def _verb(result: Result) -> str:
    if "campaign" in result:
        return "campaign"
    if "assessment" in result:
        return "assess"
    if "identification" in result:
        return "identify"
    if result.get("simulation"):
        return "simulate"
    return "solve" if "objective" in result else "analyse"


def _data_files(result: Result) -> list[str]:
    """The names of the records that the run was made from."""
    return [Path(str(name)).name for name in result.get("made_from", [])[1:]]


def _command(verb: str, result: Result) -> str:
    """What makes the run again, with the names of the data and what was taken away from them."""
    if "exploration" in result:
        names = [Path(str(name)).name for name in result.get("made_from", [])] or ["DATA"]
        found = result["exploration"]
        columns = ",".join(f"{role}={column}" for role, column in found.get("channels", {}).items())
        return shlex.join(["idesign", "explore", *names, *(["--columns", columns] if columns else [])])
    if verb not in ("assess", "identify"):
        return f"idesign {verb} spec.yaml"
    data, found = _data_files(result) or ["DATA"], result["identification"]
    words = [verb, "spec.yaml", *data] if verb == "assess" else [verb, *data, "--spec", "spec.yaml"]
    if verb == "identify" and "theta" not in found:
        words.append("--frequency-response")
    if found.get("means_removed"):
        words.append("--remove-means")
    elif found.get("operating_point"):
        levels = [f"{name}={float(level)!r}" for name, level in found["operating_point"].items()]
        words += ["--operating-point", ",".join(levels)]
    return shlex.join(["idesign", *words])


def _answer(verb: str, result: Result) -> str:
    if verb == "campaign":
        return campaign_answer(result)
    if "identification" in result:
        return estimate_answer(result)
    found = result.get("objective", {})
    kind, value = found.get("kind", ""), found.get("value")
    if value is None:
        ratio = result.get("model_error", {}).get("worst_ratio")
        if ratio is None:
            return "The numbers are below."
        verdict = "within" if ratio <= 1 else "beyond"
        return f"The error of the model stays {verdict} what is admitted: r_u / r_adm is at most {ratio:.5g}."
    sentence = objective(kind).answer
    if kind == "shortest_experiment":
        said = f"{sentence.format(result['samples'])} (as a real number {value:.6g})"
    else:
        said = sentence.format(f"{value:.6g}")
    compared = white(result)
    return f"{said} ({compared})." if compared else f"{said}."


def flat(value: Json, path: str = "") -> list[tuple[str, str]]:
    """Every entry of a result by its path; of a long list its length only."""
    if isinstance(value, Mapping):
        if set(value) == {"re", "im"}:
            return [(path, f"{shown(value['re'])} {value['im']:+.7g}i")]
        return [row for key, item in value.items() for row in flat(item, f"{path}.{key}" if path else key)]
    if isinstance(value, list):
        if all(isinstance(item, int | float) for item in value):
            return [(path, ", ".join(map(shown, value)) if len(value) <= 4 else f"{len(value)} numbers")]
        if len(value) > _MOST_ENTRIES:
            return [(path, f"{len(value)} entries")]
        return [row for i, item in enumerate(value) for row in flat(item, f"{path}[{i}]")]
    return [] if value is None else [(path, shown(value))]
