"""What `solve`, `analyse` and `simulate` have in common: spec in, run directory and summary out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

import inputdesign_cli
from inputdesign_cli.cli.terminal import status

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor
    from inputdesign_cli.runs.results import Results


def produce(
    verb: Literal["solve", "analyse", "simulate"],
    spec_file: Path,
    overrides: list[str] | None,
    output: Path | None,
    *,
    figures: bool,
    json_output: bool,
    quiet: bool,
    executor: Executor | None = None,
) -> None:
    """Run a verb of the package on a spec file, write the run, and print it or its summary.

    Only `simulate` takes an executor.
    """
    where: dict[str, Any] = {} if executor is None else {"executor": executor}
    with status(f"{spec_file}: computing ...", quiet=quiet):
        spec = inputdesign_cli.load_spec(spec_file, overrides or [])
        outcome = getattr(inputdesign_cli, verb)(spec, **where)
    with status(f"{spec_file}: writing ...", quiet=quiet):
        from inputdesign_cli.figures.plots import draw_all
        from inputdesign_cli.runs.run_directory import write_run

        directory = output or Path("runs") / spec_file.stem
        files = write_run(outcome, directory, draw_all(outcome) if figures else {})
    show(outcome, files, json_output=json_output, quiet=quiet)


def show(outcome: Results, files: list[Path], *, json_output: bool, quiet: bool) -> None:
    """Print the result, or its summary."""
    if json_output:
        typer.echo(files[-1].read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        from inputdesign_cli.cli.summary import summary

        typer.echo(summary(outcome.result, outcome.time_unit, files))
