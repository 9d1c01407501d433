"""`idesign identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import DataFile, Figures, Json, Means, Output, Overrides, Quiet
from inputdesign_cli.cli.run import keep
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
        from inputdesign_cli.specification import load_spec
        from inputdesign_cli.tasks import identify as identified

        results = identified(load_spec(spec, overrides or []), data, remove_means=remove_means)
    directory = output or Path("runs") / f"{data.stem}_identified"
    keep(results, directory, figures=figures, json_output=json_output, quiet=quiet)
