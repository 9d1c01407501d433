"""What commands that make a run end with: a run directory and a summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.terminal import status

if TYPE_CHECKING:
    from inputdesign_cli.runs.results import Results


def keep(
    results: Results, output: Path | None, name: str, *, figures: bool, json_output: bool, quiet: bool
) -> None:
    """Write a run to `output` or else to runs/`name`, and print its result or its summary."""
    directory = output or Path("runs") / name
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
