"""Names of kinds that a spec may use: this package's own, and others added by a call or an entry point."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from importlib.metadata import EntryPoint, entry_points

_ANNOUNCED = defaultdict[str, set[str]](set)
# The kinds of this package, in the form of entry points.
_OWN = {
    "idesign.signals": {
        "filtered_noise": "inputdesign_cli.signal.noise:FilteredNoise",
        "multisine": "inputdesign_cli.signal.multisine:Multisine",
        "binary": "inputdesign_cli.signal.levels:BINARY",
        "slewed": "inputdesign_cli.signal.levels:SLEWED",
        "ternary": "inputdesign_cli.signal.levels:TERNARY",
        "prbs": "inputdesign_cli.signal.prbs:Prbs",
        "white": "inputdesign_cli.signal.noise:WhiteNoise",
        "chirp": "inputdesign_cli.signal.chirp:Chirp",
        "steps": "inputdesign_cli.signal.steps:Steps",
    }
}


def announce(group: str, name: str) -> None:
    """Let specs use a name of a group: `idesign.signals`, for example."""
    _ANNOUNCED[group].add(name)


def own(group: str) -> dict[str, EntryPoint]:
    """Return the kinds that this package itself has in a group, by name."""
    return {name: EntryPoint(name, value, group) for name, value in _OWN[group].items()}


@cache
def points(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group in all packages that are installed, by name."""
    return {point.name: point for point in entry_points(group=group)}


def names(group: str) -> set[str]:
    """Return all names that were added to a group."""
    return _ANNOUNCED[group] | points(group).keys()
