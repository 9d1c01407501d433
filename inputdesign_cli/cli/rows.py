"""Options about data files: roles of columns, rows that count, and levels about which channels vary."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NoReturn

import typer

if TYPE_CHECKING:
    from inputdesign_cli.records import Preparation, Run

_ROWS = re.compile(r"(?:(.+):)?\s*((\d+)(?:\s*-\s*(\d+))?)\s*", re.DOTALL)
_CHANNEL = re.compile(r"[uyr]([1-9]\d*)?|time", re.ASCII)
TimeUnit = Literal["s", "ms", "us", "min", "h", "d"]


@dataclass(frozen=True)
class Levels:
    """Holds the levels about which the channels of a record vary."""

    remove_means: bool = False
    operating_point: str = ""

    @property
    def point(self) -> dict[str, float]:
        """Return the operating point by channel."""
        return levels(self.operating_point)


@dataclass(frozen=True)
class Written:
    """Describes the format of a text file, as far as it does not show it itself, and the roles of columns."""

    columns: str = ""
    separator: str | None = None
    decimal: Literal[".", ","] | None = None
    time_format: str | None = None

    def preparation(self) -> Preparation:
        """Return the preparation of data files by these options.

        Raises:
            typer.BadParameter: One of them cannot be read.
        """
        from inputdesign_cli.records import Preparation

        mark = self.separator
        if mark is not None and mark not in ("tab", "\\t", "blank"):
            if len(mark) != 1 or mark.isalnum() or mark in "\"'+-\r\n":
                refuse("it is tab, blank, or one mark that numbers do not have", "--sep")
            if self.decimal == mark:
                refuse("it is the mark that separates columns, too", "--decimal")
        if self.time_format is not None and "%" not in self.time_format:
            refuse("write it as in %d.%m.%Y %H:%M:%S", "--time-format")
        columns = _named(self.columns, "--columns", "u1=Heater 1,y1=4")
        return Preparation(
            columns=columns, separator=mark, decimal=self.decimal, time_format=self.time_format
        )


@dataclass(frozen=True)
class Rows(Written):
    """Describes how the rows of data files become samples."""

    sample_time: float | None = None
    time_unit: TimeUnit | None = None
    resample: bool = False
    detrend: Literal["none", "constant", "linear", "auto"] = "none"
    skip: int = 0
    span: str = ""
    without: list[str] | None = None

    def of(self, data: Sequence[Path]) -> Preparation:
        """Return the preparation of data files by the options.

        Raises:
            typer.BadParameter: One of them cannot be read.
        """
        if self.sample_time is not None and not 0.0 < self.sample_time < math.inf:
            refuse("it is a positive number", "--sample-time")
        return replace(
            self.preparation(),
            sample_time=self.sample_time,
            time_unit=self.time_unit,
            resample=self.resample,
            detrend=self.detrend,
            skip=self.skip,
            span=span(self.span, "--range", "FROM:TO") if self.span else None,
            without=tuple(run for text in self.without or () for run in _runs(text, data)),
        )


def refuse(why: str, option: str) -> NoReturn:
    """Refuse the value of an option.

    Raises:
        typer.BadParameter: always.
    """
    raise typer.BadParameter(why, param_hint=option)


def span(text: str, option: str, form: str) -> tuple[float, float]:
    """Return the two numbers of `10:250`; an end that is left out, as in `10:`, is infinite.

    Raises:
        typer.BadParameter: The text is something else.
    """
    first, colon, last = text.partition(":")
    try:
        low, high = float(first.strip() or "-inf"), float(last.strip() or "inf")
    except ValueError:
        low = high = math.nan
    if not colon or math.isnan(low) or math.isnan(high):
        refuse(f"{text!r} is not of the form {form}, as in 0.1:2", option)
    if high < low:
        refuse(f"{text!r} ends before it begins: write {last.strip()}:{first.strip()}?", option)
    return low, high


def levels(text: str) -> dict[str, float]:
    """Parse `u1=40,y1=52.3` as numbers by channel; u and y are u1 and y1.

    Raises:
        typer.BadParameter: The text is something else.
    """
    from inputdesign_cli.specification.yaml.scalars import plain_number

    found, option, example = {}, "--operating-point", "u1=40,y1=52.3"
    for name, value in _named(text, option, example).items():
        try:
            found[name] = plain_number(value)
        except ValueError:
            rest = ": in its place goes the mean at rest, before the experiment" * (value.upper() == "REST")
            refuse(f"{value!r} is not a number, as in {example}{rest}", option)
    return found


def _named(text: str, option: str, example: str) -> dict[str, str]:
    """Parse `u1=a,y1=b` by channel, or raise `typer.BadParameter`; u, y and r are u1, y1 and r1."""
    found: dict[str, str] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not (name and equals and value):
            refuse(f"{part!r} is not of the form {example}", option)
        if not _CHANNEL.fullmatch(name):
            kinds = "inputs are u1, u2, .., outputs y1, y2, .., references of a loop r1, r2, .."
            refuse(f"{name!r} is no channel: {kinds} (as in {example})", option)
        channel = f"{name}1" if name in ("u", "y", "r") else name
        if channel in found:
            refuse(f"{channel} stands there twice", option)
        found[channel] = value
    return found


def _runs(text: str, data: Sequence[Path]) -> Iterator[Run]:
    """Parse rows as in 183-240,310, or raise `typer.BadParameter`; one of several files is named first."""
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
            refuse(f"{rows!r} ends before it begins: write {last}-{first}?", "--without")
        if name in shared or (name not in names and (name or len(data) > 1)):
            refuse(f"which file {rows} are rows of is not clear: write {data[0]}:{rows}", "--without")
        yield name, first, last
        part = ""
    if part or not text.strip():
        refuse(f"{part!r} names no rows: write 183-240, or 310 for one", "--without")
