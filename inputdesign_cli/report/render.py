"""A run or a sweep as one HTML file that needs nothing else: no network, and its script only reads values."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome import sentences
from inputdesign_cli.outcome.run_files import RESULT, readable
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.report.run_page import run_page, run_sources
from inputdesign_cli.report.sweep_page import sweep_page, sweep_sources
from inputdesign_cli.version import __version__


def report_text(directory: Path) -> str:
    """Return the page about a run directory or about the directory of a sweep.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`.
    """
    if _is_sweep(directory):
        return _filled("sweep.html", directory, "sweep.csv", sweep_page)
    return _filled("run.html", directory, RESULT, run_page)


def bibtex_text(directory: Path) -> str:
    """Return the sources of the methods that a run or a sweep used, as a BibTeX file.

    Raises:
        DataError: as `report_text`.
    """
    found = sweep_sources(directory) if _is_sweep(directory) else run_sources(directory)
    return "\n".join(source.bibtex for source in found)


def _is_sweep(directory: Path) -> bool:
    """Return whether a directory holds a sweep, not a run, or raise `run-missing` where there is neither."""
    if (directory / "sweep.json").is_file():
        return True
    if (directory / RESULT).is_file():
        return False
    message = f"{directory} holds no finished run and no sweep: neither {RESULT} nor sweep.json is in it"
    hint = "make one in a new directory: `idesign solve SPEC -o DIR` or `idesign sweep SPEC -o DIR`"
    raise DataError.because("run-missing", message, hint=hint)


def _filled(
    template: str, directory: Path, record: str, content_of: Callable[[Path], dict[str, object]]
) -> str:
    """Return the page about a directory.

    It has the SHA-256 of the file `record`, so that a reader can check that it is about that file.
    Its date is the date of the record, so that the same run gives the same page.
    """
    with readable(directory / record, "a run" if record == RESULT else "a sweep"):
        digest = hashlib.sha256(read_regular(directory / record)).hexdigest()
        date = datetime.fromtimestamp((directory / record).stat().st_mtime).strftime("%Y-%m-%d %H:%M")
        content = content_of(directory)
        source = directory.name or directory.resolve().name
        return filled(
            template, {"source": source, "record": record, "digest": digest, "date": date, **content}
        )


def filled(template: str, content: Mapping[str, object]) -> str:
    """Return a template with its content; any text from a spec or a result is escaped."""
    return sentences.filled("inputdesign_cli.report", template, {"version": __version__, **content})


def script(name: str) -> str:
    """Return a script of the pages, `hover.js` or `follow.js`."""
    return filled(name, {})


def script_source() -> str:
    """Return the source for a Content-Security-Policy that allows the script inside a page, and no other."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script('hover.js').encode()).digest()).decode()}'"
