"""The kinds of signals by the names that specs and `idesign signal` give them."""

from __future__ import annotations

from inputdesign_cli.errors import bad_spec
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
    """Return the kind of this name. It raises `SpecError` if the package that adds it does not hold it."""
    if name not in _KINDS:
        point = points(GROUP)[name]
        try:
            _KINDS[name] = point.load()
        except (ImportError, AttributeError) as error:
            raise bad_spec(
                "not-supported",
                f"the signal {name} is no part of {point.value}, which a package names for it: {error}",
                hint="update or remove that package, or use another kind of signal",
                key="signal.type",
            ) from error
    return _KINDS[name]
