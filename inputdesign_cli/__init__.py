"""Optimal experiments for system identification.

    from inputdesign_cli import load_spec, solve
    outcome = solve(load_spec("specs/first_order.yaml", ["spectrum.order=10"]))

The verbs are resolved at first use, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from inputdesign_cli.assemble import analyse, assess, identify, solve, validate
    from inputdesign_cli.spec import load_spec, parse_spec
    from inputdesign_cli.study.simulation import simulate
    from inputdesign_cli.study.sweep import sweep

__version__ = "0.1.0"

__all__ = [
    "__version__",
    "analyse",
    "assess",
    "identify",
    "load_spec",
    "parse_spec",
    "simulate",
    "solve",
    "sweep",
    "validate",
]

_HOME = {
    "load_spec": "inputdesign_cli.spec",
    "parse_spec": "inputdesign_cli.spec",
    "solve": "inputdesign_cli.assemble",
    "simulate": "inputdesign_cli.study.simulation",
    "analyse": "inputdesign_cli.assemble",
    "assess": "inputdesign_cli.assemble",
    "identify": "inputdesign_cli.assemble",
    "validate": "inputdesign_cli.assemble",
    "sweep": "inputdesign_cli.study.sweep",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
