"""`idesign explore`: a log in, a model and a spec out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from inputdesign_cli.cli.computing import computing
from inputdesign_cli.cli.data import preparation
from inputdesign_cli.cli.options import (
    Columns,
    DataFiles,
    DetrendWord,
    ExplorationOutput,
    FigureFormat,
    Figures,
    Json,
    NoOutput,
    Overwrite,
    Quiet,
    Resample,
    SampleTime,
    Skip,
    Span,
    StructureWord,
    TimeUnit,
    Without,
)
from inputdesign_cli.cli.reading import read_spec
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.errors import EXIT_MISSED

if TYPE_CHECKING:
    from inputdesign_cli.explore import Family


def explore(
    data: DataFiles,
    columns: Columns = "",
    validate: Annotated[
        Path | None,
        typer.Option("--validate", metavar="MODEL", help="Judge this model by the data; look for no other."),
    ] = None,
    structure: StructureWord = "any",
    sample_time: SampleTime = None,
    time_unit: TimeUnit = None,
    resample: Resample = False,
    detrend: DetrendWord = "none",
    skip: Skip = 0,
    span: Span = "",
    without: Without = None,
    output: ExplorationOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find a model in a log, and write a spec for the next experiment.

    Needs no spec. Delays, orders and the family of the model are estimated on one part of the record and
    judged on the other; of those that explain it as well the simplest is taken. Writes model.yaml, a
    commented spec.yaml for `idesign solve`, figures and report.html; prints a summary. Exits with 1, and
    says why, where no model deserves trust.
    """
    ending = "explored" if validate is None else "validated"
    sources = [*([validate] if validate is not None else []), *data]
    place = Place(output, f"{data[0].stem}_{ending}", sources, overwrite, no_output)
    with computing(data[0], quiet=quiet):
        from inputdesign_cli import questions

        prepared = preparation(columns, sample_time, time_unit, resample, detrend, skip, span, without, data)
        model = None if validate is None else read_spec(validate, None, None, design=False)
        place = place.checked(model)
        found = questions.explore(
            data, prepared, model=model, structure=None if structure == "any" else cast("Family", structure)
        )
    keep(
        found.results,
        place,
        figures=figures,
        figure_format=figure_format,
        json_output=json_output,
        quiet=quiet,
        page=validate is None,
    )
    if found.reasons:
        raise typer.Exit(EXIT_MISSED)
