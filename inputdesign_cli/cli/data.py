"""`idesign identify` and `idesign assess`: a spec and the data of an experiment in, a run out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import (
    Confine,
    DataFiles,
    EstimateOutput,
    Figures,
    Json,
    Means,
    NoOutput,
    OperatingPoint,
    Overrides,
    Overwrite,
    Quiet,
    SpecFile,
    VerdictOutput,
)
from inputdesign_cli.cli.reading import read_spec
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import EXIT_MISSED, EXIT_UNDECIDED


def identify(
    data: DataFiles,
    spec: Annotated[
        Path, typer.Option("--spec", "-s", metavar="SPEC", help="Its plant and noise give the structure.")
    ],
    overrides: Overrides = None,
    confine: Confine = None,
    output: EstimateOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    remove_means: Means = False,
    operating_point: OperatingPoint = "",
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate the plant and the noise from recorded experiments.

    Orders and delay are those of the spec's plant and noise; it need not ask for a design. Writes
    model.yaml, the estimate as blocks to paste into a spec, with figures of the fit, the residuals and the
    model error; prints a summary. In closed loop the direct method is used, from u and y alone.
    """
    with status(f"{data[0]}: computing ...", quiet=quiet):
        from inputdesign_cli import tasks

        results = tasks.identify(
            read_spec(spec, overrides, confine, design=False),
            data,
            remove_means=remove_means,
            operating_point=_levels(operating_point),
        )
    place = Place(output, f"{data[0].stem}_identified", [spec, *data], overwrite, no_output)
    keep(results, place, figures=figures, json_output=json_output, quiet=quiet)


def assess(
    spec: SpecFile,
    data: DataFiles,
    overrides: Overrides = None,
    confine: Confine = None,
    output: VerdictOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    remove_means: Means = False,
    operating_point: OperatingPoint = "",
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell whether the data of a real experiment meet the target.

    Identifies the model, from all records jointly, and compares the accuracy that the data give with what
    the spec asks for. Exits with 0 if it is met. If not, exits with 1 and writes the cheapest experiment
    that, after these data, meets it: its signal is ready to apply. Exits with 5, undecided, where tests of
    the residuals refute the model structure; the note says what to change.
    """
    with status(f"{data[0]}: computing ...", quiet=quiet):
        from inputdesign_cli import tasks

        assessment = tasks.assess(
            read_spec(spec, overrides, confine),
            data,
            remove_means=remove_means,
            operating_point=_levels(operating_point),
        )
    place = Place(output, f"{data[0].stem}_assessed", [spec, *data], overwrite, no_output)
    keep(assessment.results, place, figures=figures, json_output=json_output, quiet=quiet)
    if assessment.verdict != "met":
        raise typer.Exit({"missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}[assessment.verdict])


def _levels(text: str) -> dict[str, float]:
    """`u1=40,y1=52.3` as numbers; u and y are u1 and y1.

    Raises:
        typer.BadParameter: The text is something else.
    """
    levels = {}
    for part in filter(None, text.split(",")):
        name, _, value = (piece.strip() for piece in part.partition("="))
        try:
            levels[name if name[1:] else f"{name}1"] = float(value)
        except ValueError:
            message = f"{part!r} is not a channel and a number, as in u1=40,y1=52.3"
            raise typer.BadParameter(message, param_hint="--operating-point") from None
    return levels
