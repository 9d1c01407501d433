"""A run or a sweep as one HTML file that needs nothing else: no network, no script."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from inputdesign_cli import __version__
from inputdesign_cli.errors import DataError, Diagnostic

PAGE = "report.html"


def report_text(directory: Path) -> str:
    """The page about a run directory or about the directory of a sweep.

    Raises
    ------
    DataError : `run-missing`, `run-incomplete`, `run-unreadable`.
    """
    if (directory / "sweep.json").is_file():
        from inputdesign_cli.report.sweep_page import sweep_page

        return render("sweep.html", directory, sweep_page(directory))
    if not (directory / "result.json").is_file():
        raise DataError(
            Diagnostic(
                "run-missing",
                f"{directory} holds neither a finished run nor a sweep",
                hint="make one with `idesign solve SPEC -o DIR` or `idesign sweep SPEC -o DIR`",
            )
        )
    from inputdesign_cli.report.run_page import run_page

    return render("run.html", directory, run_page(directory))


def render(template: str, directory: Path, content: Mapping[str, Any]) -> str:
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


def shown(value: Any) -> str:
    """A number as people read it: seven digits."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def provenance(environment: Mapping[str, Any], *more: tuple[str, str, str]) -> list[tuple[str, str, str]]:
    """Versions as rows of name, value and note."""
    versions = [(name, str(version), "") for name, version in environment.items() if version]
    return [*more, *versions]
