"""The content of the page about a sweep."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.figures.sweep import bound_of, sweep_figures
from inputdesign_cli.figures.sweep_table import SweepTable, read_sweep
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.design import OBJECTIVES, objective
from inputdesign_cli.outcome.run_directory import read_outcome
from inputdesign_cli.outcome.run_files import readable
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.charts import Chart, chart
from inputdesign_cli.report.facts import provenance
from inputdesign_cli.report.question import Question, read_question
from inputdesign_cli.report.sources import Source, citations
from inputdesign_cli.sweeps.points import checked_run

MOST_ROWS = 200
_SHOWN = (
    ("objective.lower_bound", "lower bound"),
    ("objective.upper_bound", "upper bound"),
    ("objective.any_spectrum_bound", "any spectrum"),
    ("model_error.worst_ratio", "r_u / r_adm"),
    ("time_s", "time (s)"),
)


def sweep_page(root: Path) -> dict[str, object]:
    """Return the content of the template for a sweep.

    Raises:
        DataError: as `read_sweep`; `run-unreadable`, the files of a point are damaged.
    """
    table = read_sweep(root)
    _check_points(table, root)
    summary = table.summary
    with readable(root / "sweep.yaml", "a sweep"):
        spec = read_regular(root / "sweep.yaml").decode()
    columns = [(name, title) for name, title in _columns(table) if any(table.columns.get(name, []))]
    names = [*table.axes, *(name for name, _ in columns)]
    rows = [[_cell(table.columns[name][i]) for name in names] for i in range(min(table.rows, MOST_ROWS))]
    question, first = _first_run(table, root)

    def listed(texts: Sequence[str]) -> str:
        few = len(texts) <= 12
        return ", ".join(texts) if few else f"{', '.join(texts[:3])}, ... {texts[-1]} ({len(texts)} values)"

    cited = citations(question, first) if question else []
    return {
        "title": summary.title or root.resolve().name,
        "question": question.sentences if question else (),
        "zipped": summary.zip,
        "axes": [(axis.key, listed(axis.values), "") for axis in summary.axes],
        "answer": _answer(table),
        "charts": list(_charts(table)),
        "header": [*table.axes, *(title for _, title in columns)],
        "rows": rows,
        "left_out": table.rows - len(rows),
        "failures": [
            (
                ", ".join(f"{key} = {table.columns[key][i]}" for key in table.axes),
                table.columns["code"][i],
                table.columns["reason"][i],
            )
            for i in [i for i, code in enumerate(table.columns["code"]) if code][:MOST_ROWS]
        ],
        "verb": summary.verb,
        "spec": spec,
        "provenance": provenance(summary.environment),
        "citations": cited,
    }


def sweep_sources(root: Path) -> list[Source]:
    """Return the sources of the methods that the first point with a result used.

    Raises:
        DataError: as `read_sweep`.
    """
    question, first = _first_run(read_sweep(root), root)
    return citations(question, first) if question else []


def _check_points(table: SweepTable, root: Path) -> None:
    """Check that runs that are still there belong to the table; runs that were moved away are skipped."""
    for run in filter(None, table.columns["run"]):
        try:
            if (root / run).is_dir():
                checked_run(root / run)
        except DataError as error:
            hint = "give the command of the sweep again: it computes this point anew"
            found = error.diagnostics[0]
            raise DataError.because("run-unreadable", found.message, hint, "", found.location) from None


def _columns(table: SweepTable) -> list[tuple[str, str]]:
    """Return the columns that are shown, by name and title; white excitation has the unit of the value."""
    kind = objective(table.kind)
    value = [("objective.value", kind.name if table.kind else "value")]
    white = [(f"baseline.white.{kind.white}", f"{kind.name} of white")] if table.kind else []
    kinds = [] if table.kind else [("objective.kind", "objective")]
    return [("status", "status"), *kinds, *value, *white, *_SHOWN]


def _first_run(table: SweepTable, root: Path) -> tuple[Question | None, Outcome]:
    """Return the question and the result of the first point that has one, as examples of all points."""
    run = next((run for run in table.columns["run"] if run), None)
    if run is None:
        return None, Outcome()
    try:
        text = read_regular(root / run / "spec.yaml").decode()
        return read_question(text, verb=table.summary.verb), read_outcome(root / run)
    except (OSError, SpecError, DataError):
        return None, Outcome()


def _answer(table: SweepTable) -> str:
    # During a sweep, the table is newer than the summary.
    statuses = ", ".join(f"{n} {status}" for status, n in sorted(Counter(table.columns["status"]).items()))
    said = f"{table.rows} points: {statuses}."
    found = table.best
    if found is None:
        return said
    quantity, point = found
    values = table.numbers(quantity)
    assert values is not None
    what = OBJECTIVES[table.kind].name if table.kind in OBJECTIVES else quantity
    low, high = np.nanmin(values), np.nanmax(values)
    return f"{said} Over the sweep the {what} ranges from {low:.5g} to {high:.5g}; it is best at {point}."


def _charts(table: SweepTable) -> list[Chart]:
    bounded = "; dashed: the proved bound that no design passes" if bound_of(table)[1] else ""
    failed = "; crosses: points without a result" if any(table.columns["code"]) else ""
    captions = {
        "curves": f"The result over one key{bounded}{failed}.",
        "map": "The result over both keys; hatched where a point has none.",
        "moments": "The second moments of the regressors over the key.",
    }
    return [chart(paint, captions[name]) for name, paint in sweep_figures(table)]


def _cell(text: str) -> str:
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return f"{value:.6g}" if isinstance(value, float) else text
