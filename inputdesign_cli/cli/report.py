"""`idesign report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import Quiet, path_option
from inputdesign_cli.cli.terminal import status
from inputdesign_cli.errors import STANDARD_STREAM, OutputError


def report(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="The directory of a run or of a sweep.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="The file to write, - for standard output. The default is report.html in RUN.",
            parser=path_option,
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a run or a sweep as one HTML page.

    The page tells the question, the answer, its proof, what was assumed and how to reproduce it, with
    charts. It needs no network and no script, and can be printed.
    """
    with status(f"{directory}: writing ...", quiet=quiet):
        from inputdesign_cli.outcome.record import PAGE
        from inputdesign_cli.outcome.run_directory import replace_text
        from inputdesign_cli.report.render import is_page, report_text

        if str(output) == STANDARD_STREAM:
            typer.echo(report_text(directory))
            return
        file = output or directory / PAGE
        if file.exists() and not is_page(file):
            hint = "choose another name, or move it away: only a page that idesign wrote is replaced"
            raise OutputError.because("output-exists", f"{file} exists already, and is no report", hint)
        replace_text(file, report_text(directory))
    if not quiet:
        typer.echo(file)
