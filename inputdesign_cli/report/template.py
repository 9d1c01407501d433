"""The templates of the pages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from inputdesign_cli.version import __version__


def render(template: str, directory: Path, content: Mapping[str, object]) -> str:
    """Fill a template; whatever text comes from a spec or a result is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("inputdesign_cli.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(template)
    return page.render(version=__version__, source=directory.name or str(directory.resolve().name), **content)
