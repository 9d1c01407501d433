"""The signals in the columns of a file: within the range of arithmetic, at times that increase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.outlying_values import beyond_precision
from inputdesign_cli.findings.places import SHORTEST
from inputdesign_cli.findings.prepared_records import COLUMNS_JOINED, SHEETS_UNREAD, TIMES_READ
from inputdesign_cli.records.cells import SAY_TIME, is_date_in_digits
from inputdesign_cli.records.columns import TIME_UNITS, called, column_named, columns_of, rising, time_unit_in
from inputdesign_cli.records.sheet import Preparation, Run, Sheet

# Steps of time differ from a round number by less than this share of it by rounding alone.
_EVEN_STEPS = 0.01  # the share by which even steps differ as times are rounded
_ROUND = 1e-4
# Steps of two lengths, which differ by this share at least, come from rounding where no time is farther
# from a line than this share of their difference. Fewer steps of one length are gaps.
_COARSE, _ROUNDED_OFF, _BOTH = 0.1, 0.75, 3
_SINCE_1970 = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
# Counts of these years: a count in one unit is out of range in any other, and as seconds lies millennia away.
_FIRST, _LAST = (datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (2000, 2100))
# Rows count unchanged where this share of the whole ones stands in long stretches, or, of short records,
# where this share is whole.
_KEPT, _FEW, _SHORT = 0.25, 0.5, 2 * SHORTEST
# Steps of an output that are longer, in its own, are gaps.
_OWN_GAP, _NEARLY, _MOSTLY = 3.0, 1.1, 0.95


@dataclass(frozen=True)
class Signals:
    """Holds the columns of a file: u (n, m), y (n, p), NaN where a number is missing.

    Attributes:
        time: (n,), counted in sample times where the file has none; `name` is that of its column, if any.
        unit: of the times, if the file or the user says it; `dated`: they are dates, counted in seconds.
        names: what findings call the columns of u, the last of which may be references, and of y.
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
    names: tuple[str, ...]
    without: NDArray[np.bool_]
    findings: tuple[Finding, ...] = ()

    def at(self, rows: NDArray[np.int64]) -> Signals:
        """Return the signals in some of the rows."""
        texts = [self.sheet.texts[i] for i in rows.tolist()] if self.sheet.texts else ()
        sheet = replace(self.sheet, lines=self.sheet.lines[rows], texts=texts)
        u, y, time = self.u[rows], self.y[rows], self.time[rows]
        return replace(self, sheet=sheet, time=time, u=u, y=y, without=self.without[rows])


def signals_of(sheet: Sheet, roles: Mapping[str, str], preparation: Preparation) -> Signals:
    """Return the columns of the roles u1, .., r1, .., y1, .. and time; references follow the inputs.

    Raises:
        DataError: a column is missing, holds text or nothing, or leaves the range of arithmetic; the times
            do not increase, or cannot be read.
    """
    name = roles.get("time", "")
    found = columns_of(sheet, roles)
    for role, numbers in found.items():
        if np.isnan(numbers).all():
            message = f"the column {roles[role]} holds no number"
            hint = "is it another column? A workbook holds values of formulas once a spreadsheet saved it"
            raise sheet.error("data-not-a-number", message, hint, 0)
    time, unit, dated, findings = _times(sheet, found.get("time"), name, preparation)
    own = {letter: [role for role in roles if role[0] == letter] for letter in "ury"}
    ordered = [*own["u"], *own["r"], *own["y"]]
    single = {f"{letter}1": letter for letter in "uy" if len(own[letter]) == 1}
    others = f"read {sheet.path.name}#NAME for one of {', '.join(sheet.others)}"
    kept = Signals(
        sheet,
        time,
        name,
        unit,
        dated,
        np.column_stack([found[role] for role in ordered[: -len(own["y"])]]),
        np.column_stack([found[role] for role in own["y"]]),
        tuple(single.get(role, role) for role in ordered),
        _left_out(sheet, preparation.without),
        (*findings, *SHEETS_UNREAD.when(sheet.others, others, sheets=list(sheet.others))),
    ).at(_rows(sheet, time, preparation, timed=bool(name)))
    for role, x in zip(ordered, (*kept.u.T, *kept.y.T), strict=True):
        values = np.where(kept.without, np.nan, x)
        if not np.isnan(values).all():
            check_range(kept.sheet, roles[role], values)
    if name:
        _check_rising(kept.sheet, kept.time)
        kept = _at_even_times(kept)
    return kept


def _times(
    sheet: Sheet, time: Array | None, name: str, preparation: Preparation
) -> tuple[Array, str | None, bool, list[Finding]]:
    """Return times (n,), their unit, whether they are dates, and what was done to read them."""
    if time is None:
        unit = _unit(sheet, "", preparation.time_unit, dated=False)
        return np.arange(len(sheet.lines), dtype=float), unit, False, []
    column = column_named(sheet, name)
    findings = [TIMES_READ.found(done, where=name) for done in column.done]
    unit = _unit(sheet, name, preparation.time_unit, dated=column.dated)
    if column.dated or unit:
        return time, unit, column.dated, findings
    there = time[~np.isnan(time)]
    if is_date_in_digits(there):
        message = f"{there[0]:.17g} in column {name} looks like a date in digits"
        hint = (
            f"{SAY_TIME}; here perhaps --time-format %Y%m%d%H%M%S; if it counts, say in what: --time-unit s"
        )
        raise sheet.error("data-not-a-number", message, hint, int(np.flatnonzero(~np.isnan(time))[0]))
    for what, a_second in _SINCE_1970.items():
        if a_second * _FIRST <= there.min() and there.max() <= a_second * _LAST:
            begun = datetime.fromtimestamp(there[0] / a_second, UTC)
            fact = f"{name} counts {what} since 1970, from {begun:%Y-%m-%d %H:%M:%S} UTC on"
            read = TIMES_READ.found(fact, where=name, begun=begun.isoformat())
            return (time - there[0]) / a_second, "s", True, [*findings, read]
    return time, None, False, findings


def _unit(sheet: Sheet, name: str, said: str | None, *, dated: bool) -> str | None:
    """Return the unit of the times in column `name`, by option, column or file; None if unknown."""
    own, units = time_unit_in(sheet, name, dated=dated), ", ".join(TIME_UNITS)
    if own is None and sheet.time_unit and said is None:
        message = f"{sheet.path.name} states its times in {sheet.time_unit!r}, none of {units}"
        raise sheet.error("data-wrong-unit", message, "say which it is: --time-unit s")
    if said is not None and own is not None and own != said:
        holds = "holds dates, which are counted in s" if dated else f"states its times in {own}"
        message = f"{sheet.path.name} {holds}, and --time-unit says {said}"
        hint = "leave --time-unit out: it only says what the times are counted in; or correct the file"
        raise sheet.error("data-wrong-unit", message, hint)
    return said or own


def _rows(sheet: Sheet, time: Array, preparation: Preparation, *, timed: bool) -> NDArray[np.int64]:
    """Return the rows that --skip and --range keep."""
    scaled = time if timed else time * (preparation.sample_time or sheet.sample_time or 1.0)
    kept = np.arange(len(time)) >= preparation.skip
    if preparation.span is not None:
        begin, end = preparation.span
        kept &= (scaled >= begin) & (scaled <= end)
    if not np.any(kept):
        message = f"nothing is left of the {len(time)} rows of {sheet.path.name}"
        hint = f"--skip {preparation.skip} leaves them all out"
        if preparation.skip < len(time):
            hint = f"its times run from {np.nanmin(scaled):.6g} to {np.nanmax(scaled):.6g}: mind --range"
        raise sheet.error("data-unreadable", message, hint)
    return np.flatnonzero(kept)


def _left_out(sheet: Sheet, runs: Sequence[Run]) -> NDArray[np.bool_]:
    """Return the mask (n,) of the rows of a sheet in runs that name its file, or no file."""
    found = np.zeros(len(sheet.lines), dtype=bool)
    for _, first, last in (run for run in runs if run[0] in ("", sheet.path.name, str(sheet.path))):
        inside = (sheet.lines >= first) & (sheet.lines <= last)
        if not np.any(inside):
            message = f"{sheet.path.name} has no row from {first} to {last}, which --without is to leave out"
            hint = f"its rows of numbers are lines {sheet.lines[0]} to {sheet.lines[-1]}, the header counted"
            raise sheet.error("data-unreadable", message, hint)
        found |= inside
    return found


def _check_rising(sheet: Sheet, time: Array) -> None:
    """Raise `DataError` (`data-not-uniform`) if a time (n,) is not later than the one before."""
    there = np.flatnonzero(~np.isnan(time))
    wrong = np.flatnonzero(np.diff(time[there]) <= 0.0)
    if not wrong.size:
        return
    before, row = there[wrong[0]], there[wrong[0] + 1]
    hint = (
        "sort the rows, keep one row of each time, or write times with more digits; if the rows are even, "
        "add time=none to --columns, and --sample-time"
    )
    other = [called(sheet, at) for at in rising(sheet)]
    hint += f"; or is the time in column {other[0]}? Then --columns time={other[0]}" if other else ""
    message = f"the times of {sheet.path.name} do not increase: {time[before]:.10g} is followed by "
    raise sheet.error("data-not-uniform", f"{message}{time[row]:.10g}", hint, int(row))


def _at_even_times(signals: Signals) -> Signals:
    """Return the signals at even times, where the times of the file differ from a line by rounding alone.

    Times in days with five decimals take two lengths of steps at a sample time of a second.
    """
    time, rows = signals.time, np.arange(len(signals.time))
    if len(time) < SHORTEST or np.isnan(time).any():
        return signals
    steps = np.diff(time)
    digit = float(np.ptp(steps))
    longer = steps > 0.5 * float(steps.min() + steps.max())
    alike = _EVEN_STEPS * min(digit, float(steps.min()))
    two = all(own.size >= _BOTH and float(np.ptp(own)) <= alike for own in (steps[longer], steps[~longer]))
    if not two or digit <= _COARSE * float(steps.max()):
        return signals
    line = np.polynomial.Polynomial.fit(rows, time, 1)
    even = np.asarray(line(rows), dtype=float)
    if float(np.abs(time - even).max()) > _ROUNDED_OFF * digit:
        return signals
    fact = f"{signals.name} is rounded to {digit:.3g}, and its rows are {line.deriv()(0.0):.6g} apart"
    read = TIMES_READ.found(fact, where=signals.name, rounded=digit)
    return replace(signals, time=even, findings=(*signals.findings, read))


def typical_step(time: Array) -> float:
    """Return the mean step of time without gaps, rounded where the difference may be rounding."""
    steps = np.diff(time[~np.isnan(time)])
    middle = float(np.median(steps)) if steps.size else 0.0
    near = steps[np.abs(steps - middle) < 0.5 * abs(middle)]
    if middle <= 0.0 or not near.size:
        return np.nan
    mean = float(near.mean())
    rounded = (float(f"{mean:.{digits}e}") for digits in range(6))
    return next((value for value in rounded if abs(value - mean) <= _ROUND * mean), mean)


def is_even(time: Array) -> bool:
    """Return whether the steps of time without gaps are all alike, to rounding of the times."""
    steps = np.diff(time[~np.isnan(time)])
    middle = float(np.median(steps)) if steps.size else 0.0
    near = steps[np.abs(steps - middle) < 0.5 * abs(middle)]
    return bool(near.size) and float(np.abs(near - middle).max()) <= _EVEN_STEPS * middle


def check_range(sheet: Sheet, name: str, x: Array) -> None:
    """Check that squares of a signal x (n,) stay within double precision, relative to each other too.

    Raises:
        DataError: `beyond-precision`.
    """
    fault = beyond_precision(name, x)
    if fault is not None:
        row, message, hint = fault
        if not sheet.source.key:
            hint += f"; if it is a fault of measurement, --without {sheet.lines[row]} leaves its row out"
        raise sheet.error("beyond-precision", message, hint, row)


def joined_rows(signals: Signals, *, resample: bool) -> Signals:
    """Return the signals at the times of the output that was written most often; or, if few miss, all rows.

    Inputs are held until they are written again, and are their means until the next row; outputs are
    interpolated linearly. Rows stay unchanged if enough of them are whole.

    Args:
        resample: whether that is asked for.

    Raises:
        DataError: `data-not-a-number`, rows would have to be joined, and that is not asked for or cannot be.
    """
    there = ~np.isnan(np.column_stack([signals.u, signals.y]))
    whole = np.asarray(there.all(axis=1))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    stretches = edges[1::2] - edges[::2]
    short = len(whole) < _SHORT and whole.mean() >= _FEW
    if short or stretches[stretches >= SHORTEST].sum() > _KEPT * whole.sum():
        return signals
    counts = dict(zip(signals.names, there.sum(axis=0).tolist(), strict=True))
    listed = ", ".join(f"{name} in {count}" for name, count in counts.items())
    timed = ~np.isnan(signals.time)
    possible = bool(signals.name) and bool(np.all(np.any(there & timed[:, None], axis=0)))
    if not (resample and possible):
        message = f"hardly a row of {signals.sheet.path.name} has numbers in all columns ({listed} of "
        message += f"{len(whole)} rows): they were written at different times"
        hint = "join the rows of each sample, or log the time with them"
        if possible:
            hint = "add --resample (inputs are held until written again, outputs interpolated), or join the "
            hint += "rows"
        raise signals.sheet.error("data-not-a-number", message, hint, 0)
    written = ~np.isnan(signals.y) & timed[:, None]
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    every = np.diff(signals.time[timed])
    even = np.mean(np.abs(every - np.median(every)) <= (_NEARLY - 1.0) * np.median(every)) >= _MOSTLY
    if even and rows.size > 1 and np.median(np.diff(signals.time[rows])) <= _NEARLY * np.median(every):
        rows = np.flatnonzero(timed)  # it misses some only
    time = signals.time[rows]
    inputs = [_until_next(signals.time, x, time) for x in signals.u.T]
    outputs = [_between(signals.time[at], x[at], time) for x, at in zip(signals.y.T, written.T, strict=True)]
    moved = int(np.any([moves for _, moves in inputs], axis=0).sum())
    found = COLUMNS_JOINED.found(
        f"{listed} of {len(whole)} rows, joined at {len(rows)} times, between {moved} of which inputs move",
        counts=counts,
        rows=len(whole),
        moved=moved,
        kept=len(rows),
    )
    u, y = (np.column_stack(columns) for columns in ([means for means, _ in inputs], outputs))
    return replace(signals.at(rows), u=u, y=y, findings=(*signals.findings, found))


def _until_next(time: Array, x: Array, instants: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return means of x (n,), held until written again, between instants, and whether x changes there.

    The mean is NaN before x was written first; the last value is returned as it is.
    """
    at = np.flatnonzero(~np.isnan(x) & ~np.isnan(time))
    began, values = time[at], x[at]
    here = np.searchsorted(began, instants, side="right") - 1
    held = values[np.maximum(here, 0)]
    # The integral of x is linear between the times at which it is written, and goes on behind the last.
    ends = np.append(began, max(instants[-1], began[-1]) + 1.0)
    area = np.concatenate([[0.0], np.cumsum(values * np.diff(ends))])
    means = np.append(np.diff(np.interp(instants, ends, area)) / np.diff(instants), held[-1])
    moves = (np.abs(means - held) > 1e-9 * np.abs(values).max()) & (here >= 0)
    return np.where(here >= 0, np.where(moves, means, held), np.nan), moves


def _between(time: Array, y: Array, instants: Array) -> Array:
    """Interpolate y (n,) linearly at some instants; NaN outside and in gaps."""
    found = np.interp(instants, time, y, left=np.nan, right=np.nan)
    steps = np.diff(time)
    if not steps.size:
        return found
    after = np.clip(np.searchsorted(time, instants, side="left"), 1, len(time) - 1)
    gap = steps[after - 1] > _OWN_GAP * np.median(steps)
    return np.where(gap & ~np.isin(instants, time), np.nan, found)
