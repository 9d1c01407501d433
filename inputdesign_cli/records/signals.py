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
from inputdesign_cli.records.cells import SAY_TIME
from inputdesign_cli.records.columns import TIME_UNITS, column_named, columns_of, time_columns, time_unit_in
from inputdesign_cli.records.sheet import Preparation, Run, Sheet
from inputdesign_cli.specification.models.units import SECONDS

# Steps of time differ from a round number, and from each other, by less than these shares by rounding alone.
_ROUND, _EVEN_STEPS = 1e-4, 0.01
# The first date in digits, and seconds since 1970 of the years 2000 to 2100.
_A_DATE = 1.97e7
_FIRST, _LAST = (datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (2000, 2100))
# Rows are not joined if _KEPT of the complete rows, as a share, stand in long stretches. In records shorter
# than _SHORT they are not joined if _FEW of all rows are complete.
_KEPT, _FEW, _SHORT = 0.25, 0.5, 2 * SHORTEST
# Steps of an output beyond _OWN_GAP of its median step are gaps. An output whose median step is at most
# _NEARLY times that of all rows misses some rows only.
_OWN_GAP, _NEARLY = 3.0, 1.1


@dataclass(frozen=True)
class Signals:
    """Holds the columns of a file: u (n, m), y (n, p), NaN where a number is missing.

    Attributes:
        time: (n,), counted in sample times where the file has none; `name` is that of its column, if any.
        unit: the unit of the times, if the file or the user states it; `dated`: dates, counted in seconds.
        names: the names in findings of the columns of u, the last of which may be references, and of y.
        without: (n,), mask of the rows to leave out.
        findings: findings on how they were read.
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
    name, found = roles.get("time", ""), columns_of(sheet, roles)
    for role, numbers in found.items():
        if np.isnan(numbers).all():
            message = f"the column {roles[role]} holds no number"
            hint = "is it another column? A workbook holds values of formulas once a spreadsheet saved it"
            raise sheet.error("data-not-a-number", message, hint, 0)
    time, dated = np.arange(len(sheet.lines), dtype=float), False
    findings = list[Finding]()
    if name:
        dated = column_named(sheet, name).dated
        findings += [TIMES_READ.found(done, where=name) for done in column_named(sheet, name).done]
    unit = _unit(sheet, name, preparation.time_unit, dated=dated)
    if name:
        time = found["time"]
        if not unit:
            _check_counting(sheet, time, name)
    own = {letter: [role for role in roles if role[0] == letter] for letter in "ury"}
    ordered = [*own["u"], *own["r"], *own["y"]]
    single = {f"{letter}1": letter for letter in "uy" if len(own[letter]) == 1}
    others = sheet.source.others
    fact = f"read {sheet.path.name}#NAME for one of {', '.join(others)}"
    every = Signals(
        sheet,
        time,
        name,
        unit,
        dated,
        np.column_stack([found[role] for role in ordered[: -len(own["y"])]]),
        np.column_stack([found[role] for role in own["y"]]),
        tuple(single.get(role, role) for role in ordered),
        _left_out(sheet, preparation.without),
        (*findings, *SHEETS_UNREAD.when(others, fact, sheets=list(others))),
    )
    kept = every.at(_rows(sheet, time, preparation, timed=bool(name)))
    for role, x in zip(ordered, (*kept.u.T, *kept.y.T), strict=True):
        values = np.where(kept.without, np.nan, x)
        if not np.isnan(values).all():
            check_range(kept.sheet, roles[role], values)
    if name:
        _check_rising(kept.sheet, kept.time)
    return kept


def _check_counting(sheet: Sheet, time: Array, name: str) -> None:
    """Raise `DataError` (`data-not-a-number`) for times (n,) that may be dates in digits, as 20240312.

    They may also count milliseconds since 1970, for example. Seconds since 1970 are accepted.
    """
    there = np.flatnonzero(~np.isnan(time))
    first, last = float(time[there].min()), float(time[there].max())
    if last < _A_DATE or (first >= _FIRST and last <= _LAST):
        return
    message = f"{time[there[0]]:.17g} in column {name} may be a date in digits, or count since 1970"
    hint = f"if it counts, say in what: --time-unit ms; else {SAY_TIME}, or --time-format %Y%m%d%H%M%S"
    raise sheet.error("data-not-a-number", message, hint, int(there[0]))


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
    begin, end = preparation.span or (-np.inf, np.inf)
    inside = ~((scaled < begin) | (scaled > end))
    kept = np.flatnonzero(inside & (np.arange(len(time)) >= preparation.skip))
    if not kept.size:
        message = f"nothing is left of the {len(time)} rows of {sheet.path.name}"
        times = f"its times run from {np.nanmin(scaled):.6g} to {np.nanmax(scaled):.6g}"
        raise sheet.error("data-unreadable", message, f"{times}: mind --skip and --range")
    return kept


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
        "add time=none to --columns, and --sample-time; if they stand in another column, --columns time=NAME"
    )
    message = f"the times of {sheet.path.name} do not increase: {time[before]:.10g} is followed by "
    raise sheet.error("data-not-uniform", f"{message}{time[row]:.10g}", hint, int(row))


def check_sampled(sheet: Sheet, step: float, unit: str) -> None:
    """Raise `DataError` (`data-not-uniform`) if a time is half a `step` or more from its place in the sheet.

    The rows of a given signal are applied one after the other. Without a column of times nothing is checked.
    """
    for name in time_columns(sheet)[:1]:
        column = column_named(sheet, name)
        scale = SECONDS[time_unit_in(sheet, name, dated=column.dated) or unit] / SECONDS[unit]
        steps = np.diff(column.numbers) * scale
        for row in np.flatnonzero(np.abs(np.nancumsum(steps - step)) > 0.5 * step)[:1]:
            message = f"{name} advances by {steps[row]:.6g} {unit} here, but sample_time is {step:g} {unit}"
            even = np.ptp(steps) < 0.25 * steps.min()  # otherwise rows are missing, or in disorder
            hint = f"write sample_time: {steps.mean():.10g}" if even else "write each sample once, in order"
            raise sheet.error("data-not-uniform", message, f"{hint}; or remove that column", int(row) + 1)


def steps_without_gaps(time: Array) -> Array:
    """Return the steps of times (n,) that are within a half of their median; none if that is no step."""
    steps = np.diff(time[~np.isnan(time)])
    middle = float(np.median(steps)) if steps.size else 0.0
    return steps[np.abs(steps - middle) < 0.5 * middle]


def typical_step(time: Array) -> float:
    """Return the mean step of time without gaps, rounded where the difference may be rounding."""
    near = steps_without_gaps(time)
    if not near.size:
        return np.nan
    mean = float(near.mean())
    rounded = (float(f"{mean:.{digits}e}") for digits in range(6))
    return next((value for value in rounded if abs(value - mean) <= _ROUND * mean), mean)


def is_even(time: Array) -> bool:
    """Return whether the steps of time without gaps are all alike, to rounding of the times."""
    near = steps_without_gaps(time)
    return bool(near.size) and bool(np.ptp(near) <= _EVEN_STEPS * near.min())


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
    """Return the signals at the times of the output written most often, if hardly a row is complete.

    Inputs are held until they are written again, and move at the nearest of these times. Outputs are
    interpolated linearly. Raises `DataError` (`data-not-a-number`) unless `resample` asks for it.
    """
    import pandas

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
        option = "add --resample (inputs are held until written again, outputs interpolated), or "
        hint = f"{option * possible}join the rows of each sample, or log the time with them"
        raise signals.sheet.error("data-not-a-number", message, hint, 0)
    signals = signals.at(np.flatnonzero(timed))
    written = ~np.isnan(signals.y)
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    own, every = (float(np.median(np.diff(t, append=t[-1]))) for t in (signals.time[rows], signals.time))
    if not np.isnan(signals.u).any() and own <= _NEARLY * every:
        rows = np.arange(len(written))  # it misses some rows only
    instants, held = signals.time[rows], pandas.DataFrame(signals.u).ffill().to_numpy()
    u = held[np.searchsorted(signals.time, instants + 0.5 * own) - 1]
    moved = sum(int(k * np.any(np.diff(x, axis=0) != 0.0, axis=1).sum()) for k, x in ((1, held), (-1, u)))
    y = np.column_stack([_between(signals.time, x, instants) for x in signals.y.T])
    fact = (
        f"{listed} of {len(whole)} rows, joined at {len(rows)} times, between which inputs move {moved} times"
    )
    found = COLUMNS_JOINED.found(fact, counts=counts, rows=len(whole), moved=moved, kept=len(rows))
    return replace(signals.at(rows), u=u, y=y, findings=(*signals.findings, found))


def _between(time: Array, y: Array, instants: Array) -> Array:
    """Interpolate y (n,) linearly between the times at which it was written; NaN outside and in gaps."""
    own = time[~np.isnan(y)]
    found = np.interp(instants, own, y[~np.isnan(y)], left=np.nan, right=np.nan)
    steps = np.diff(own, prepend=own[0], append=own[-1])
    gap = steps[np.searchsorted(own, instants)] > _OWN_GAP * np.median(steps[1:-1] if own.size > 1 else 0.0)
    return np.where(gap & ~np.isin(instants, own), np.nan, found)
