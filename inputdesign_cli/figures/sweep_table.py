"""The keys that a sweep varied, and its table, as the report reads them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from inputdesign_cli.outcome import OutcomeError, read_plain
from inputdesign_cli.outcome.design import objective
from inputdesign_cli.outcome.results import Array
from inputdesign_cli.outcome.run_files import readable
from inputdesign_cli.outcome.text_formats import csv_rows
from inputdesign_cli.regular_file import read_regular

# The main quantity of a sweep is the first of these that its results have.
QUANTITIES = ("objective.value", "cost", "model_error.worst_ratio")


@dataclass(frozen=True)
class SweepAxis:
    """Holds a key that is varied, with its values as texts, each as `--set KEY=TEXT` takes it."""

    key: str
    values: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class SweepContent:
    """Holds the content of `sweep.json`.

    Attributes:
        made_from: the spec file as it is seen from the directory.
        asked_sha256: the digest of the spec without its parts about a sweep.
        statuses: the number of points of each status.
    """

    format: int = 1
    kind: str = "sweep"
    title: str = ""
    verb: Literal["solve", "analyse", "simulate"]
    made_from: tuple[str, ...] = ()
    asked_sha256: str = ""
    axes: tuple[SweepAxis, ...]
    zip: bool = False
    points: int = 0
    statuses: Mapping[str, int] = field(default_factory=dict)
    environment: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class SweepTable:
    """Holds the content of `sweep.json` and the columns of `sweep.csv` as text."""

    summary: SweepContent
    columns: Mapping[str, list[str]]

    @property
    def axes(self) -> list[str]:
        """Return the keys that were varied."""
        return [axis.key for axis in self.summary.axes]

    @property
    def rows(self) -> int:
        """Return the number of points."""
        return len(self.columns["status"])

    @property
    def kind(self) -> str:
        """Return the objective that all points have in common; empty if there is none."""
        kinds = {kind for kind in self.columns.get("objective.kind", []) if kind}
        return kinds.pop() if len(kinds) == 1 else ""

    @property
    def maximised(self) -> bool:
        """Return whether more of the objective is better; it then has bounds from above."""
        return any(self.columns.get("objective.upper_bound", []))

    @property
    def best(self) -> tuple[str, str] | None:
        """Return the main quantity of the sweep and its best point; None without a result."""
        for name in QUANTITIES:
            values = self.numbers(name)
            if values is None or not np.isfinite(values).any():
                continue
            most = name == "objective.value" and objective(self.kind).maximised
            at = int(np.nanargmax(values) if most else np.nanargmin(values))
            return name, ", ".join(f"{key} = {self.columns[key][at]}" for key in self.axes)
        return None

    def __getitem__(self, name: str) -> Array | list[bool] | list[str]:
        """Return a column: numbers (n,), truth values, or texts."""
        numbers, texts = self.numbers(name), self.columns[name]
        if numbers is not None and any(texts):
            return numbers
        lower = [text.lower() for text in texts]
        return [text == "true" for text in lower] if set(lower) <= {"true", "false"} else texts

    def numbers(self, name: str) -> Array | None:
        """Return a column as numbers (n,), NaN where it is empty; None if it is missing or holds text."""
        texts = self.columns.get(name)
        if texts is None:
            return None
        try:
            return np.array([float(text) if text else np.nan for text in texts])
        except ValueError:
            return None


class Trade(NamedTuple):
    """Holds the worst ratios to the requirement, or a `criterion`, over lengths (n,) in `unit`.

    A row (n,) belongs to an amplitude, by its name, and has NaN where there is no result.
    """

    lengths: Array
    unit: str
    rows: Mapping[str, Array]
    criterion: bool


def read_content(root: Path) -> SweepContent:
    """Return the content of `sweep.json`.

    Raises:
        OSError, ValueError, RecursionError: it cannot be read.
    """
    return read_plain(SweepContent, json.loads(read_regular(root / "sweep.json")), "sweep.json")


def read_sweep(root: Path) -> SweepTable:
    """Read the table of a sweep.

    Raises:
        DataError: `run-unreadable`.
    """
    with readable(root / "sweep.json", "a sweep"):
        summary = read_content(root)
    with readable(root / "sweep.csv", "a sweep"):
        header, *rows = csv_rows(read_regular(root / "sweep.csv"))
        columns = {name: [row[i] for row in rows] for i, name in enumerate(header)}
        if missing := {"status", "code", "run", *(axis.key for axis in summary.axes)} - columns.keys():
            raise OutcomeError(f"it has no column {min(missing)}")
        return SweepTable(summary, columns)
