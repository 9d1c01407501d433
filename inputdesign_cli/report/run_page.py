"""What the page about a run says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from inputdesign_cli.errors import DataError, Diagnostic, SpecError
from inputdesign_cli.report.charts import run_charts
from inputdesign_cli.report.evidence import (
    estimate_answer,
    estimate_facts,
    estimate_table,
    requirement_table,
    simulation_table,
)
from inputdesign_cli.report.numbers import Fact, listed, provenance, shown
from inputdesign_cli.report.question import read_question
from inputdesign_cli.report.sources import assumptions, citations
from inputdesign_cli.runs.objectives import objective
from inputdesign_cli.runs.results import Json, Result
from inputdesign_cli.runs.run_directory import read_run

# Headings and the charts that belong under them; those of data and of simulated runs have their own.
_SECTIONS = (
    ("Accuracy", ("bound",)),
    ("Spectrum", ("spectrum",)),
    ("Signal", ("signal",)),
    ("The certificate", ("optimality",)),
)
_OF_DATA = ("data_fit", "fit", "data_residuals", "residuals", "data_bound")
_OF_RUNS = ("errors_", "cloud_", "disturbance_")
_NOT_NUMBERS = frozenset({"format", "title", "files", "environment", "spec_sha256"})
_MOST_ENTRIES = 16
_COMMANDS = {
    "assess": "idesign assess spec.yaml DATA",
    "identify": "idesign identify DATA --spec spec.yaml",
    **{verb: f"idesign {verb} spec.yaml" for verb in ("simulate", "solve", "analyse")},
}


def run_page(run: Path) -> dict[str, Json]:
    """The content of the template for a run. Raises `DataError` as `read_run` does."""
    result = read_run(run)
    verb = _verb(result)
    text = (run / "spec.yaml").read_text(encoding="utf-8")
    try:
        question = read_question(text, str(run / "spec.yaml"), verb)
    except SpecError as error:
        message = f"{run / 'spec.yaml'} is no spec of this version: {error}"
        raise DataError(Diagnostic("run-unreadable", message, hint="run the spec again")) from error
    charts = run_charts(run, result, question.time_unit, closed_loop=question.closed_loop)
    data = [name for name in _OF_DATA if name in charts]
    runs = [name for name in charts if name.startswith(_OF_RUNS)]
    placed = {*data, *runs, *(name for _, names in _SECTIONS for name in names)}
    sections = [(heading, [n for n in names if n in charts]) for heading, names in _SECTIONS]
    sections.append(("Further figures", [name for name in charts if name not in placed]))
    proofs = _proofs(result)
    return {
        "title": question.title or run.resolve().name,
        "question": question.sentences,
        "answer": estimate_answer(result) if "identification" in result else _answer(result),
        "notes": result.get("notes", []),
        "estimate": estimate_table(result),
        "estimate_facts": list(estimate_facts(result)),
        "verdicts": requirement_table(result, question.time_unit),
        "data_charts": data,
        "facts": list(_facts(result, question.time_unit)),
        "charts": charts,
        "sections": [(h, names) for h, names in sections if names or (h == "The certificate" and proofs)],
        "proofs": proofs,
        "simulation": simulation_table(result),
        "simulated_runs": result.get("simulation", {}).get("runs"),
        "run_charts": runs,
        "assumptions": assumptions(question, result),
        "command": _COMMANDS[verb],
        "files": [],
        "spec": text,
        "provenance": provenance(
            result.get("environment", {}),
            [
                ("SHA-256 of spec.yaml", str(result.get("spec_sha256", "")), ""),
                ("seed of the signal", str(question.seed), ""),
            ],
        ),
        "citations": citations(question, result),
        "numbers": flat({key: value for key, value in result.items() if key not in _NOT_NUMBERS}),
    }


def _verb(result: Result) -> str:
    if "assessment" in result:
        return "assess"
    if "identification" in result:
        return "identify"
    if result.get("simulation"):
        return "simulate"
    return "solve" if "objective" in result else "analyse"


def _answer(result: Result) -> str:
    found = result.get("objective", {})
    value, kind = found.get("value"), found.get("kind", "")
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
    white = result.get("baseline", {}).get("white", {})
    if kind == "least_cost" and {"ratio", "cost"} <= set(white) and white["cost"]:
        said += f"; white excitation of the same accuracy costs {white['cost']:.6g}, "
        said += f"{white['ratio']:.3g} times as much"
    elif kind == "shortest_experiment" and "samples" in white:
        said += f"; white excitation within the same limits needs {white['samples']}"
    elif "mean_squared_error" in white:
        said += f"; white regressors of the same energy reach {white['mean_squared_error']:.6g}"
    elif "value" in white:
        said += f"; white excitation within the same limits reaches {white['value']:.6g}"
    return said + "."


def _facts(result: Result, time_unit: str) -> Iterator[Fact]:
    found = result.get("objective", {})
    if "value" in found:
        yield (
            objective(found.get("kind")).name,
            shown(found["value"]),
            str(result.get("assessment", {}).get("top_up_status") or result.get("status", "")),
        )
    if found.get("kind") != "least_cost" and "cost" in result:
        yield "cost", shown(result["cost"]), ""
    for kind, values in result.get("power", {}).items():
        yield f"{kind} power", listed(values), ""
    error = result.get("model_error", {})
    if "worst_ratio" in error:
        where = f"at {error['worst_frequency']:.4g} rad/{time_unit}" if "worst_frequency" in error else ""
        yield "r_u / r_adm at most", shown(error["worst_ratio"]), where
    signal = result.get("signal", {})
    if "samples" in signal:
        parts = [f"{signal['samples']} samples"]
        for key, name in (("power", "power"), ("peak", "peak"), ("crest_factor", "crest factor")):
            if signal.get(key):
                parts.append(f"{name} {listed(signal[key], digits=4)}")
        ratio = signal.get("worst_ratio")
        note = f"r_u / r_adm at most {ratio:.4g} with these very samples" if ratio is not None else ""
        yield "signal", ", ".join(parts), note


def _proofs(result: Result) -> list[str]:
    found = result.get("objective", {})
    proofs = []
    moments = "moments" in result
    family = "moments of this structure get" if moments else "spectrum of this family gets"
    for key, side in (("lower_bound", "below"), ("upper_bound", "above")):
        if key in found:
            gap = f" (gap {found['relative_gap']:.1e})" if "relative_gap" in found else ""
            proofs.append(f"No {family} {side} {found[key]:.8g}{gap}.")
    if "any_spectrum_bound" in found:
        side = "above" if objective(found.get("kind")).maximised else "below"
        proofs.append(f"No spectrum whatever gets {side} {found['any_spectrum_bound']:.8g}.")
    if "any_structure_bound" in found:
        proofs.append(f"No moments whatever get below {found['any_structure_bound']:.8g}.")
    return proofs


def flat(value: Json, path: str = "") -> list[tuple[str, str]]:
    """Every entry of a result by its path; of a long list its length only."""
    if isinstance(value, Mapping):
        if set(value) == {"re", "im"}:
            return [(path, f"{shown(value['re'])} {value['im']:+.7g}i")]
        return [row for key, item in value.items() for row in flat(item, f"{path}.{key}" if path else key)]
    if isinstance(value, list):
        if all(isinstance(item, int | float) for item in value):
            return [(path, listed(value) if len(value) <= 4 else f"{len(value)} numbers")]
        if len(value) > _MOST_ENTRIES:
            return [(path, f"{len(value)} entries")]
        return [row for i, item in enumerate(value) for row in flat(item, f"{path}[{i}]")]
    return [] if value is None else [(path, shown(value))]
