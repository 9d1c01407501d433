"""`idesign sweep`."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from inputdesign_cli.cli.completion import spec_keys
from inputdesign_cli.cli.options import Confine, FigureFormat, Json, Output, Quiet, SpecFile, Workers
from inputdesign_cli.cli.reading import name_of, standard_input
from inputdesign_cli.cli.terminal import EXIT_INTERNAL, aligned, status
from inputdesign_cli.errors import STANDARD_STREAM
from inputdesign_cli.regular_file import read_regular

if TYPE_CHECKING:
    from inputdesign_cli.sweeps.running import Listing, SweepRun


@dataclass(frozen=True)
class Asked:
    """What is swept, and how failures count."""

    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=V1,V2,..",
            help="Vary a key: a list of values or LOW:HIGH:STEP; a single value holds for all points. "
            "Repeatable; joins and replaces what the spec has under `sweep`.",
            autocompletion=spec_keys,
        ),
    ] = None
    zipped: Annotated[
        bool, typer.Option("--zip", help="Take the values side by side, not in every combination.")
    ] = False
    confine: Confine = None
    output: Output = None
    overwrite: Annotated[
        bool,
        typer.Option(
            "--overwrite", help="Replace the table of a sweep of another spec, other keys or another command."
        ),
    ] = False
    verb: Annotated[
        Literal["solve", "analyse", "simulate"], typer.Option(help="The command to run at every point.")
    ] = "solve"


def sweep(
    spec: SpecFile,
    *,
    asked: Asked,
    workers: Workers,
    fail_fast: Annotated[
        bool,
        typer.Option(
            "--fail-fast/--keep-going",
            help="Stop at the first point without a result, or note it in the table and go on (the default).",
        ),
    ] = False,
    rerun_failed: Annotated[
        bool, typer.Option("--rerun-failed", help="Try the points again that failed in an earlier call.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", "-n", help="List the points and whether they are done; run none.")
    ] = False,
    plots: Annotated[
        bool, typer.Option("--plots", help="Draw the figures of every point too, not only of the sweep.")
    ] = False,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a spec over a grid of settings.

    Writes a run directory for every point, one table (sweep.csv) and its plots. Can be killed at any moment:
    the same command goes on where it was and computes nothing twice. A point that is infeasible or fails is
    a row with its reason.
    """
    from inputdesign_cli.sweeps.plan import build_plan
    from inputdesign_cli.sweeps.running import SweepRun, list_points

    directory = asked.output or Path("runs") / f"{name_of(spec)}-sweep"
    stdin = str(spec) == STANDARD_STREAM
    plan = build_plan(
        Path("<stdin>") if stdin else spec,
        asked.settings or [],
        zipped=asked.zipped,
        verb=asked.verb,
        confine=asked.confine,
        text=standard_input() if stdin else None,
    )
    if dry_run:
        _list(list_points(plan, directory), json_output=json_output)
        return
    with _watched(directory, quiet=quiet) as line:
        done = SweepRun(
            plan,
            directory,
            workers.executor(quiet=quiet),
            fail_fast,
            rerun_failed,
            figures=plots,
            figure_format=figure_format,
            overwrite=asked.overwrite,
            watch=line,
        ).run()
    _show(done, json_output=json_output, quiet=quiet)


@contextmanager
def _watched(directory: Path, *, quiet: bool) -> Iterator[Callable[[SweepRun], None]]:
    """Show how far a sweep is; where it is ended by Ctrl-C or SIGTERM, say how to finish it."""
    started = time.monotonic()
    try:
        with status(f"{directory}: sweeping ...", quiet=quiet) as show:
            yield lambda progress: show(pace(progress, time.monotonic() - started))
    except (KeyboardInterrupt, SystemExit):
        if not quiet:
            typer.echo(f"what is done is in {directory}; the same command finishes the rest", err=True)
        raise


def _show(done: SweepRun, *, json_output: bool, quiet: bool) -> None:
    """Print what a sweep has come to.

    Raises:
        typer.Exit: a point ended by a mistake in the program, or its worker was lost.
        IdesignError: the first failure, where no point has a result.
    """
    for why in () if quiet else done.damaged:
        typer.echo(f"note: {why}; the point was computed again", err=True)
    if json_output:
        typer.echo(read_regular(done.directory / "sweep.json").decode(), nl=False)
    elif not quiet:
        typer.echo(_summary(done))
    if done.statuses.get("error") or done.statuses.get("lost"):
        raise typer.Exit(EXIT_INTERNAL)
    if done.first_failure is not None and done.failures == done.total:
        raise done.first_failure


def _list(points: Iterable[Listing], *, json_output: bool) -> None:
    if json_output:
        content = [point._asdict() for point in points]
        typer.echo(json.dumps(content, indent=1, ensure_ascii=False))
        return
    counts: Counter[str] = Counter()
    for point in points:
        counts[point.status] += 1
        settings = "  ".join(f"{key}={text}" for key, text in point.settings.items())
        typer.echo(f"{point.status:8} {point.key}  {settings}")
    listed = ", ".join(f"{n} {status}" for status, n in counts.items())
    typer.echo(f"\n{sum(counts.values())} points: {listed}")


def pace(progress: SweepRun, seconds: float) -> str:
    """The points, the rate, the time left and the failures. Points done before do not count as speed."""
    told = [f"{progress.passed}/{progress.total}"]
    if progress.computed and seconds > 0:
        rate = progress.computed / seconds
        left = timedelta(seconds=round((progress.total - progress.passed) / rate))
        told.append(f"{rate:.3g} points/s  {left} left")
    if progress.failed:
        told.append(f"{progress.failed} without a result")
    return "  ".join(told)


def _summary(done: SweepRun) -> str:
    statuses = ", ".join(f"{n} {status}" for status, n in done.statuses.items())
    before = done.total - done.computed
    lines = [("points", f"{done.total}: {statuses}{f' ({before} done before)' if before else ''}")]
    if done.first_failure is not None:
        diagnostic = done.first_failure.diagnostics[0]
        lines.append(("first failure", f"[{diagnostic.code}] {diagnostic.message}"))
    lines.append(("files", f"{done.directory}: {', '.join(path.name for path in done.files)}"))
    return "\n".join(aligned(lines, gap=3, wrap=True))
