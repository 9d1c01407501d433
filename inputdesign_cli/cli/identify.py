"""`idesign identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import inputdesign_cli
from inputdesign_cli.cli.options import DataFile, Figures, Json, Means, Output, Overrides, Quiet
from inputdesign_cli.cli.run import show
from inputdesign_cli.cli.terminal import status


def identify(
    data: DataFile,
    spec: Annotated[
        Path,
        typer.Option("--spec", "-s", metavar="SPEC", help="Its plant and noise give the structure."),
    ],
    overrides: Overrides = None,
    output: Output = None,
    remove_means: Means = False,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate the plant and the noise from a recorded experiment.

    Orders and delay are those of the spec's plant and noise. Writes model.yaml, the estimate as blocks to
    paste into a spec, with figures of the fit, the residuals and the model error; prints a summary. In
    closed loop the direct method is used, from u and y alone.
    """
    with status(f"{data}: computing ...", quiet=quiet):
        known = inputdesign_cli.load_spec(spec, overrides or [])
        outcome = inputdesign_cli.identify(known, data, remove_means=remove_means)
    with status(f"{data}: writing ...", quiet=quiet):
        from inputdesign_cli.figures.plots import draw_all
        from inputdesign_cli.runs.run_directory import write_run

        directory = output or Path("runs") / f"{data.stem}_identified"
        files = write_run(outcome, directory, draw_all(outcome) if figures else {})
    show(outcome, files, json_output=json_output, quiet=quiet)
