"""Optimal experiments for system identification.

    from inputdesign_cli import load_spec, solve
    outcome = solve(load_spec("specs/first_order.yaml", ["spectrum.order=10"]))

The verbs are resolved at first use, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from inputdesign_cli.assemble import analyse, solve, validate
    from inputdesign_cli.spec import load_spec, parse_spec

__version__ = "0.1.0"

__all__ = ["__version__", "analyse", "load_spec", "parse_spec", "solve", "validate"]

_HOME = {
    "load_spec": "inputdesign_cli.spec",
    "parse_spec": "inputdesign_cli.spec",
    "solve": "inputdesign_cli.assemble",
    "analyse": "inputdesign_cli.assemble",
    "validate": "inputdesign_cli.assemble",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
