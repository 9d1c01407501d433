"""`idesign assess`."""

from __future__ import annotations

from pathlib import Path

import typer

from inputdesign_cli.cli.options import DataFile, Figures, Json, Means, Output, Overrides, Quiet, SpecFile
from inputdesign_cli.cli.run import keep
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
        from inputdesign_cli.specification import load_spec
        from inputdesign_cli.tasks import assess as assessed

        assessment = assessed(load_spec(spec, overrides or []), data, remove_means=remove_means)
    directory = output or Path("runs") / f"{data.stem}_assessed"
    keep(assessment.outcome, directory, figures=figures, json_output=json_output, quiet=quiet)
    if not assessment.met:
        raise typer.Exit(EXIT_MISSED)
