"""Columns of numbers with their names, whatever file they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError, Diagnostic, Location
from inputdesign_cli.tasks.build.files.pace import Pace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """Numbers (n,), NaN where a cell is empty; `fault` is the first row with something else, and its text.

    Dates and times are `dated`: seconds since the first, which `began` counts from a moment that columns of a
    file have in common; of times of a day without a date, `clock` is what the first counts from midnight. Of
    dates that cannot be read all or some are `undated`. What is `wrong` with a fault, and how to mend it,
    goes into messages; `told` is what was done to make times of a column. `words` are the different texts of
    one that holds no number.
    """

    numbers: Array
    fault: tuple[int, str] | None = None
    dated: bool = False
    wrong: str = "is not a finite number"
    hint: str = (
        "write plain numbers such as -1234.5: digits 0 to 9, a decimal point, nothing between thousands, one "
        "row a line; dates as 2024-03-12 10:15:00; leave a cell empty where there is no value, and write 1 "
        "and 0 for ON and OFF"
    )
    clock: float | None = None
    undated: bool = False
    began: float = 0.0
    told: str = ""
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sheet:
    """What a file holds.

    Attributes:
        path, key: of the file, and the key of the spec that names it.
        names: of the columns; empty where the file has none.
        columns: as many as names, or as each row has fields.
        lines: (n,) of the text file, or of rows counted from one.
        head: line and text of the header, for diagnostics.
        texts: what the rows say, for diagnostics; empty where a file is no text.
        shown: whether messages may show what the file holds: it is a table of numbers, and no secret.
        pace: the sample time and its unit, as the file says itself.
        left_out: what the file holds besides that is no column, and what it holds instead of numbers.
        others: sheets of the workbook that were not read, where none was named.
        passed: lines between rows of numbers that are no rows, and what they are: see `layout`.
    """

    path: Path
    key: str
    names: tuple[str, ...]
    columns: tuple[Column, ...]
    lines: NDArray[np.int64]
    head: tuple[int, str] = (1, "")
    texts: Sequence[str] = ()
    shown: bool = True
    pace: Pace = field(default_factory=Pace)
    passed: tuple[tuple[int, str], ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)
    others: tuple[str, ...] = ()

    @property
    def header(self) -> list[str]:
        """The names in small letters."""
        return [name.strip().lower() for name in self.names]

    @property
    def contents(self) -> str:
        """The names, and what is no column, for messages; nothing where they may not be shown."""
        if not self.shown:
            return ""
        told = [f"its header is: {', '.join(name.strip() for name in self.names)}"] if self.names else []
        told += [f"{name} holds {what}" for name, what in self.left_out.items()]
        return "; ".join(told)

    def error(self, code: str, message: str, hint: str, row: int | None = None) -> Diagnostic:
        """A diagnostic that points at a row, or at the header; what is missing may be in another sheet."""
        if code == "data-missing-column":
            hint += elsewhere(self.path, self.others)
        line, text = self.head
        if row is not None:
            line, text = int(self.lines[row]), self.texts[row] if self.texts else ""
        return Diagnostic(
            code, message, hint, self.key, Location(str(self.path), line, 1, text if self.shown else "")
        )


def unreadable(path: Path, key: str, what: str, hint: str, line: int | None = None) -> DataError:
    """The error about a file that cannot be read at all, in a line of it where one is at fault."""
    location = None if line is None else Location(str(path), line, 1)
    return DataError.because("data-unreadable", f"the file {path} {what}", hint, key, location)


def elsewhere(path: Path, others: Sequence[str]) -> str:
    """What messages say of sheets of a workbook that were not read."""
    if not others:
        return ""
    listed = ", ".join(others)
    return f"; only the first sheet was read, beside it stand {listed}: name one as '{path.name}#{others[0]}'"
