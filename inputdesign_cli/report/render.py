"""A run or a sweep as one HTML file that needs nothing else: no network, no script."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from inputdesign_cli.errors import DataError
from inputdesign_cli.report.run_page import run_page
from inputdesign_cli.report.sweep_page import sweep_page
from inputdesign_cli.runs.results import Json
from inputdesign_cli.version import __version__

PAGE = "report.html"


def report_text(directory: Path) -> str:
    """The page about a run directory or about the directory of a sweep.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`.
    """
    if (directory / "sweep.json").is_file():
        return _filled("sweep.html", directory, sweep_page(directory))
    if (directory / "result.json").is_file():
        return _filled("run.html", directory, run_page(directory))
    message = f"{directory} holds neither a finished run nor a sweep"
    hint = "make one with `idesign solve SPEC -o DIR` or `idesign sweep SPEC -o DIR`"
    raise DataError.because("run-missing", message, hint)


def _filled(template: str, directory: Path, content: Mapping[str, Json]) -> str:
    """A template with its content; whatever text comes from a spec or a result is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("inputdesign_cli.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(template)
    return page.render(version=__version__, source=directory.name or directory.resolve().name, **content)
