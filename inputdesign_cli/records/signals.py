"""The signals in the columns of a file: within the range of arithmetic, at times that increase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.outlying_values import beyond_precision
from inputdesign_cli.findings.prepared_records import TIMES_READ, sheets_unread
from inputdesign_cli.records.columns import (
    TIME_UNITS,
    called,
    channel_columns,
    column_named,
    columns_of,
    rising,
    time_column,
    time_unit_in,
)
from inputdesign_cli.records.moments import SAY, form_of_digits
from inputdesign_cli.records.preparation import Preparation, Run
from inputdesign_cli.records.sheet import Sheet

# Steps of time differ from a round number by less than this share of it by rounding alone.
_ROUND = 1e-4
_SINCE_1970 = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
# Counts of these years: a count in one unit is out of range in any other, and as seconds lies millennia away.
_FIRST, _LAST = (datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (2000, 2100))


@dataclass(frozen=True)
class Signals:
    """What stands in the columns of a file: u (n, m), y (n, p), NaN where a number is missing.

    Attributes:
        time: (n,), counted in sample times where the file has none; `name` is that of its column, if any.
        unit: of the times, if the file or the user says it; `dated`: they are dates, counted in seconds.
        inputs, outputs: what findings call the columns of u and y.
        without: (n,), rows that are to be left out.
        findings: what was done to read them.
    """

    sheet: Sheet
    time: Array
    name: str
    unit: str | None
    dated: bool
    u: Array
    y: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    without: NDArray[np.bool_]
    findings: tuple[Finding, ...] = ()

    def at(self, rows: NDArray[np.int64]) -> Signals:
        """Return some of the rows."""
        texts = [self.sheet.texts[i] for i in rows.tolist()] if self.sheet.texts else ()
        sheet = replace(self.sheet, lines=self.sheet.lines[rows], texts=texts)
        u, y, time = self.u[rows], self.y[rows], self.time[rows]
        return replace(self, sheet=sheet, time=time, u=u, y=y, without=self.without[rows])


def signals_of(
    sheet: Sheet, inputs: int, outputs: int, preparation: Preparation, references: Mapping[str, str]
) -> Signals:
    """Return the columns of the channels; the columns of `references` follow the inputs, by their labels.

    Raises:
        DataError: a column is missing, holds text or nothing, or leaves the range of arithmetic; the times
            do not increase, or cannot be read.
    """
    name = time_column(sheet, preparation.columns)
    u, y = (channel_columns(*one, sheet, preparation.columns) for one in (("u", inputs), ("y", outputs)))
    wanted = {**u, **y, **references, **({"time": name} if name else {})}
    found = columns_of(sheet, wanted)
    for role, numbers in found.items():
        if np.isnan(numbers).all():
            message = f"the column {wanted[role]} holds no number"
            hint = "is it another column? A workbook holds values of formulas once a spreadsheet saved it"
            raise sheet.error("data-not-a-number", message, hint, 0)
    time, unit, dated, findings = _times(sheet, found.get("time"), name, preparation)
    kept = Signals(
        sheet,
        time,
        name,
        unit,
        dated,
        np.column_stack([found[role] for role in (*u, *references)]),
        np.column_stack([found[role] for role in y]),
        (*(("u",) if inputs == 1 else u), *references),
        ("y",) if outputs == 1 else tuple(y),
        _left_out(sheet, preparation.without),
        (*findings, *sheets_unread(sheet.path.name, sheet.others)),
    ).at(_rows(sheet, time, preparation, timed=bool(name)))
    for role, x in zip((*u, *references, *y), (*kept.u.T, *kept.y.T), strict=True):
        values = np.where(kept.without, np.nan, x)
        if not np.isnan(values).all():
            check_range(kept.sheet, wanted[role], values)
    if name:
        _check_rising(kept.sheet, kept.time)
    return kept


def _times(
    sheet: Sheet, time: Array | None, name: str, preparation: Preparation
) -> tuple[Array, str | None, bool, list[Finding]]:
    """Times (n,), their unit, whether they are dates, and what was done to read them."""
    if time is None:
        unit = _unit(sheet, "", preparation.time_unit, dated=False)
        return np.arange(len(sheet.lines), dtype=float), unit, False, []
    column = column_named(sheet, name)
    findings = [TIMES_READ.found(f"{done}.", where=name) for done in column.done]
    unit = _unit(sheet, name, preparation.time_unit, dated=column.dated)
    if column.dated or unit:
        return time, unit, column.dated, findings
    there = time[~np.isnan(time)]
    form, what = form_of_digits(there)
    if form:
        message = f"{there[0]:.17g} in column {name} looks like a {what} in digits"
        hint = f"{SAY}; here perhaps --time-format {form}; if it counts, say in what: --time-unit s"
        raise sheet.error("data-not-a-number", message, hint, int(np.flatnonzero(~np.isnan(time))[0]))
    for what, a_second in _SINCE_1970.items():
        if a_second * _FIRST <= there.min() and there.max() <= a_second * _LAST:
            begun = datetime.fromtimestamp(there[0] / a_second, UTC)
            said = f"{name} counts {what} since 1970. The first is {begun:%Y-%m-%d %H:%M:%S} UTC."
            read = TIMES_READ.found(said, where=name, begun=begun.isoformat())
            return (time - there[0]) / a_second, "s", True, [*findings, read]
    return time, None, False, findings


def _unit(sheet: Sheet, name: str, said: str | None, *, dated: bool) -> str | None:
    """The unit of the times in column `name`, by the option, the column or the file; None if unknown."""
    own = time_unit_in(sheet, name, dated=dated)
    if own is None and sheet.time_unit and said is None:
        message = (
            f"{sheet.path.name} states its times in {sheet.time_unit!r}, none of {', '.join(TIME_UNITS)}"
        )
        raise sheet.error("data-wrong-unit", message, "say which it is: --time-unit s")
    if said is not None and own is not None and own != said:
        holds = "holds dates, which are counted in s" if dated else f"states its times in {own}"
        message = f"{sheet.path.name} {holds}, and --time-unit says {said}"
        hint = "leave --time-unit out: it only says what the times are counted in; or correct the file"
        raise sheet.error("data-wrong-unit", message, hint)
    return said or own


def _rows(sheet: Sheet, time: Array, preparation: Preparation, *, timed: bool) -> NDArray[np.int64]:
    """The rows that --skip and --range keep."""
    scaled = time if timed else time * (preparation.sample_time or sheet.sample_time or 1.0)
    rows = np.arange(min(preparation.skip, len(sheet.lines)), len(sheet.lines))
    if preparation.span is not None:
        begin, end = preparation.span
        rows = rows[(scaled[rows] >= begin) & (scaled[rows] <= end)]
    if rows.size:
        return rows
    hint = f"--skip {preparation.skip} leaves them all out"
    if preparation.skip < len(sheet.lines):
        hint = (
            f"its times run from {np.nanmin(scaled):.6g} to {np.nanmax(scaled):.6g}: mind --skip and --range"
        )
    message = f"nothing is left of the {len(sheet.lines)} rows of {sheet.path.name}"
    raise DataError.because("data-unreadable", message, hint, "", Location(str(sheet.path), 1, 1))


def _left_out(sheet: Sheet, runs: Sequence[Run]) -> NDArray[np.bool_]:
    """Which rows (n,) of a sheet are among the runs that name its file, or none."""
    found = np.zeros(len(sheet.lines), dtype=bool)
    for _, first, last in (run for run in runs if run[0] in ("", sheet.path.name, str(sheet.path))):
        inside = (sheet.lines >= first) & (sheet.lines <= last)
        if not np.any(inside):
            message = f"{sheet.path.name} has no row from {first} to {last}, which --without is to leave out"
            hint = f"its rows of numbers are lines {sheet.lines[0]} to {sheet.lines[-1]}, the header counted"
            raise DataError.because("data-unreadable", message, hint, "", Location(str(sheet.path), 1, 1))
        found |= inside
    return found


def _check_rising(sheet: Sheet, time: Array) -> None:
    """Raise `DataError` (`data-not-uniform`) if a time (n,) is not later than the one before."""
    there = np.flatnonzero(~np.isnan(time))
    wrong = np.flatnonzero(np.diff(time[there]) <= 0.0)
    if not wrong.size:
        return
    before, row = there[wrong[0]], there[wrong[0] + 1]
    follows = f"{time[before]:.10g} is followed by {time[row]:.10g}"
    hint = "sort the rows, keep one row of each time, or write times with more digits; if the rows are even, "
    hint += "add time=none to --columns, and --sample-time"
    other = [called(sheet, at) for at in rising(sheet)]
    if other:
        hint += f"; or is the time in column {other[0]}, which rises? Then --columns time={other[0]}"
    message = f"the times of {sheet.path.name} do not increase: {follows}"
    raise sheet.error("data-not-uniform", message, hint, int(row))


def typical_step(time: Array) -> float:
    """Return the mean step of time, gaps apart, rounded where rounding alone may be the difference."""
    steps = np.diff(time[~np.isnan(time)])
    middle = float(np.median(steps)) if steps.size else 0.0
    near = steps[np.abs(steps - middle) < 0.5 * abs(middle)]
    if middle <= 0.0 or not near.size:
        return np.nan
    mean = float(near.mean())
    rounded = (float(f"{mean:.{digits}e}") for digits in range(6))
    return next((value for value in rounded if abs(value - mean) <= _ROUND * mean), mean)


def check_range(sheet: Sheet, name: str, x: Array) -> None:
    """Check that squares of a signal x (n,) stay within double precision, relative to each other too.

    Raises:
        DataError: `beyond-precision`.
    """
    fault = beyond_precision(name, x)
    if fault is not None:
        row, message, hint = fault
        if not sheet.key:
            hint += f"; if it is a fault of measurement, --without {sheet.lines[row]} leaves its row out"
        raise sheet.error("beyond-precision", message, hint, row)
