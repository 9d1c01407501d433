"""The kinds of signals by the names that specs and `idesign signal` give them."""

from __future__ import annotations

from inputdesign_cli.plugins import announce, loaded, own, points, refused
from inputdesign_cli.signal.kind import SignalKind

GROUP = "idesign.signals"
"""The group of entry points, each of which names a `SignalKind`."""

_KINDS: dict[str, SignalKind] = {}


def register(name: str, kind: SignalKind) -> None:
    """Add a kind, which specs then name as `signal.type`, and `idesign signal` as `--kind`."""
    _KINDS[name] = kind
    announce(GROUP, name)


def kind_of(name: str) -> SignalKind:
    """Return the kind of this name; raise `SpecError` if the package that adds it does not hold it."""
    if name not in _KINDS:
        point = {**points(GROUP), **own(GROUP)}[name]
        kind = loaded(point)
        kind = kind() if isinstance(kind, type) else kind
        if not isinstance(kind, SignalKind):
            raise refused(point, "is no SignalKind")
        _KINDS[name] = kind
    return _KINDS[name]
