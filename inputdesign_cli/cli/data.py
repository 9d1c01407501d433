"""`idesign identify` and `idesign assess`: a spec and the data of an experiment in, a run out."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from inputdesign_cli.cli.computing import computing
from inputdesign_cli.cli.options import (
    Columns,
    Confine,
    DataFiles,
    Decimal,
    DetrendWord,
    EstimateOutput,
    FigureFormat,
    Figures,
    Json,
    Means,
    NoOutput,
    OperatingPoint,
    Overrides,
    Overwrite,
    Quiet,
    Resample,
    SampleTime,
    Separator,
    Skip,
    Span,
    SpecFile,
    TimeFormat,
    TimeUnit,
    VerdictOutput,
    Without,
)
from inputdesign_cli.cli.reading import read_spec
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.errors import EXIT_MISSED, EXIT_UNDECIDED

if TYPE_CHECKING:
    from inputdesign_cli.records import Preparation, Run

_ROWS = re.compile(r"(?:(.+):)?\s*((\d+)(?:\s*-\s*(\d+))?)\s*", re.DOTALL)
_CHANNEL = re.compile(r"[uyr]([1-9]\d*)?|time", re.ASCII)


def identify(
    data: DataFiles,
    spec: Annotated[
        Path | None,
        typer.Option("--spec", "-s", metavar="SPEC", help="Its plant and noise give the structure."),
    ] = None,
    overrides: Overrides = None,
    confine: Confine = None,
    output: EstimateOutput = None,
    overwrite: Overwrite = False,
    no_output: NoOutput = False,
    remove_means: Means = False,
    operating_point: OperatingPoint = "",
    columns: Columns = "",
    sample_time: SampleTime = None,
    time_unit: TimeUnit = None,
    resample: Resample = False,
    detrend: DetrendWord = "none",
    skip: Skip = 0,
    span: Span = "",
    without: Without = None,
    separator: Separator = None,
    decimal: Decimal = None,
    time_format: TimeFormat = None,
    frequency_response: Annotated[
        bool,
        typer.Option(
            "--frequency-response",
            help="Measure the frequency response without a model instead, at the lines of the spec.",
        ),
    ] = False,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate the plant and the noise from recorded experiments.

    Orders and delay are those of the spec's plant and noise; it need not ask for a design. Writes
    model.yaml, the estimate as blocks to paste into a spec, with figures of the fit, the residuals and the
    model error; prints a summary. In closed loop the direct method is used, from u and y alone.
    """
    if spec is None:
        raise typer.BadParameter(
            "it says which structure is estimated; `idesign explore DATA` finds one without a spec",
            param_hint="--spec",
        )
    place = Place(output, f"{data[0].stem}_identified", [spec, *data], overwrite, no_output)
    with computing(data[0], quiet=quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.origin import check_counted_once

        stated = read_spec(spec, overrides, confine, design=False)
        place = place.checked(stated)
        check_counted_once(spec, data)
        results = questions.identify(
            stated,
            data,
            remove_means=remove_means,
            operating_point=levels(operating_point),
            preparation=written(
                preparation(columns, sample_time, time_unit, resample, detrend, skip, span, without, data),
                separator,
                decimal,
                time_format,
            ),
            frequency_response=frequency_response,
        )
    keep(results, place, figures=figures, figure_format=figure_format, json_output=json_output, quiet=quiet)


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
    columns: Columns = "",
    sample_time: SampleTime = None,
    time_unit: TimeUnit = None,
    resample: Resample = False,
    detrend: DetrendWord = "none",
    skip: Skip = 0,
    span: Span = "",
    without: Without = None,
    separator: Separator = None,
    decimal: Decimal = None,
    time_format: TimeFormat = None,
    figures: Figures = True,
    figure_format: FigureFormat = "png",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell whether the data of a real experiment meet the target.

    Identifies the model, from all records jointly, and compares the accuracy that the data give with what
    the spec asks for. Exits with 0 if it is met. If not, exits with 1 and writes the cheapest experiment
    that, after these data, meets it: its signal is ready to apply. Exits with 5, undecided, where tests of
    the residuals refute the model structure; the note says what to change.
    """
    place = Place(output, f"{data[0].stem}_assessed", [spec, *data], overwrite, no_output, judges=True)
    with computing(data[0], quiet=quiet):
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.origin import check_counted_once

        stated = read_spec(spec, overrides, confine)
        place = place.checked(stated)
        check_counted_once(spec, data)
        assessment = questions.assess(
            stated,
            data,
            remove_means=remove_means,
            operating_point=levels(operating_point),
            preparation=written(
                preparation(columns, sample_time, time_unit, resample, detrend, skip, span, without, data),
                separator,
                decimal,
                time_format,
            ),
        )
    keep(
        assessment.results,
        place,
        figures=figures,
        figure_format=figure_format,
        json_output=json_output,
        quiet=quiet,
    )
    if assessment.verdict != "met":
        raise typer.Exit({"missed": EXIT_MISSED, "undecided": EXIT_UNDECIDED}[assessment.verdict])


def levels(text: str) -> dict[str, float]:
    """`u1=40,y1=52.3` as numbers; u and y are u1 and y1.

    Raises:
        typer.BadParameter: The text is something else.
    """
    from inputdesign_cli.specification.yaml.scalars import plain_number

    found = {}
    for name, value in named(text, "--operating-point", "u1=40,y1=52.3").items():
        try:
            found[name] = plain_number(value)
        except ValueError:
            message = f"{value!r} is not a number, as in u1=40,y1=52.3"
            raise typer.BadParameter(message, param_hint="--operating-point") from None
    return found


def named(text: str, option: str, example: str) -> dict[str, str]:
    """`u1=a,y1=b` by channel; u, y and r are u1, y1 and r1.

    Raises:
        typer.BadParameter: A part has no `=`, or names nothing.
    """
    found = {}
    for part in filter(None, map(str.strip, text.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not (name and equals and value):
            raise typer.BadParameter(f"{part!r} is not of the form {example}", param_hint=option)
        if not _CHANNEL.fullmatch(name):
            message = (
                f"{name!r} is no channel: inputs are u1, u2, .., outputs y1, y2, .., references of a loop "
                f"r1, r2, .. (as in {example})"
            )
            raise typer.BadParameter(message, param_hint=option)
        channel = f"{name}1" if name in ("u", "y", "r") else name
        if channel in found:
            raise typer.BadParameter(f"{channel} stands there twice", param_hint=option)
        found[channel] = value
    return found


def preparation(
    columns: str,
    sample_time: float | None,
    time_unit: str | None,
    resample: bool,
    detrend: str,
    skip: int,
    span: str,
    without: Sequence[str] | None,
    data: Sequence[Path],
) -> Preparation:
    """What the options about `data` say.

    Raises:
        typer.BadParameter: One of them cannot be read.
    """
    from inputdesign_cli.records import DETRENDS, Preparation
    from inputdesign_cli.records.columns import TIME_UNITS

    if sample_time is not None and not 0.0 < sample_time < math.inf:
        raise typer.BadParameter("it is a positive number", param_hint="--sample-time")
    if time_unit is not None and time_unit not in TIME_UNITS:
        raise typer.BadParameter(f"it is one of {', '.join(TIME_UNITS)}", param_hint="--time-unit")
    return Preparation(
        columns=named(columns, "--columns", "u1=Heater 1,y1=4"),
        sample_time=sample_time,
        time_unit=time_unit,
        resample=resample,
        detrend=DETRENDS[detrend],
        skip=skip,
        span=_limits(span) if span else None,
        without=tuple(run for text in without or () for run in _runs(text, data)),
    )


def written(
    taken: Preparation, separator: str | None, decimal: str | None, time_format: str | None
) -> Preparation:
    """Return the preparation of files that are written as the options say.

    Raises:
        typer.BadParameter: One of them cannot be read.
    """
    if separator is not None and not (separator in ("tab", "\\t", "blank") or len(separator) == 1):
        raise typer.BadParameter("it is one character, or tab, or blank", param_hint="--sep")
    if separator is not None and (separator.isalnum() or separator in "\"'+-\r\n") and len(separator) == 1:
        raise typer.BadParameter("it is a mark that numbers do not have", param_hint="--sep")
    if decimal is not None and decimal not in (".", ","):
        raise typer.BadParameter("it is . or ,", param_hint="--decimal")
    if decimal is not None and decimal == separator:
        raise typer.BadParameter("it is the mark that separates columns, too", param_hint="--decimal")
    if time_format is not None and "%" not in time_format:
        raise typer.BadParameter("write it as in %d.%m.%Y %H:%M:%S", param_hint="--time-format")
    return replace(taken, separator=separator, decimal=decimal, time_format=time_format)


def _runs(text: str, data: Sequence[Path]) -> Iterator[Run]:
    """Rows as in 183-240,310, of several files with the name of one before each run.

    Raises:
        typer.BadParameter: A part is something else, or its file is not clear.
    """
    names = {str(path) for path in data} | {path.name for path in data}
    shared = {name for name, count in Counter(path.name for path in data).items() if count > 1}
    part = ""
    for piece in text.split(","):  # names of files may have commas, too
        part = f"{part},{piece}" if part else piece
        found = _ROWS.fullmatch(part)
        if found is None:
            continue
        name, rows, first, last = (found[1] or "").strip(), found[2], int(found[3]), int(found[4] or found[3])
        if last < first:
            message = f"{rows!r} ends before it begins: write {last}-{first}?"
            raise typer.BadParameter(message, param_hint="--without")
        if name in shared or (name not in names and (name or len(data) > 1)):
            message = f"which file {rows} are rows of is not clear: write {data[0]}:{rows}"
            raise typer.BadParameter(message, param_hint="--without")
        yield name, first, last
        part = ""
    if part or not text.strip():
        message = f"{part!r} names no rows: write 183-240, or 310 for one"
        raise typer.BadParameter(message, param_hint="--without")


def _limits(span: str) -> tuple[float, float]:
    begin, colon, end = span.partition(":")
    try:
        first, last = float(begin.strip() or "-inf"), float(end.strip() or "inf")
    except ValueError:
        first = last = math.nan
    if not colon or math.isnan(first) or math.isnan(last):
        message = f"{span!r} is not two times, as in 10:250; one may be left out, as in 10:"
        raise typer.BadParameter(message, param_hint="--range")
    if last < first:
        raise typer.BadParameter(
            f"it ends at {last:g}, before it begins at {first:g}: write {last:g}:{first:g}?",
            param_hint="--range",
        )
    return first, last
