"""`idesign identify` and `idesign assess`: a spec and the data of an experiment in, a run out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import (
    Confine,
    DataFile,
    EstimateOutput,
    Figures,
    Json,
    Means,
    NoOutput,
    Overrides,
    Overwrite,
    Quiet,
    SpecFile,
    VerdictOutput,
)
from inputdesign_cli.cli.reading import read_spec
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import EXIT_MISSED


def identify(
    data: DataFile,
    spec: Annotated[
        Path, typer.Option("--spec", "-s", metavar="SPEC", help="Its plant and noise give the structure.")
    ],
    overrides: Overrides = None,
    confine: Confine = None,
    output: EstimateOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
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
        from inputdesign_cli import tasks

        results = tasks.identify(read_spec(spec, overrides, confine), data, remove_means=remove_means)
    place = Place(output, f"{data.stem}_identified", [spec, data], overwrite, no_output)
    keep(results, place, figures=figures, json_output=json_output, quiet=quiet)


def assess(
    spec: SpecFile,
    data: DataFile,
    overrides: Overrides = None,
    confine: Confine = None,
    output: VerdictOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
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
        from inputdesign_cli import tasks

        assessment = tasks.assess(read_spec(spec, overrides, confine), data, remove_means=remove_means)
    place = Place(output, f"{data.stem}_assessed", [spec, data], overwrite, no_output)
    keep(assessment.results, place, figures=figures, json_output=json_output, quiet=quiet)
    if not assessment.met:
        raise typer.Exit(EXIT_MISSED)
