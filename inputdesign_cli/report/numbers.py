"""Numbers and names as people read them, and tables of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

BREAK = "\n"  # within a cell: what follows is a remark
# A line of a table of facts: name, value, and a note that may be empty.
Fact = tuple[str, str, str]


@dataclass(frozen=True)
class Rows:
    """A table: the first column holds names, the others numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def shown(value: object) -> str:
    """Return a number with seven digits."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def precise(ratio: float) -> str:
    """Return a ratio with four digits, or with seven if it is above one but would read as one."""
    return f"{ratio:.7g}" if ratio > 1.0 + 1e-6 and f"{ratio:.4g}" == "1" else f"{ratio:.4g}"


def listed(values: Iterable[float]) -> str:
    """Return one number for each channel, with four digits."""
    return " ".join(f"{value:.4g}" for value in values)


def enumerated(values: Iterable[float]) -> str:
    """Return numbers as a sentence has them: `1, 2 and 3`."""
    *others, last = listed(values).split(" ")
    return f"{', '.join(others)} and {last}" if others else last


def spoken(name: str) -> str:
    """A name of the program as words."""
    return name.replace("_", " ")


def provenance(environment: Mapping[str, object], more: Iterable[Fact] = ()) -> list[Fact]:
    """Return the versions, and further facts that show where numbers come from."""
    return [*more, *((name, str(version), "") for name, version in environment.items() if version)]
