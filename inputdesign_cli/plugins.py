"""Names that other packages add to what a spec may say: by a call, or by an entry point of a group."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from importlib.metadata import EntryPoint, entry_points

_ANNOUNCED = defaultdict[str, set[str]](set)


def announce(group: str, name: str) -> None:
    """Let specs use a name of a group: `idesign.signals`, for example."""
    _ANNOUNCED[group].add(name)


@cache
def points(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group in all packages that are installed, by name."""
    return {point.name: point for point in entry_points(group=group)}


def names(group: str) -> set[str]:
    """Return all names that were added to a group."""
    return _ANNOUNCED[group] | points(group).keys()
