"""Batch sweeps: every point is computed once, in spite of interruptions; sweep.csv has one row a point."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self

from inputdesign_cli.compute.executor import Executor, Finished, InProcess, WorkerLostError
from inputdesign_cli.errors import DataError, Diagnostic, IdesignError
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.run_directory import Origin, output_errors, replace_text
from inputdesign_cli.outcome.run_files import PAGE, is_page
from inputdesign_cli.outcome.text_formats import csv_line, shortest
from inputdesign_cli.specification import relocated
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.sweeps import points
from inputdesign_cli.sweeps.plan import Plan
from inputdesign_cli.sweeps.points import Layout, PointEnd, PointJob, failure_of

PENDING = "pending"
MOST_ENTRIES = 4
"""Lists and matrices up to this size are written out, one column an entry."""

# The first columns, in this order; other entries of a result follow in their own order.
FIRST = (
    "objective.kind",
    "objective.value",
    "objective.lower_bound",
    "objective.upper_bound",
    "objective.relative_gap",
    "objective.any_spectrum_bound",
    "cost",
    "samples",
)
LAST = ("time_s", "code", "reason", "run")
# Settings, provenance and long entries, which are not compared from point to point.
_LEFT_OUT = frozenset(
    {
        "format", "title", "status", "information", "spectrum", "solver", "environment", "timing_s",
        "spec_sha256", "files", "code", "message", "hint", "key", "active_frequencies", "certificate",
    }
)  # fmt: skip


def row_of(key: str, content: Mapping[str, Any] | None) -> dict[str, object]:
    """Return the cells of a point from its result, its failure (which has a `code`), or neither."""
    if content is None:
        return {"status": PENDING}
    known = {"status": content.get("status", "done"), "time_s": content.get("timing_s", {}).get("point")}
    if "code" in content:
        return known | {"code": content["code"], "reason": content["message"]}
    return scalars(content) | known | {"run": f"points/{key}"}


def table_lines(
    axes: Sequence[str], rows: Sequence[tuple[Sequence[str], Mapping[str, object]]]
) -> Iterator[str]:
    """Return the lines of the table.

    Args:
        axes: the keys that are varied.
        rows: each point, as the texts of its values, with its cells.
    """
    found = dict.fromkeys(name for _, row in rows for name in row if name not in ("status", *LAST))
    columns = ["status", *(n for n in FIRST if n in found), *(n for n in found if n not in FIRST), *LAST]
    yield csv_line([*axes, *columns])
    for point, row in rows:
        cells = map(row.get, columns)
        yield csv_line(
            [*point, *(shortest(v) if isinstance(v, float) else "" if v is None else str(v) for v in cells)]
        )


def scalars(value: object, path: str = "") -> dict[str, object]:
    """Return every number, text and truth value of a result by its path (`power.input[0]`)."""
    found: dict[str, object] = {}
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key not in _LEFT_OUT:
                found |= scalars(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        if len(value) <= MOST_ENTRIES:
            for i, item in enumerate(value):
                found |= scalars(item, f"{path}[{i}]")
    elif value is not None:
        found[path] = value
    return found


DAMAGED = "damaged"
"""The status of a listed point whose files are damaged, so that it is computed again."""
# Seconds until the table is first written during a sweep, least seconds until it is written again, and least
# ratio of this pause to the time of writing.
_FIRST, _REST, _SHARE = 2.0, 10.0, 30.0


class Listing(NamedTuple):
    """Holds a point of a sweep that has not been run: its settings, its key, and its status."""

    settings: dict[str, str]
    key: str
    status: str


def list_points(plan: Plan, directory: Path) -> Iterator[Listing]:
    """Yield the points of a sweep and whether they are done; nothing is computed or written."""
    layout, names = Layout(directory), [axis.key for axis in plan.grid.axes]
    for index, point in enumerate(plan.grid.points):
        key = plan.key(index)
        try:
            content = layout.read(key, plan.resolved(index, directory))
            status = PENDING if content is None else "failed" if "code" in content else "done"
        except DataError:
            status = DAMAGED
        yield Listing(dict(zip(names, point, strict=True)), key, status)


@dataclass
class SweepRun:
    """Runs a verb at every point of a plan, but for the points that are done already.

    Attributes:
        executor: where the points are computed (default: in this process).
        fail_fast: stop at the first point without a result instead of noting it in the table.
        rerun_failed: try points again that failed in an earlier call.
        figures: draw the figures of every point too, not only of the sweep.
        figure_format: the format of all figures: png, svg or pdf.
        overwrite: replace the table of a sweep of another spec, of other keys or of another verb.
        watch: is called with this object after every point.
        statuses: the number of points of each status, after the run; `files`: the files written then.
        passed: number of points done so far, before or in this call; `computed` and `failed`: in this call.
        damaged: why points of an earlier call were computed again.
        replaced: whether an earlier table of the same file with other values in the spec was replaced.
    """

    plan: Plan
    directory: Path
    executor: Executor | None = None
    fail_fast: bool = False
    rerun_failed: bool = False
    figures: bool = False
    figure_format: str = "png"
    overwrite: bool = False
    watch: Callable[[SweepRun], None] | None = None
    statuses: dict[str, int] = field(default_factory=dict, init=False)
    files: list[Path] = field(default_factory=list, init=False)
    # Rows by the keys of the points looked at so far; None while a point is computed.
    rows: dict[str, dict[str, object] | None] = field(default_factory=dict, init=False)
    passed: int = field(default=0, init=False)
    computed: int = field(default=0, init=False)
    failed: int = field(default=0, init=False)
    damaged: list[str] = field(default_factory=list, init=False)
    replaced: bool = field(default=False, init=False)
    first_failure: IdesignError | None = field(default=None, init=False)

    @property
    def total(self) -> int:
        """Return the number of points."""
        return len(self.plan.grid)

    @property
    def failures(self) -> int:
        """Return the number of points that were tried and have no result."""
        return sum(n for status, n in self.statuses.items() if status in points.FAILURES)

    def run(self) -> Self:
        """Compute the points without a result, write the table, and return the sweep.

        Raises:
            OutputError: the directory cannot be used.
            IdesignError: the first failure, with `fail_fast`.
        """
        plan, directory = self.plan, self.directory
        with points.opened(directory) as self.layout:
            made_from = Origin([plan.source]).seen_from(Path(os.path.realpath(directory)))
            if not self.overwrite:
                self.replaced = plan.check_place(made_from, directory)
            if is_page(directory / PAGE):  # it shows the earlier sweep
                (directory / PAGE).unlink()
            replace_text(directory / points.SUMMARY, json_text(plan.summary(made_from, {})))
            text = to_yaml({**plan.base, "sweep": plan.grid.block()})
            replace_text(directory / points.SPEC, relocated(text, plan.draft.folder, directory))
            try:
                self._compute()
            finally:
                self._write_table()
                replace_text(directory / points.SUMMARY, json_text(plan.summary(made_from, self.statuses)))
            if self.fail_fast and self.first_failure:
                raise self.first_failure
            from inputdesign_cli.figures.sweep import draw_sweep
            from inputdesign_cli.figures.sweep_table import read_sweep

            self.files = [directory / name for name in (points.TABLE, points.SUMMARY, points.SPEC)]
            self.files += draw_sweep(read_sweep(directory), directory, self.figure_format)
            return self

    def _compute(self) -> None:
        """Compute the points without a result."""
        folder = self.directory / "points"
        with output_errors(folder):
            folder.mkdir(exist_ok=True)
        due = time.monotonic() + _FIRST
        finished: Finished[PointJob, PointEnd]
        executor = self.executor or InProcess()
        for finished in executor.run(points.run_point, self._jobs(executor.shares_files)):
            self._take(finished)
            if self.fail_fast and self.failed:
                return
            if time.monotonic() > due:
                started = time.monotonic()
                self._write_table()
                due = time.monotonic() + max(_REST, _SHARE * (time.monotonic() - started))

    def _write_table(self) -> None:
        """Write sweep.csv with the present results, and count the points by status."""
        grid = self.plan.grid
        rows = [(point, self._row(self.plan.key(index))) for index, point in enumerate(grid.points)]
        replace_text(self.directory / points.TABLE, table_lines([axis.key for axis in grid.axes], rows))
        self.statuses = dict(sorted(Counter(str(row["status"]) for _, row in rows).items()))

    def _row(self, key: str) -> dict[str, object]:
        """Return the row of a point; it is read from the files if it is not known."""
        try:
            return self.rows.get(key) or row_of(key, self.layout.read(key))
        except DataError:
            return row_of(key, None)

    def _jobs(self, shares_files: bool) -> Iterator[PointJob]:
        drawn = self.figure_format if self.figures else ""
        for index in range(self.total):
            if self.fail_fast and self.failed:
                return
            key = self.plan.key(index)
            if key not in self.rows:
                content = self._known(index, key)
                self.rows[key] = row_of(key, content) if content else None
                if content is None:
                    yield self.plan.job(index, self.directory, carries=not shares_files, figures=drawn)
                    continue
                if "code" in content:
                    self._note_failure(index, content)
            self._report()

    def _known(self, index: int, key: str) -> Mapping[str, object] | None:
        """Return the known result of a point; None if it is damaged or is to be computed again."""
        try:
            content = self.layout.read(key, self.plan.resolved(index, self.directory))
        except DataError as error:
            self.damaged.append(error.diagnostics[0].message)
            self.layout.discard(key)
            return None
        return None if content and "code" in content and self.rerun_failed else content

    def _take(self, finished: Finished[PointJob, PointEnd]) -> None:
        """Store the answer of a worker."""
        job, end, error = finished.job, finished.answer, finished.error
        self.computed += 1
        lost = isinstance(error, WorkerLostError)
        if end is None:
            code, status = ("worker-lost", points.LOST) if lost else ("internal-error", points.BROKEN)
            end = failure_of(status, Diagnostic(code, str(error))), None
        failure, files = end
        if files is not None:
            try:
                self.layout.adopt(job.key, files)
            except DataError as strange:
                failure = failure_of(points.BROKEN, strange.diagnostics[0])
        if failure is None:
            self.layout.failure(job.key).unlink(missing_ok=True)
            self.rows[job.key] = row_of(job.key, self.layout.read(job.key))
        else:
            if not lost:  # a lost worker is no fault of the point: the next call tries it again
                self.layout.write_failure(job.key, failure)
            self.rows[job.key] = row_of(job.key, failure)
            self._note_failure(job.index, failure)
        self._report()

    def _note_failure(self, index: int, content: Mapping[str, object]) -> None:
        self.failed += 1
        if self.first_failure is None:
            point = " ".join(f"--set {text}" for text in self.plan.grid.overrides(index))
            code, status, message, hint, key = (
                str(content[name]) for name in ("code", "status", "message", "hint", "key")
            )
            diagnostic = Diagnostic(code, f"{message} (at {point})", hint, key)
            self.first_failure = points.KINDS.get(status, IdesignError)(diagnostic)

    def _report(self) -> None:
        self.passed += 1
        if self.watch:
            self.watch(self)
