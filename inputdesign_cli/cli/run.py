"""What commands that make a run have in common: spec in, run directory and summary out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.terminal import status

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor
    from inputdesign_cli.runs.results import Results
    from inputdesign_cli.sweep.verbs import Verb


def produce(
    verb: Verb,
    spec_file: Path,
    overrides: list[str] | None,
    output: Path | None,
    *,
    figures: bool,
    json_output: bool,
    quiet: bool,
    executor: Executor | None = None,
) -> None:
    """Run a verb on a spec file, write the run, and print it or its summary."""
    with status(f"{spec_file}: computing ...", quiet=quiet):
        from inputdesign_cli.specification import load_spec
        from inputdesign_cli.sweep.verbs import run_verb

        results = run_verb(verb, load_spec(spec_file, overrides or []), executor)
    directory = output or Path("runs") / spec_file.stem
    keep(results, directory, figures=figures, json_output=json_output, quiet=quiet)


def keep(results: Results, directory: Path, *, figures: bool, json_output: bool, quiet: bool) -> None:
    """Write a run, with or without its figures, and print its result or its summary."""
    with status(f"{directory}: writing ...", quiet=quiet):
        from inputdesign_cli.runs.run_directory import write_run

        drawings = {}
        if figures:
            from inputdesign_cli.figures.plots import draw_all

            drawings = draw_all(results)
        files = write_run(results, directory, drawings)
    if json_output:
        typer.echo(files[-1].read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        from inputdesign_cli.cli.summary import summary

        typer.echo(summary(results.result, results.time_unit, files))
