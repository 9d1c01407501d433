"""A run or a sweep as one HTML file that needs nothing else: no network, no script."""

from __future__ import annotations

from pathlib import Path

from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.report.run_page import run_page
from inputdesign_cli.report.sweep_page import sweep_page
from inputdesign_cli.report.template import render

PAGE = "report.html"


def report_text(directory: Path) -> str:
    """The page about a run directory or about the directory of a sweep.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`.
    """
    if (directory / "sweep.json").is_file():
        return render("sweep.html", directory, sweep_page(directory))
    if (directory / "result.json").is_file():
        return render("run.html", directory, run_page(directory))
    raise DataError(
        Diagnostic(
            "run-missing",
            f"{directory} holds neither a finished run nor a sweep",
            hint="make one with `idesign solve SPEC -o DIR` or `idesign sweep SPEC -o DIR`",
        )
    )
