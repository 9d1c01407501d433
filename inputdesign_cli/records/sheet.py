"""How a record is to be read and prepared, and what a file holds: columns of numbers with their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic, Location

Detrend = Literal["none", "constant", "linear", "auto"]
Run = tuple[str, int, int]
"""Name of a file, first and last row; the name is empty if there is only one file."""
_PLAIN = (
    "write plain numbers like -1234.5: digits 0 to 9, a decimal point, nothing between thousands; leave "
    "a cell empty where there is no value, and write 1 and 0 for ON and OFF"
)


@dataclass(frozen=True)
class Preparation:
    """Describes how a record is to be read and prepared.

    Attributes:
        columns: channel (`u1`, `y1`, `time`) -> name or number of its column.
        sample_time, time_unit: as the user states them; None: the file decides.
        resample: whether times that jitter more than usual are made even, and columns of other times joined.
        detrend: the trend to subtract from the signals of every segment; `auto`: a line if it explains much.
        skip: rows to leave out at the beginning.
        span: the range of times to keep, in the unit of the file.
        without: rows to leave out, as findings number them; the record is cut there.
        operating_point: the levels to subtract if no trend is, by channel.
        separator, decimal, time_format: how the file is written.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    sample_time: float | None = None
    time_unit: str | None = None
    resample: bool = False
    detrend: Detrend = "none"
    skip: int = 0
    span: tuple[float, float] | None = None
    without: tuple[Run, ...] = ()
    operating_point: Mapping[str, float] = field(default_factory=dict)
    separator: str | None = None
    decimal: str | None = None
    time_format: str | None = None

    @property
    def levels(self) -> Mapping[str, float]:
        """Return the levels taken away, by channel: the operating point, unless trends are removed."""
        return self.operating_point if self.detrend == "none" else {}


@dataclass(frozen=True)
class Source:
    """Names a data file, the key of the spec that refers to it, and the format that the user states.

    `others` are sheets of the workbook that were not read, where none was named.
    """

    path: Path
    key: str = ""
    given: Preparation = field(default_factory=Preparation)
    others: tuple[str, ...] = ()

    @property
    def or_sheet(self) -> str:
        """Return what a hint adds where a workbook has further sheets."""
        example = f"'{self.path.name}#{self.others[0]}'" if self.others else ""
        return f"; only the first sheet was read: name one as {example}" if self.others else ""

    def unreadable(self, what: str, hint: str, line: int | None = None) -> DataError:
        """Return the error about a file that cannot be read at all, or not from some line on."""
        location = None if line is None else Location(str(self.path), line, 1)
        message = f"the file {self.path} {what}"
        return DataError.because("data-unreadable", message, hint + self.or_sheet, self.key, location)


@dataclass(frozen=True)
class Column:
    """Holds the numbers (n,) of a column, NaN where a cell is empty.

    Attributes:
        fault: the first row that holds something else, and its text; `wrong` and `hint` are for the message.
        dated: whether the cells hold dates or times; the numbers are seconds since the first.
        done: descriptions of how times were made of the cells.
    """

    numbers: Array
    fault: tuple[int, str] | None = None
    wrong: str = "is not a finite number"
    hint: str = _PLAIN
    dated: bool = False
    done: tuple[str, ...] = ()

    def mostly(self, *, rises: bool) -> bool:
        """Return whether nine tenths of the numbers rise from row to row, or at least change."""
        steps = np.diff(self.numbers[~np.isnan(self.numbers)])
        return bool(np.mean(steps > 0.0 if rises else steps != 0.0) > 0.9) if steps.size else False


@dataclass(frozen=True)
class Sheet:
    """Holds the content of a data file.

    Attributes:
        names: the names of the columns; empty if the file has none.
        lines: (n,), line numbers of the rows in a text file, otherwise row numbers from one.
        head: line and text of the header; `texts` are the texts of the rows, for diagnostics.
        shown: whether messages may quote the file, since most of it is numbers.
        passed: blank lines and rows that are commented out, between rows of numbers.
        sample_time, time_unit: stated by the file itself.
    """

    source: Source
    names: tuple[str, ...]
    columns: tuple[Column, ...]
    lines: NDArray[np.int64]
    head: tuple[int, str] = (1, "")
    texts: Sequence[str] = ()
    shown: bool = True
    passed: tuple[int, ...] = ()
    sample_time: float | None = None
    time_unit: str | None = None

    @property
    def path(self) -> Path:
        """Return the path of the file."""
        return self.source.path

    @property
    def header(self) -> list[str]:
        """Return the names in small letters."""
        return [name.strip().lower() for name in self.names]

    def name_of(self, at: int) -> str:
        """Return the name of a column, or its number."""
        return (self.names[at].strip() if at < len(self.names) else "") or f"column {at + 1}"

    def error(self, code: str, message: str, hint: str, row: int | None = None) -> DataError:
        """Return the error that points at a row, or at the header."""
        hint += self.source.or_sheet if code == "data-missing-column" else ""
        line, text = self.head
        if row is not None:
            line, text = int(self.lines[row]), self.texts[row] if self.texts else ""
        if not self.shown:  # it may be secret
            text, message = "", f"{self.path.name} is no table of numbers: most of its cells are text"
            hint = "keep the columns of numbers, or say which they are: --columns u1=2,y1=3"
        place = Location(str(self.path), line, 1, text)
        return DataError(Diagnostic(code, message, hint, self.source.key, place))
