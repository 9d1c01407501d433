"""Batch sweeps: every point once, whatever happens on the way."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from inputdesign_cli.compute.executor import Executor, Finished, InProcess, WorkerLostError
from inputdesign_cli.errors import STANDARD_STREAM, DataError, Diagnostic, IdesignError, OutputError
from inputdesign_cli.outcome.origin import Origin
from inputdesign_cli.outcome.run_directory import output_errors, replace_text
from inputdesign_cli.outcome.text_formats import json_text
from inputdesign_cli.questions.verbs import Verb
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.sweeps.grid import Settings
from inputdesign_cli.sweeps.layout import SPEC, SUMMARY, TABLE, Layout, opened
from inputdesign_cli.sweeps.plan import Plan, build_plan
from inputdesign_cli.sweeps.point import BROKEN, FAILURES, KINDS, LOST, PointEnd, PointJob, failed, run_point
from inputdesign_cli.sweeps.table import PENDING, table_lines

DAMAGED = "damaged"
"""Of a listed point: what is there of it does not hold, so that it is computed again."""
# While points are computed the table is written anew now and then: first so soon that who follows the sweep
# sees it, later not more often than this, and for no more than a thirtieth of the time.
_FIRST, _REST, _SHARE = 2.0, 10.0, 30.0


class Listing(NamedTuple):
    """A point of a sweep that has not been run: its settings, its key, and how it stands."""

    settings: dict[str, str]
    key: str
    status: str


@dataclass(frozen=True)
class Progress:
    """How far a sweep is: points passed (done before or now), computed now, and failed among those."""

    total: int
    passed: int
    computed: int
    failed: int


@dataclass(frozen=True)
class SweepSummary:
    """What a sweep has come to: how many points have which status, and the first failure, if any.

    `damaged` says why points of an earlier call were computed again.
    """

    directory: Path
    total: int
    computed: int
    statuses: dict[str, int]
    first_failure: IdesignError | None
    files: list[Path] = field(default_factory=list)
    damaged: list[str] = field(default_factory=list)

    @property
    def failures(self) -> int:
        """How many points have no result though they were tried."""
        return sum(n for status, n in self.statuses.items() if status in FAILURES)


def list_points(plan: Plan, directory: Path) -> Iterator[Listing]:
    """The points of a sweep and whether they are done; nothing is computed or written."""
    layout = Layout(directory)
    for index, point in enumerate(plan.grid):
        key = plan.key(index)
        status = "done" if layout.has_result(key) else "failed" if layout.has_failure(key) else PENDING
        status = DAMAGED if layout.flaw(key, plan.resolved(index)) else status
        names = (axis.key for axis in plan.grid.axes)
        yield Listing(dict(zip(names, point, strict=True)), key, status)


def run_sweep(
    spec: Path,
    settings: Settings = (),
    *,
    directory: Path,
    zipped: bool = False,
    verb: Verb = "solve",
    confine: Path | None = None,
    text: str | None = None,
    executor: Executor | None = None,
    fail_fast: bool = False,
    rerun_failed: bool = False,
    figures: bool = False,
    figure_format: str = "png",
    overwrite: bool = False,
    watch: Callable[[Progress], None] | None = None,
) -> SweepSummary:
    """Run a verb at every point of a grid, but for the points that are done already.

    Args:
        spec: the file, or with `text` where it would lie.
        settings: see `parse_settings`.
        confine: the folder outside of which the spec may name no files.
        text: of the spec, where it is in no file.
        executor: where the points are computed (default: in this process).
        fail_fast: stop at the first point without a result instead of noting it in the table.
        rerun_failed: try points again that failed in an earlier call.
        figures: draw the figures of every point too.
        figure_format: of all figures: png, svg or pdf.
        overwrite: replace the table of a sweep of another spec, of other keys or of another verb.
        watch: is called after every point.

    Raises:
        SpecError, OutputError: before anything is computed; later OutputError only.
        IdesignError: the first failure, with `fail_fast`.
    """
    plan = build_plan(spec, settings, zipped=zipped, verb=verb, confine=confine, text=text)
    with opened(directory) as layout:
        source = Path(STANDARD_STREAM) if text is not None else spec
        made_from = Origin([source]).seen_from(Path(os.path.realpath(directory)))
        if not overwrite:
            plan.check_place(made_from, directory)
        layout.remove_page()
        replace_text(directory / SUMMARY, json_text(plan.summary(made_from, {})))
        replace_text(directory / SPEC, to_yaml(plan.data()))
        drawn = figure_format if figures else ""
        run = _Run(plan, layout, executor or InProcess(), fail_fast, rerun_failed, drawn, watch)
        try:
            run.compute()
        finally:
            statuses = run.write_table()
            replace_text(directory / SUMMARY, json_text(plan.summary(made_from, statuses)))
        if fail_fast and run.first_failure:
            raise run.first_failure
        from inputdesign_cli.figures.sweep import draw_sweep
        from inputdesign_cli.figures.sweep_table import read_sweep

        files = [directory / name for name in (TABLE, SUMMARY, SPEC)]
        files += draw_sweep(read_sweep(directory), directory, figure_format)
        found = (run.computed, statuses, run.first_failure, files, run.damaged)
        return SweepSummary(directory, len(plan.grid), *found)


@dataclass
class _Run:
    plan: Plan
    layout: Layout
    executor: Executor
    fail_fast: bool
    rerun_failed: bool
    figures: str
    watch: Callable[[Progress], None] | None
    passed: int = 0
    computed: int = 0
    failed: int = 0
    stopped: bool = False
    lost: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)
    seen: set[str] = field(default_factory=set)  # keys of which nothing is left that was not looked at
    first_failure: IdesignError | None = None

    def compute(self) -> None:
        """Compute what is not done yet."""
        points = self.layout.root / "points"
        with output_errors(points):
            points.mkdir(exist_ok=True)
        due = time.monotonic() + _FIRST
        finished: Finished[PointJob, PointEnd]
        for finished in self.executor.run(run_point, self._jobs()):
            self._take(finished)
            if self.stopped:
                return
            if time.monotonic() > due:
                started = time.monotonic()
                self.write_table()
                due = time.monotonic() + max(_REST, _SHARE * (time.monotonic() - started))

    def write_table(self) -> dict[str, int]:
        """Write sweep.csv as things stand, and count the points by status."""
        statuses: Counter[str] = Counter()

        def read(key: str) -> Mapping[str, Any] | None:
            holds = key in self.seen or not self.layout.flaw(key)
            content = (self.layout.read(key) if holds else None) or self.lost.get(key)
            statuses[content.get("status", "done") if content else PENDING] += 1
            return content

        replace_text(self.layout.root / TABLE, table_lines(self.plan, read))
        # The table reads every point twice.
        return {status: n // 2 for status, n in sorted(statuses.items())}

    def _jobs(self) -> Iterator[PointJob]:
        root = self.layout.root if self.executor.shares_files else None
        for index in range(len(self.plan.grid)):
            if self.stopped:
                return
            key, known = self.plan.key(index), True
            if key not in self.seen:
                if why := self.layout.flaw(key, self.plan.resolved(index)):
                    self.damaged.append(why)
                    self.layout.discard(key)  # it is computed again
                self.seen.add(key)
                known = self.layout.has_result(key)
                if not known and self.layout.has_failure(key) and not self.rerun_failed:
                    known = True
                    self._note_failure(index, self.layout.read(key) or {})
            if known:
                self._report()
            else:
                yield self.plan.job(index, root, figures=self.figures)

    def _take(self, finished: Finished[PointJob, PointEnd]) -> None:
        """File what a worker has answered."""
        job, end = finished.job, finished.answer
        self.computed += 1
        if isinstance(finished.error, OutputError):
            raise finished.error
        if end is None:
            lost = isinstance(finished.error, WorkerLostError)
            code, status = ("worker-lost", LOST) if lost else ("internal-error", BROKEN)
            end = failed(status, Diagnostic(code, str(finished.error)), 0.0)
        if end.files is not None:
            try:
                self.layout.adopt(job.key, end.files)
            except DataError as strange:
                end = failed(BROKEN, strange.diagnostics[0], 0.0)
        if end.failure is None:
            self.layout.failure(job.key).unlink(missing_ok=True)
        else:
            if end.status == LOST:  # not the fault of the point: the next call tries it again
                self.lost[job.key] = end.failure
            else:
                self.layout.write_failure(job.key, end.failure)
            self._note_failure(job.index, end.failure)
        self._report()

    def _note_failure(self, index: int, content: Mapping[str, Any]) -> None:
        self.failed += 1
        self.stopped = self.stopped or self.fail_fast
        if self.first_failure is None:
            point = " ".join(f"--set {text}" for text in self.plan.grid.overrides(self.plan.grid[index]))
            kind = KINDS.get(content.get("status", ""), IdesignError)
            message = f"{content.get('message', '')} (at {point})"
            diagnostic = Diagnostic(content.get("code", ""), message, content.get("hint", ""))
            self.first_failure = kind(replace(diagnostic, key=content.get("key", "")))

    def _report(self) -> None:
        self.passed += 1
        if self.watch:
            self.watch(Progress(len(self.plan.grid), self.passed, self.computed, self.failed))
