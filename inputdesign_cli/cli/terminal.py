"""How commands end and what reaches the terminal: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any, TextIO

import typer

from inputdesign_cli.errors import EXIT_INTERRUPTED, IdesignError

EXIT_INTERNAL = 70  # EX_SOFTWARE of sysexits.h
EXIT_PIPE = 141  # what a shell reports for a command that SIGPIPE ended
CLEAR_LINE = "\r\x1b[K"


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """`command` with every error turned into words on stderr and an exit code.

    With `--json` the diagnostics also appear on stdout, as {"errors": [..]}. IDESIGN_DEBUG=1 adds the
    traceback to an internal error.
    """

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            _run(command, *args, **kwargs)
            sys.stdout.flush()
        except BrokenPipeError:
            # The reader has gone. What is still in the buffer goes nowhere, or Python would complain
            # about it on its way out.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(EXIT_PIPE) from None

    return run


def _run(command: Callable[..., None], *args: Any, **kwargs: Any) -> None:
    try:
        command(*args, **kwargs)
    except (typer.Exit, typer.Abort, typer.BadParameter, BrokenPipeError):
        raise
    except IdesignError as error:
        from inputdesign_cli.diagnostics import as_json, render

        if kwargs.get("json_output"):
            typer.echo(json.dumps({"errors": as_json(error)}, indent=1, ensure_ascii=False))
        typer.echo(render(error, color=colourful(sys.stderr)).rstrip("\n"), err=True)
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        raise typer.Exit(EXIT_INTERRUPTED) from None
    except Exception as error:
        if os.environ.get("IDESIGN_DEBUG") == "1":
            traceback.print_exc()
        typer.echo(
            f"internal error: {type(error).__name__}: {error}\n"
            "This is a mistake in idesign, not in your spec. Please report it with the spec and with what "
            "IDESIGN_DEBUG=1 prints.",
            err=True,
        )
        raise typer.Exit(EXIT_INTERNAL) from None


def colourful(stream: TextIO) -> bool:
    """Whether colours may go to `stream`: a terminal, and the user has not set NO_COLOR."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


@contextmanager
def status(text: str, *, quiet: bool) -> Iterator[None]:
    """Show `text` on stderr while the block runs, if anybody is looking."""
    shown = sys.stderr.isatty() and not quiet
    if shown:
        print(text, end="", file=sys.stderr, flush=True)
    try:
        yield
    finally:
        if shown:
            print(CLEAR_LINE, end="", file=sys.stderr, flush=True)


def aligned(rows: Sequence[Sequence[str]], *, right: Sequence[int] = (), gap: str = "  ") -> list[str]:
    """`rows` as lines with aligned columns; the columns numbered in `right` are flush right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return [
        gap.join(
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
