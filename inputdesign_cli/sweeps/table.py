"""sweep.csv: one row a point, with the numbers of its result under their paths in `result.json`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from inputdesign_cli.outcome.text_formats import csv_line, shortest
from inputdesign_cli.sweeps.plan import Plan

Read = Callable[[str], Mapping[str, Any] | None]

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


def table_lines(plan: Plan, read: Read) -> Iterator[str]:
    """The lines of the table, one point in memory at a time.

    Args:
        read: key of a point -> its result, its failure (which has a `code`), or None while it is pending.
    """
    found: dict[str, None] = {}
    for index in range(len(plan.grid)):
        content = read(plan.key(index))
        if content is not None and "code" not in content:
            found.update(dict.fromkeys(scalars(content)))
    names = [*(n for n in FIRST if n in found), *(n for n in found if n not in FIRST)]
    yield csv_line([*(axis.key for axis in plan.grid.axes), "status", *names, *LAST])
    for index in range(len(plan.grid)):
        key = plan.key(index)
        content = read(key)
        point = list(plan.grid[index])
        if content is None:
            yield csv_line([*point, PENDING, *([""] * (len(names) + len(LAST)))])
            continue
        timing = content.get("timing_s", {})
        seconds = _cell(timing.get("point"))
        if "code" in content:
            tail = [seconds, content["code"], content["message"], ""]
            yield csv_line([*point, content["status"], *([""] * len(names)), *tail])
        else:
            values = scalars(content)
            cells = [_cell(values.get(name)) for name in names]
            yield csv_line([*point, content.get("status", "done"), *cells, seconds, "", "", f"points/{key}"])


def scalars(value: object, path: str = "") -> dict[str, object]:
    """Every number, text and truth value of a result by its path (`power.input[0]`), short lists included."""
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
