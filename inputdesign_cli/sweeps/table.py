"""sweep.csv: one row a point, with the numbers of its result under their paths in `result.json`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from inputdesign_cli.outcome.text_formats import csv_line, shortest

PENDING = "pending"
MOST_ENTRIES = 4
"""Lists and matrices up to this size are written out, one column an entry."""

# These come first and in this order; what else a result has follows in its own order.
FIRST = (
    "objective.kind",
    "objective.value",
    "objective.lower_bound",
    "objective.upper_bound",
    "objective.relative_gap",
    "objective.any_spectrum_bound",
    "cost",
    "samples",
)
LAST = ("time_s", "code", "reason", "run")
# Settings, provenance, and what is long: not what one compares from point to point.
_LEFT_OUT = frozenset(
    {
        "format", "title", "status", "information", "spectrum", "solver", "environment", "timing_s",
        "spec_sha256", "files", "code", "message", "hint", "key", "active_frequencies", "certificate",
    }
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """Holds the row of a point in the table: `numbers` of its result by their paths, or why it has none."""

    status: str = PENDING
    numbers: Mapping[str, object] = field(default_factory=dict)
    seconds: object = None
    code: str = ""
    reason: str = ""
    run: str = ""

    @classmethod
    def of(cls, key: str, content: Mapping[str, Any] | None) -> Row:
        """Return the row of a point from its result, its failure (which has a `code`), or neither."""
        if content is None:
            return cls()
        status, seconds = content.get("status", "done"), content.get("timing_s", {}).get("point")
        if "code" in content:
            return cls(status, {}, seconds, content["code"], content["message"])
        return cls(status, scalars(content), seconds, run=f"points/{key}")


def table_lines(axes: Sequence[str], rows: Sequence[tuple[Sequence[str], Row]]) -> Iterator[str]:
    """Return the lines of the table.

    Args:
        axes: the keys that are varied.
        rows: each point, as the texts of its values, with its row.
    """
    found = dict.fromkeys(name for _, row in rows for name in row.numbers)
    names = [*(n for n in FIRST if n in found), *(n for n in found if n not in FIRST)]
    yield csv_line([*axes, "status", *names, *LAST])
    for point, row in rows:
        cells = [_cell(row.numbers.get(name)) for name in names]
        yield csv_line([*point, row.status, *cells, _cell(row.seconds), row.code, row.reason, row.run])


def scalars(value: object, path: str = "") -> dict[str, object]:
    """Return every number, text and truth value of a result by its path (`power.input[0]`)."""
    found: dict[str, object] = {}
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key not in _LEFT_OUT:
                found |= scalars(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        if len(value) <= MOST_ENTRIES:
            for i, item in enumerate(value):
                found |= scalars(item, f"{path}[{i}]")
    elif value is not None:
        found[path] = value
    return found


def _cell(value: object) -> str:
    if value is None:
        return ""
    return shortest(value) if isinstance(value, float) else str(value)
