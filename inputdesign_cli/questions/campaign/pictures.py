"""Keep the pictures of a campaign where a decision draws none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from inputdesign_cli.outcome.record import listed_files
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_directory import output_errors
from inputdesign_cli.regular_file import read_regular


def with_earlier_pictures(results: Results, directory: Path) -> Results:
    """Return the results with the pictures of the last decision.

    Raises:
        OutputError: a picture cannot be read.
    """
    names = [name for name in listed_files(directory) if name.endswith(".png")]
    with output_errors(directory):
        pictures = {name: read_regular(directory / name) for name in names}
    return replace(results, files={**results.files, **pictures})
