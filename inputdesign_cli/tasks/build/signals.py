"""The columns of a data file that hold its signals and times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.errors import DataError
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.tasks.build.tables import columns_of, is_dated

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0}
TIME_UNITS = tuple(SECONDS)
_UNITS = {"s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s"} | {
    unit: unit for unit in TIME_UNITS
}
_TIME = re.compile(r"(sampling[ _]|elapsed[ _])?(time|t|timestamp)(?![a-z0-9]).*")


@dataclass(frozen=True)
class Signals:
    """What stands in the columns of a file: u (n, m), y (n, p), NaN where a number is missing.

    Attributes:
        time: (n,), counted in sample times where the file has none; `name` is that of its column, if any.
        dated: whether the times stand as dates; they are counted in seconds then.
        inputs, outputs: what notes call the columns of u and y.
    """

    sheet: Sheet
    time: Array
    name: str
    dated: bool
    u: Array
    y: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def signals_of(
    sheet: Sheet, inputs: int, outputs: int, preparation: Preparation, references: Sequence[str] = ()
) -> Signals:
    """The columns of so many channels; those of `references` follow the inputs.

    Raises:
        DataError: a column is missing, or holds text or nothing.
    """
    wanted = {
        **_channels("u", inputs, sheet, preparation),
        **_channels("y", outputs, sheet, preparation),
        **{name: name for name in references},
        **time_column(sheet, preparation),
    }
    found = columns_of(sheet, wanted)
    for role, numbers in found.items():
        if np.isnan(numbers).all():
            message = f"the column {wanted[role]} holds no number"
            raise DataError(sheet.error("data-not-a-number", message, "is it another column?", 0))
    rows = np.arange(preparation.skip, len(sheet.lines))
    time = found.get("time", np.arange(len(sheet.lines), dtype=float))
    if preparation.span is not None:
        begin, end = preparation.span
        scale = 1.0 if "time" in found else preparation.sample_time or sheet.sample_time or 1.0
        rows = rows[(time[rows] * scale >= begin) & (time[rows] * scale <= end)]
    if not rows.size:
        message = f"nothing is left of the {len(sheet.lines)} rows of {sheet.path.name}"
        raise DataError.because("data-unreadable", message, "mind --skip and --range", sheet.key)
    kept = replace(
        sheet, lines=sheet.lines[rows], texts=[sheet.texts[i] for i in rows.tolist()] if sheet.texts else ()
    )
    driving = (*_labels("u", inputs), *references)
    u = np.column_stack([found[name][rows] for name in (*(f"u{i + 1}" for i in range(inputs)), *references)])
    y = np.column_stack([found[f"y{i + 1}"][rows] for i in range(outputs)])
    name = wanted.get("time", "")
    dated = bool(name) and is_dated(sheet, name)
    return Signals(kept, time[rows], name, dated, u, y, driving, _labels("y", outputs))


def _labels(letter: str, count: int) -> tuple[str, ...]:
    """What notes call channels: u, or u1, u2, .. of several."""
    return (letter,) if count == 1 else tuple(f"{letter}{i + 1}" for i in range(count))


def time_column(sheet: Sheet, preparation: Preparation) -> dict[str, str]:
    """`time` -> the name of its column, if there is one.

    Raises:
        DataError: there are several.
    """
    if "time" in preparation.columns:
        return {"time": preparation.columns["time"]}
    timed = [name for name in sheet.header if _TIME.fullmatch(name)]
    if len(timed) > 1:
        message = f"{sheet.path.name} has several columns of times: {', '.join(timed)}"
        hint = f"say which one counts: --columns time={timed[0]}"
        raise DataError(sheet.error("data-missing-column", message, hint))
    return {"time": timed[0]} if timed else {}


def time_unit_of(name: str) -> str | None:
    """The unit in the name of a column of times: `time_ms`, `Time (sec)`."""
    words = re.findall(r"[a-z]+", name.lower())
    return _UNITS.get(words[-1]) if len(words) > 1 else None


def _channels(letter: str, count: int, sheet: Sheet, preparation: Preparation) -> dict[str, str]:
    """Channel -> how its column begins: u1, u2, ..; u or u1 for a single one; or what the user said."""
    found = {}
    for name in (f"{letter}{i + 1}" for i in range(count)):
        plain = count == 1 and not any(header.startswith(name) for header in sheet.header)
        found[name] = preparation.columns.get(name, letter if plain else name)
    return found
