"""`idesign assess`."""

from __future__ import annotations

from pathlib import Path

import typer

import inputdesign_cli
from inputdesign_cli.cli.options import DataFile, Figures, Json, Means, Output, Overrides, Quiet, SpecFile
from inputdesign_cli.cli.run import show
from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import EXIT_MISSED


def assess(
    spec: SpecFile,
    data: DataFile,
    overrides: Overrides = None,
    output: Output = None,
    remove_means: Means = False,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell whether the data of a real experiment meet the target.

    Identifies the model and compares the accuracy that the data give with what the spec asks for. Exits
    with 0 if it is met. If not, exits with 1 and writes the cheapest experiment that, after these data,
    meets it: its signal is ready to apply.
    """
    with status(f"{data}: computing ...", quiet=quiet):
        known = inputdesign_cli.load_spec(spec, overrides or [])
        assessment = inputdesign_cli.assess(known, data, remove_means=remove_means)
    with status(f"{data}: writing ...", quiet=quiet):
        from inputdesign_cli.figures.plots import draw_all
        from inputdesign_cli.runs.run_directory import write_run

        directory = output or Path("runs") / f"{data.stem}_assessed"
        files = write_run(assessment.outcome, directory, draw_all(assessment.outcome) if figures else {})
    show(assessment.outcome, files, json_output=json_output, quiet=quiet)
    if not assessment.met:
        raise typer.Exit(EXIT_MISSED)
