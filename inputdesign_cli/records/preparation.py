"""How a record is to be read and prepared, as options of the command line say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

Detrend = Literal["none", "constant", "linear", "auto"]
DETRENDS: dict[str, Detrend] = {kind: kind for kind in get_args(Detrend)}
Run = tuple[str, int, int]
"""Rows of a file, the first and the last; no name: of the only file."""


@dataclass(frozen=True)
class Preparation:
    """Describes how a record is to be read and prepared.

    Attributes:
        columns: channel (`u1`, `y1`, `time`) -> name or number of its column.
        sample_time, time_unit: what the file does not say, or says wrongly.
        resample: whether times that jitter more than usual are made even, and columns of other times joined.
        detrend: what is taken away from the signals of every segment; `auto` a line where it explains much.
        skip: rows to leave out at the beginning.
        span: of times, in the unit of the file, to keep.
        without: rows to leave out, as findings number them; the record is cut there.
        operating_point: by channel, what is taken away where no trend is.
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
