"""What `result.json` of a campaign says under `campaign`, as the next decision reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeFloat, PositiveFloat, PositiveInt

from inputdesign_cli.outcome.text_formats import csv_columns


class _Kept(BaseModel):
    """Of what idesign writes, what the next decision goes by."""

    model_config = ConfigDict(strict=True, extra="allow")


class _Record(_Kept):
    file: str
    given: str
    plan: str
    withdrawn: bool
    samples: PositiveInt
    energy: NonNegativeFloat = Field(allow_inf_nan=False)


class _Plan(_Kept):
    file: str
    samples: PositiveInt
    power: NonNegativeFloat = Field(allow_inf_nan=False)
    offset: list[FiniteFloat]


class _Round(_Kept):
    state: Literal["running", "stopped", "missed", "undecided"]
    plan: _Plan | None = None
    estimate: dict[str, FiniteFloat] = {}


class Campaign(_Kept):
    """The records, decisions and digests of a campaign."""

    state: Literal["running", "stopped", "missed", "undecided"]
    folder: str
    time_unit: str
    records: list[_Record]
    rounds: list[_Round] = Field(min_length=1)
    last: dict[str, FiniteFloat] | None = None
    first_cost: PositiveFloat | None = Field(default=None, allow_inf_nan=False)
    digests: dict[str, str] = {}
    regardless: bool = False

    def fits(self, files: Mapping[str, bytes]) -> bool:
        """Whether all files are there that it speaks of, plans as long as what was applied of them."""
        plans = [(record.plan, record.samples) for record in self.records]
        due = self.rounds[-1].plan
        plans += [] if due is None else [(due.file, due.samples)]
        estimated = [set(each.estimate) for each in self.rounds if each.estimate]
        return (
            all(record.file in files for record in self.records)
            and all(name in files and _rows(files[name]) >= samples for name, samples in plans)
            and (self.last is None or set(self.last) in estimated)
        )


def _rows(content: bytes) -> int:
    """Of a table of numbers; -1 where it is none."""
    try:
        columns = list(csv_columns(content).values())
    except ValueError:
        return -1
    return len(columns[0]) if columns and np.isfinite(columns).all() else -1
