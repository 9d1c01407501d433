"""Optimal experiments for system identification.

    from inputdesign_cli import load_spec, solve
    results = solve(load_spec("specs/first_order.yaml", ["spectrum.order=10"]))

The verbs are resolved at first use, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from inputdesign_cli.version import __version__

if TYPE_CHECKING:
    from inputdesign_cli.figures.plots import figure
    from inputdesign_cli.questions import analyse, assess, identify, simulate, solve, to_control, validate
    from inputdesign_cli.specification import Spec, from_control, load_spec, parse_spec
    from inputdesign_cli.sweeps.notebook import sweep


__all__ = [
    "Spec",
    "__version__",
    "analyse",
    "assess",
    "figure",
    "from_control",
    "identify",
    "load_spec",
    "parse_spec",
    "simulate",
    "solve",
    "sweep",
    "to_control",
    "validate",
]

_HOMES = {
    "specification": {"Spec", "from_control", "load_spec", "parse_spec"},
    "questions": {"analyse", "assess", "identify", "simulate", "solve", "to_control", "validate"},
    "figures.plots": {"figure"},
    "sweeps.notebook": {"sweep"},
}


def __getattr__(name: str) -> object:
    for home, names in _HOMES.items():
        if name in names:
            return vars(import_module(f"{__name__}.{home}"))[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
