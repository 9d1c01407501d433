"""`idesign sweep`, and the sweep of `--trade`."""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from inputdesign_cli.cli.options import Shown, Workers
from inputdesign_cli.cli.run import name_of, standard_input
from inputdesign_cli.cli.terminal import EXIT_INTERNAL, aligned, computing, status
from inputdesign_cli.errors import STANDARD_STREAM
from inputdesign_cli.regular_file import read_regular

if TYPE_CHECKING:
    from inputdesign_cli.specification import Spec
    from inputdesign_cli.sweeps.plan import Plan
    from inputdesign_cli.sweeps.running import Listing, SweepRun


def sweep(
    spec: Path,
    *,
    settings: list[str] | None = None,
    zipped: bool = False,
    confine: Path | None = None,
    output: Path | None = None,
    overwrite: bool = False,
    verb: Literal["solve", "analyse", "simulate"] = "solve",
    workers: Workers,
    fail_fast: bool = False,
    rerun_failed: bool = False,
    dry_run: bool = False,
    plots: bool = False,
    figure_format: Literal["png", "svg", "pdf"] = "png",
    json_output: bool = False,
    quiet: bool = False,
) -> None:
    """Run a spec over a grid of settings.

    Writes a run directory for every point, one table (sweep.csv) and its plots. Can be killed at any moment:
    the same command goes on where it was and computes nothing twice. A point that is infeasible or fails is
    a row with its reason.
    """
    from inputdesign_cli.sweeps.plan import build_plan
    from inputdesign_cli.sweeps.running import SweepRun, list_points

    directory = output or Path("runs") / f"{name_of(spec)}-sweep"
    stdin = str(spec) == STANDARD_STREAM
    plan = build_plan(
        Path("<stdin>") if stdin else spec,
        settings or [],
        zipped=zipped,
        verb=verb,
        confine=confine,
        text=standard_input() if stdin else None,
    )
    if dry_run:
        _list(list_points(plan, directory), json_output=json_output)
        return
    started = time.monotonic()
    try:
        with status(f"{directory}: sweeping ...", quiet=quiet) as show:
            done = SweepRun(
                plan,
                directory,
                workers.executor(quiet=quiet),
                fail_fast,
                rerun_failed,
                figures=plots,
                figure_format=figure_format,
                overwrite=overwrite,
                watch=lambda progress: show(pace(progress, time.monotonic() - started)),
            ).run()
    except (KeyboardInterrupt, SystemExit):
        if not quiet:
            typer.echo(f"what is done is in {directory}; the same command finishes the rest", err=True)
        raise
    _show(done, json_output=json_output, quiet=quiet)


def _show(done: SweepRun, *, json_output: bool, quiet: bool) -> None:
    """Print the result of a sweep; raise its first failure if no point has a result."""
    for why in () if quiet else done.damaged:
        typer.echo(f"note: {why}; the point was computed again", err=True)
    if json_output:
        typer.echo(read_regular(done.directory / "sweep.json").decode(), nl=False)
    elif not quiet:
        statuses = ", ".join(f"{n} {status}" for status, n in done.statuses.items())
        before = done.total - done.computed
        lines = [("points", f"{done.total}: {statuses}{f' ({before} done before)' if before else ''}")]
        if done.first_failure is not None:
            diagnostic = done.first_failure.diagnostics[0]
            lines.append(("first failure", f"[{diagnostic.code}] {diagnostic.message}"))
        lines.append(("files", str(done.directory)))
        if done.replaced:
            lines.append(("replaced", "the table of the same file with other values in the spec"))
        typer.echo("\n".join(aligned(lines, gap=3, wrap=True)))
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
    """Return the points done, their rate, the time left and the failures. Points done before add no speed."""
    parts = [f"{progress.passed}/{progress.total}"]
    if progress.computed and seconds > 0:
        rate = progress.computed / seconds
        left = timedelta(seconds=round((progress.total - progress.passed) / rate))
        parts.append(f"{rate:.3g} points/s  {left} left")
    if progress.failed:
        parts.append(f"{progress.failed} without a result")
    return "  ".join(parts)


def show_trade(plan: Plan, spec: Spec, words: Sequence[str], run: Path, shown: Shown) -> None:
    """Sweep in a directory next to that of the run, draw the trade, and print its table."""
    quiet, directory = shown.quiet or shown.json_output, run.with_name(f"{run.name}-trade")
    file_type = shown.figure_format or spec.figures.format
    with computing(directory, quiet=quiet, doing=f"trading {' and '.join(words)}"):
        from inputdesign_cli.figures.sweep import draw_into, draw_trade
        from inputdesign_cli.figures.sweep_table import read_sweep
        from inputdesign_cli.sweeps.plan import trade_of
        from inputdesign_cli.sweeps.running import SweepRun

        SweepRun(
            plan,
            directory,
            Workers(jobs=0).executor(quiet=quiet),
            figure_format=file_type,
            overwrite=True,  # the directory belongs to the run, whatever was traded there before
        ).run()
        found = trade_of(read_sweep(directory), spec)
        drawn = draw_into(
            directory, "trade", lambda page: draw_trade(found, page), shown.figure_format or "png"
        )
    if not quiet:
        heads = [f"{length:g} {found.unit}" for length in found.lengths]
        rows = [["criterion" if found.criterion else "error / asked", *heads]]
        for name, values in found.rows.items():
            rows.append([name, *(f"{value:.3g}" if math.isfinite(value) else "none" for value in values)])
        typer.echo("\n" + "\n".join(aligned(rows, right=range(len(heads) + 1))))
        if not found.criterion:
            typer.echo("\nerror of the model over what is asked: below one is enough; more time to the right")
        typer.echo(f"\nfiles   {directory}: {drawn.name}, sweep.csv, sweep.yaml")
