"""Which software produced a run."""

from __future__ import annotations

import platform
from functools import cache
from importlib import metadata

from inputdesign_cli.version import __version__

LIBRARIES = ("numpy", "scipy", "cvxpy", "clarabel")


def environment() -> dict[str, str | None]:
    """Versions of Python, of this package and of the numerical libraries, and the platform.

    The libraries are looked up in the installation's metadata, not imported; one that is not
    installed is None.
    """
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "idesign": __version__,
        **{name: _version(name) for name in LIBRARIES},
    }


@cache
def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
