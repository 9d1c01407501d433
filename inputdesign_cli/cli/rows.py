"""Options about data files: which column is what, which rows count, and what channels vary about."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from inputdesign_cli.cli.options import one_of

if TYPE_CHECKING:
    from inputdesign_cli.records import Preparation, Run

_ROWS = re.compile(r"(?:(.+):)?\s*((\d+)(?:\s*-\s*(\d+))?)\s*", re.DOTALL)
_CHANNEL = re.compile(r"[uyr]([1-9]\d*)?|time", re.ASCII)
DataFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA...",
        help="Records of experiments with columns u and y, estimated jointly: CSV, TSV, .mat, .npz, and with "
        "the extra data parquet and Excel.",
    ),
]
OperatingPoint = Annotated[
    str,
    typer.Option(
        "--operating-point",
        metavar="u1=..,y1=..",
        help="What channels vary about, as in u1=40,y1=52.3; it is subtracted. For inputs the default is "
        "signal.offset.",
    ),
]
Columns = Annotated[
    str,
    typer.Option(
        "--columns",
        metavar="u1=..,y1=..",
        help="Which column holds which channel, by name or number: u1=Heater 1,y1=4,time=1.",
    ),
]


Separator = Annotated[
    str | None,
    typer.Option(
        "--sep",
        metavar="MARK",
        help="What separates the columns of a text file: , ; tab blank or another mark.",
    ),
]
Decimal = Annotated[
    str | None, typer.Option("--decimal", metavar="MARK", help="The decimal mark of the file: . or ,")
]
TimeFormat = Annotated[
    str | None,
    typer.Option(
        "--time-format",
        metavar="FORM",
        help="How dates and times are written, as %d.%m.%Y %H:%M:%S or %Y%m%d%H%M%S.",
    ),
]


@dataclass(frozen=True)
class Levels:
    """What the channels of a record vary about."""

    remove_means: Annotated[
        bool, typer.Option("--remove-means", help="Take the means of u and y away (an operating point).")
    ] = False
    operating_point: OperatingPoint = ""

    @property
    def point(self) -> dict[str, float]:
        """The operating point by channel."""
        return levels(self.operating_point)


@dataclass(frozen=True)
class Written:
    """How a text file is written, where it does not show it, and which column is which."""

    columns: Columns = ""
    separator: Separator = None
    decimal: Decimal = None
    time_format: TimeFormat = None

    def preparation(self) -> Preparation:
        """Return what these options say about data files.

        Raises:
            typer.BadParameter: One of them cannot be read.
        """
        from inputdesign_cli.records import Preparation

        separator, decimal = self.separator, self.decimal
        if separator is not None and separator not in ("tab", "\\t", "blank"):
            if len(separator) != 1:
                raise typer.BadParameter("it is one character, or tab, or blank", param_hint="--sep")
            if separator.isalnum() or separator in "\"'+-\r\n":
                raise typer.BadParameter("it is a mark that numbers do not have", param_hint="--sep")
        if decimal is not None and decimal not in (".", ","):
            raise typer.BadParameter("it is . or ,", param_hint="--decimal")
        if decimal is not None and decimal == separator:
            raise typer.BadParameter("it is the mark that separates columns, too", param_hint="--decimal")
        if self.time_format is not None and "%" not in self.time_format:
            raise typer.BadParameter("write it as in %d.%m.%Y %H:%M:%S", param_hint="--time-format")
        columns = named(self.columns, "--columns", "u1=Heater 1,y1=4")
        return Preparation(
            columns=columns, separator=separator, decimal=decimal, time_format=self.time_format
        )


@dataclass(frozen=True)
class Rows(Written):
    """How the rows of data files become samples."""

    sample_time: Annotated[
        float | None,
        typer.Option(
            "--sample-time", metavar="T", help="Time between rows, where the file does not have it."
        ),
    ] = None
    time_unit: Annotated[
        str | None,
        typer.Option("--time-unit", metavar="UNIT", help="Of the times in the file: s, ms, us, min, h or d."),
    ] = None
    resample: Annotated[
        bool,
        typer.Option(
            "--resample",
            help="Even out times that jitter by more than 25 % of the sample time, too; join columns that "
            "were written at different times.",
        ),
    ] = False
    detrend: Annotated[
        str,
        one_of(
            ("none", "constant", "linear", "auto"), "What to take away from every signal, segment by segment"
        ),
    ] = "none"
    skip: Annotated[
        int,
        typer.Option("--skip", metavar="N", min=0, help="Leave out the first N rows of data of every file."),
    ] = 0
    span: Annotated[
        str, typer.Option("--range", metavar="FROM:TO", help="Keep rows whose times lie between these two.")
    ] = ""
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            metavar="ROWS",
            help="Leave out these rows, as notes number them, as in 183-240,310; the record is cut there. Of "
            "several files: log1.csv:183-240. Repeatable.",
        ),
    ] = None

    def of(self, data: Sequence[Path]) -> Preparation:
        """Return what the options say about data files.

        Raises:
            typer.BadParameter: One of them cannot be read.
        """
        from inputdesign_cli.records import DETRENDS
        from inputdesign_cli.records.columns import TIME_UNITS

        if self.sample_time is not None and not 0.0 < self.sample_time < math.inf:
            raise typer.BadParameter("it is a positive number", param_hint="--sample-time")
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise typer.BadParameter(f"it is one of {', '.join(TIME_UNITS)}", param_hint="--time-unit")
        return replace(
            self.preparation(),
            sample_time=self.sample_time,
            time_unit=self.time_unit,
            resample=self.resample,
            detrend=DETRENDS[self.detrend],
            skip=self.skip,
            span=_limits(self.span) if self.span else None,
            without=tuple(run for text in self.without or () for run in _runs(text, data)),
        )


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
