"""`idesign sweep`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from inputdesign_cli.cli.completion import spec_keys
from inputdesign_cli.cli.options import Confine, FigureFormat, Json, Quiet, SpecFile, SweepOutput, one_of
from inputdesign_cli.cli.reading import name_of, standard_input
from inputdesign_cli.cli.terminal import EXIT_INTERNAL, aligned
from inputdesign_cli.cli.workers import ClusterAddress, Jobs, WorkerTimeout, executor
from inputdesign_cli.errors import STANDARD_STREAM
from inputdesign_cli.regular_file import read_regular

if TYPE_CHECKING:
    from inputdesign_cli.sweeps.running import Listing, SweepSummary

VERBS = ("solve", "analyse", "simulate")


def sweep(
    spec: SpecFile,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=V1,V2,..",
            help="Vary a key: a list of values or LOW:HIGH:STEP; a single value holds for all points. "
            "Repeatable; joins and replaces what the spec has under `sweep`.",
            autocompletion=spec_keys,
        ),
    ] = None,
    zipped: Annotated[
        bool, typer.Option("--zip", help="Take the values side by side, not in every combination.")
    ] = False,
    confine: Confine = None,
    output: SweepOutput = None,
    overwrite: Annotated[
        bool,
        typer.Option(
            "--overwrite", help="Replace the table of a sweep of another spec, other keys or another command."
        ),
    ] = False,
    verb: Annotated[
        str, one_of(("solve", "analyse", "simulate"), "The command to run at every point")
    ] = "solve",
    jobs: Jobs = 1,
    cluster: ClusterAddress = None,
    worker_timeout: WorkerTimeout = None,
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
    from inputdesign_cli.sweeps import running as batch

    directory = output or Path("runs") / f"{name_of(spec)}-sweep"
    text = None
    if str(spec) == STANDARD_STREAM:
        spec, text = Path("<stdin>"), standard_input()
    common: dict[str, Any] = {
        "directory": directory,
        "zipped": zipped,
        "verb": verb,
        "confine": confine,
        "text": text,
    }
    if dry_run:
        _list(batch.list_points(spec, settings or [], **common), json_output=json_output)
        return
    from inputdesign_cli.cli.progress import ProgressLine

    line = ProgressLine(quiet=quiet)
    try:
        done = batch.run_sweep(
            spec,
            settings or [],
            **common,
            executor=executor(jobs, cluster, worker_timeout, quiet=quiet),
            fail_fast=fail_fast,
            rerun_failed=rerun_failed,
            figures=plots,
            figure_format=figure_format,
            overwrite=overwrite,
            watch=line,
        )
    except (KeyboardInterrupt, SystemExit):  # Ctrl-C, SIGTERM
        line.close()
        if not quiet:
            typer.echo(f"what is done is in {directory}; the same command finishes the rest", err=True)
        raise
    finally:
        line.close()
    for why in () if quiet else done.damaged:
        typer.echo(f"note: {why}; the point was computed again", err=True)
    if json_output:
        typer.echo(read_regular(directory / "sweep.json").decode(), nl=False)
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
    counts: dict[str, int] = {}
    for point in points:
        counts[point.status] = counts.get(point.status, 0) + 1
        settings = "  ".join(f"{key}={text}" for key, text in point.settings.items())
        typer.echo(f"{point.status:8} {point.key}  {settings}")
    listed = ", ".join(f"{n} {status}" for status, n in counts.items())
    typer.echo(f"\n{sum(counts.values())} points: {listed}")


def _summary(done: SweepSummary) -> str:
    statuses = ", ".join(f"{n} {status}" for status, n in done.statuses.items())
    before = done.total - done.computed
    lines = [("points", f"{done.total}: {statuses}{f' ({before} done before)' if before else ''}")]
    if done.first_failure is not None:
        diagnostic = done.first_failure.diagnostics[0]
        lines.append(("first failure", f"[{diagnostic.code}] {diagnostic.message}"))
    lines.append(("files", f"{done.directory}: {', '.join(path.name for path in done.files)}"))
    return "\n".join(aligned(lines, gap=3, wrap=True))
