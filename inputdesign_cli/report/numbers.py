"""Numbers and names as people read them, and tables of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from inputdesign_cli.outcome.results import Json

BREAK = "\n"  # within a cell: what follows is a remark
# A line of a table of facts: name, value, and a note that may be empty.
Fact = tuple[str, str, str]


@dataclass(frozen=True)
class Rows:
    """A table: the first column holds names, the others numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def shown(value: Json) -> str:
    """A number with seven digits."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def precise(ratio: float) -> str:
    """A ratio with four digits, but with as many as tell it from one."""
    return f"{ratio:.7g}" if ratio > 1.0 + 1e-6 and f"{ratio:.4g}" == "1" else f"{ratio:.4g}"


def listed(values: Json) -> str:
    """A number, or one for each channel, with four digits."""
    return " ".join(f"{value:.4g}" for value in (values if isinstance(values, list | tuple) else [values]))


def enumerated(values: Json) -> str:
    """The same in a sentence: `1, 2 and 3`."""
    *others, last = listed(values).split(" ")
    return f"{', '.join(others)} and {last}" if others else last


def spoken(name: str) -> str:
    """A name of the program as words."""
    return name.replace("_", " ")


def provenance(environment: Mapping[str, Json], more: Iterable[Fact] = ()) -> list[Fact]:
    """Versions, and what else tells where numbers come from."""
    return [*more, *((name, str(version), "") for name, version in environment.items() if version)]
