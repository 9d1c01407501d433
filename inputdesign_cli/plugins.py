"""Names of kinds that a spec may use: this package's own, and others added by a call or an entry point."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from inputdesign_cli.errors import SpecError, bad_spec

_ADDED = ("requirements", "spectra", "signals", "control_laws", "findings")
GROUPS = tuple(f"idesign.{group}" for group in _ADDED)
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
    """Return the entry points of a group in all packages that are installed, by name.

    Raises:
        SpecError: `bad-plug-in`, a name belongs to this package or to two packages.
    """
    found: dict[str, EntryPoint] = {}
    for point in entry_points(group=group):
        if point.name in _OWN.get(group, {}):
            raise refused(point, "has the name of a kind that exists")
        if point.name in found and point != found[point.name]:
            raise refused(point, f"has the name of one that {_package(found[point.name])} adds")
        found[point.name] = point
    return found


def loaded(point: EntryPoint) -> Any:
    """Return the object of an entry point; raise `SpecError` (`bad-plug-in`) if it cannot be loaded."""
    try:
        return point.load()
    except (Exception, SystemExit) as error:  # whatever the code of another package raises
        raise refused(point, f"cannot be loaded: {type(error).__name__}: {error}") from error


def refused(point: EntryPoint, what: str) -> SpecError:
    """Return the error about an entry point of another package."""
    message = f"{point.name}, which {_package(point)} adds to {point.group}, {what}"
    return bad_spec("bad-plug-in", message, hint="mend the package, or uninstall it")


def culprit(error: BaseException) -> str:
    """Return the package whose code, reached by an entry point, raised an error; empty if none did."""
    added = dict[str, str]()
    for group in GROUPS:
        added |= {point.module.partition(".")[0]: _package(point) for point in entry_points(group=group)}
    frames, trace = set[str](), error.__traceback__
    while trace is not None:
        frames.add(str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0])
        trace = trace.tb_next
    return next((package for module, package in added.items() if module in frames), "")


def _package(point: EntryPoint) -> str:
    return f"the package {point.dist.name}" if point.dist is not None else "an installed package"


def names(group: str) -> set[str]:
    """Return all names that were added to a group."""
    return _ANNOUNCED[group] | points(group).keys()
