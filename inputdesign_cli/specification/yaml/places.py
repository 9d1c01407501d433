"""Paths of keys, as `plant.B[1]`, and the lines and columns that they were read from."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from inputdesign_cli.errors import Location

Path = tuple[str | int, ...]

_INDEX = re.compile(r"\[(\d+)\]$")


def format_key(path: Sequence[str | int]) -> str:
    """Return a path in dotted form: `("plant", "B", 1)` is `plant.B[1]`; the whole spec is the empty text."""
    parts: list[str] = []
    for step in path:
        if isinstance(step, int):
            parts.append(f"[{step}]")
        else:
            parts.append(f".{step}" if parts else step)
    return "".join(parts)


def parse_key(key: str) -> Path:
    """Return the steps of a dotted key. `B[1]` is an index, `b3[1,2]` is a parameter name and stays whole.

    A step of digits (`B.1`) stays text: only the tree knows whether it stands in a list.
    """
    steps: list[str | int] = []
    for part in key.split(".") if key else ():
        indices: list[int] = []
        while match := _INDEX.search(part):
            indices.insert(0, int(match.group(1)))
            part = part[: match.start()]
        steps.extend(indices if indices and not part else [part, *indices])
    return tuple(steps)


@dataclass
class Places:
    """The locations of every key and value, by path; `files` are the texts read so far, in their order.

    `keys` holds where a key is written. `values` holds where a diagnostic about its value points: to the
    value, and for a mapping to its key, because a block mapping begins on the line below.
    """

    files: list[str] = field(default_factory=list)
    keys: dict[Path, Location] = field(default_factory=dict)
    values: dict[Path, Location] = field(default_factory=dict)

    def at(self, path: Path, *, at_key: bool = False) -> Location | None:
        """Return the location of `path`, or of its deepest ancestor that was written."""
        known: Path = ()
        for step in path:
            places = (step, int(step) if isinstance(step, str) and step.isdecimal() else step)
            found = next((one for one in places if (*known, one) in self.values), None)
            if found is None:
                at_key = False
                break
            known = (*known, found)
        return self.keys[known] if at_key and known in self.keys else self.values.get(known)

    def copy(self) -> Places:
        """Return an independent copy."""
        return Places(list(self.files), dict(self.keys), dict(self.values))

    def adopt(self, other: Places, path: Path) -> None:
        """Take over the locations of `path` and of all below it."""
        for mine, theirs in ((self.keys, other.keys), (self.values, other.values)):
            mine.update({p: place for p, place in theirs.items() if p[: len(path)] == path})

    def forget(self, path: Path) -> None:
        """Drop the locations of `path` and of all below it (an override has replaced them)."""
        for table in (self.keys, self.values):
            for known in [p for p in table if p[: len(path)] == path]:
                del table[known]
