"""The kinds of signals by the names that specs and `idesign signal` give them."""

from __future__ import annotations

from inputdesign_cli.plugins import announce, points
from inputdesign_cli.signal.chirp import Chirp
from inputdesign_cli.signal.kind import SignalKind
from inputdesign_cli.signal.levels import FewLevels, signs, signs_and_zeros
from inputdesign_cli.signal.multisine import Multisine
from inputdesign_cli.signal.noise import FilteredNoise, WhiteNoise
from inputdesign_cli.signal.prbs import Prbs
from inputdesign_cli.signal.steps import Steps

GROUP = "idesign.signals"
"""The group of entry points, each of which names a `SignalKind`."""

_KINDS: dict[str, SignalKind] = {
    "filtered_noise": FilteredNoise(),
    "multisine": Multisine(),
    "binary": FewLevels(signs, few_levels=True, switched=True),
    "slewed": FewLevels(signs, slewed=True),
    "ternary": FewLevels(signs_and_zeros, few_levels=True),
    "prbs": Prbs(),
    "white": WhiteNoise(),
    "chirp": Chirp(),
    "steps": Steps(),
}


def register(name: str, kind: SignalKind) -> None:
    """Add a kind, which specs then name as `signal.type`, and `idesign signal` as `--kind`."""
    _KINDS[name] = kind
    announce(GROUP, name)


def kind_of(name: str) -> SignalKind:
    """Return the kind of this name."""
    if name not in _KINDS:
        _KINDS[name] = points(GROUP)[name].load()
    return _KINDS[name]
