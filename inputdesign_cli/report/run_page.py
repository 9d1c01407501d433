"""The content of the page about a run."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.run_directory import read_outcome, read_run
from inputdesign_cli.outcome.run_files import readable
from inputdesign_cli.outcome.sentences import shown
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.charts import Chart, run_charts
from inputdesign_cli.report.facts import (
    Fact,
    answer,
    estimate_table,
    facts,
    provenance,
    requirement_table,
    said,
    simulation_table,
)
from inputdesign_cli.report.question import Question, read_question
from inputdesign_cli.report.sources import Source, citations

# Headings and the charts that belong under them; charts of data and of simulated runs have their own.
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


def run_page(run: Path, *, pictures: bool = True) -> dict[str, object]:
    """Return the content of the template for a run, with pictures or not.

    Args:
        run: its directory.
        pictures: whether they are drawn.

    Raises:
        DataError: as `read_run`, and `run-unreadable` where an entry is not what idesign writes.
    """
    result = read_run(run)
    outcome = read_outcome(run, result)
    verb = _verb(outcome)
    question, text = _asked(run, verb)
    charts = run_charts(run, question.time_unit) if pictures else {}
    top_up = None if outcome.assessment is None else outcome.assessment.top_up_status
    made_from, environment = (outcome.provenance.get(name) for name in ("made_from", "environment"))
    sources = [Path(str(name)).name for name in made_from] if isinstance(made_from, list) else []
    return {
        **_figures(charts, [f"{text[0].upper()}{text[1:]}." for text in said("proofs", outcome)]),
        "title": question.title or run.resolve().name,
        "question": question.sentences,
        "answer": answer(verb, outcome),
        "notes": outcome.notes or (),
        "estimate": estimate_table(outcome),
        "estimate_facts": facts(outcome, part="estimate"),
        "verdicts": requirement_table(outcome, question.time_unit),
        "facts": [
            Fact("status", top_up or outcome.status or ""),
            *facts(outcome, part="campaign_stands"),
            *facts(outcome, question.time_unit),
            Fact("units", question.units),
        ],
        "simulation": simulation_table(outcome.simulation),
        "simulated_runs": None if outcome.simulation is None else outcome.simulation.runs,
        "assumptions": said("assumptions", outcome, question=question),
        "command": command_of(verb, outcome, sources),
        "explored": outcome.exploration is not None,
        "campaign": verb == "campaign",
        "files": sources[1:],
        "spec": text,
        "provenance": provenance(
            environment if isinstance(environment, Mapping) else {},
            [
                Fact("SHA-256 of spec.yaml", str(outcome.provenance.get("spec_sha256", ""))),
                Fact("seed of the signal", str(question.seed)),
            ],
        ),
        "citations": citations(question, outcome),
        "numbers": flat({key: value for key, value in result.items() if key not in _NOT_NUMBERS}),
    }


def _figures(charts: Mapping[str, Chart], proved: Sequence[str]) -> dict[str, object]:
    """Return the charts, and the names of the charts in each part of the page."""
    data = [name for name in _OF_DATA if name in charts]
    runs = [name for name in charts if name.startswith(_OF_RUNS)]
    placed = {*data, *runs, *(name for _, names in _SECTIONS for name in names)}
    sections = [(heading, [n for n in names if n in charts]) for heading, names in _SECTIONS]
    sections.append(("Further figures", [name for name in charts if name not in placed]))
    shown = [(h, names) for h, names in sections if names or (h == "The certificate" and proved)]
    return {"charts": charts, "data_figures": data, "sections": shown, "run_charts": runs, "proofs": proved}


def run_sources(run: Path) -> list[Source]:
    """Return the sources of the methods that a run used.

    Raises:
        DataError: as `run_page`.
    """
    outcome = read_outcome(run)
    return citations(_asked(run, _verb(outcome))[0], outcome)


def _asked(run: Path, verb: str) -> tuple[Question, str]:
    """Return the question of a run, and the text of its spec."""
    file = run / "spec.yaml"
    with readable(file):
        text = read_regular(file).decode()
    try:
        return read_question(text, str(file), verb), text
    except SpecError as error:
        first = error.diagnostics[0]
        message = f"{file} was changed, or is of another version: {first.message}"
        hint = "undo the change, or give the command of the run again with --overwrite"
        raise DataError.because("run-unreadable", message, hint, first.key, first.location) from error


def _verb(outcome: Outcome) -> str:
    found = {
        "campaign": outcome.campaign,
        "assess": outcome.assessment,
        "identify": outcome.identification,
        "simulate": outcome.simulation,
        "solve": outcome.objective,
    }
    return next((verb for verb, part in found.items() if part is not None), "analyse")


def command_of(verb: str, outcome: Outcome, sources: Sequence[str]) -> str:
    """Return the command that repeats the run, with its data and the levels removed from them."""
    if outcome.exploration is not None:
        columns = ",".join(f"{role}={column}" for role, column in outcome.exploration.channels.items())
        asked = [one for one in sources if one.endswith((".yaml", ".yml"))]
        logs = [one for one in sources if one not in asked] or ["DATA"]
        options = [part for one in asked for part in ("--spec", one)] + ["--columns", columns] * bool(columns)
        return shlex.join(["idesign", "explore", *logs, *options])
    found = outcome.identification
    if verb not in ("assess", "identify") or found is None:
        return f"idesign {verb} spec.yaml"
    data = sources[1:] or ["DATA"]
    words = [verb, "spec.yaml", *data] if verb == "assess" else [verb, *data, "--spec", "spec.yaml"]
    if verb == "identify" and found.theta is None:
        words.append("--frequency-response")
    if found.means_removed:
        words.append("--remove-means")
    elif found.operating_point:
        levels = [f"{name}={level!r}" for name, level in found.operating_point.items()]
        words += ["--operating-point", ",".join(levels)]
    return shlex.join(["idesign", *words])


def flat(value: object, path: str = "") -> list[tuple[str, str]]:
    """Return every entry of a result by its path; for a long list, only its length."""
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
