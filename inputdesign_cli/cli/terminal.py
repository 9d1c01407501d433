"""How commands end and what reaches the terminal: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import typer

from inputdesign_cli.compute.interruptions import bare_interruptions
from inputdesign_cli.compute.watching import Counted, Round, watching
from inputdesign_cli.errors import EXIT_INTERRUPTED, Diagnostic, IdesignError, OutputError

if TYPE_CHECKING:
    from rich.text import Text

EXIT_INTERNAL = 70  # EX_SOFTWARE of sysexits.h
_PATIENCE = 2.0  # seconds until a computation says how far it is
_ENDLESS = 100_000  # characters of a line that nobody sees whole


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Return `command` with every error turned into words on stderr and an exit code.

    With `--json` the diagnostics also appear on stdout, as {"errors": [..]}. IDESIGN_DEBUG=1 adds the
    traceback to an internal error.
    """

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            with bare_interruptions():
                command(*args, **kwargs)
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except IdesignError as error:
            raise typer.Exit(_printed(error, as_data=kwargs.get("json_output", False))) from None
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from None
        except (OSError, MemoryError) as error:
            _trace()
            refused = OutputError(_refusal(error))
            raise typer.Exit(_printed(refused, as_data=kwargs.get("json_output", False))) from None
        except Exception as error:
            _trace()
            typer.echo(
                f"internal error: {type(error).__name__}: {error}\n"
                "This is a mistake in idesign, not in your spec. Please report it with the spec and with "
                "what IDESIGN_DEBUG=1 prints.",
                err=True,
            )
            raise typer.Exit(EXIT_INTERNAL) from None
        sys.stdout.flush()

    return run


def _printed(error: IdesignError, *, as_data: bool) -> int:
    """Print an error, on stdout too if that is to be data, and return its exit code."""
    from inputdesign_cli.diagnostics import as_json

    if as_data:
        typer.echo(json.dumps({"errors": as_json(error)}, indent=1, ensure_ascii=False))
    complain(error)
    return error.exit_code


def complain(error: IdesignError) -> None:
    """Print an error on stderr; the command may go on."""
    from inputdesign_cli.diagnostics import render

    typer.echo(render(error, color=colourful(sys.stderr)).rstrip("\n"), err=True)


def _refusal(error: OSError | MemoryError) -> Diagnostic:
    """Return the diagnostic of a refusal of the operating system that ends the program."""
    if isinstance(error, MemoryError):
        return Diagnostic(
            "system-refuses", "there is not enough memory", "shorten the record or lower the order"
        )
    try:
        os.getcwd()
    except OSError:
        return Diagnostic("system-refuses", "the current folder has been removed", "change to another one")
    about = f": {error.filename}" if error.filename else ""
    return Diagnostic("system-refuses", f"{error.strerror or error}{about}", "mend that, and try again")


def _trace() -> None:
    if os.environ.get("IDESIGN_DEBUG") == "1":
        traceback.print_exc()


def colourful(stream: TextIO) -> bool:
    """Return whether colours may go to `stream`: a terminal, and the user has not set NO_COLOR."""
    from rich.console import Console

    console = Console(file=stream)
    return console.color_system is not None and not console.no_color


@contextmanager
def status(text: str, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    """Show `text` on stderr while the block runs, if anybody is looking; the block may replace it."""
    if quiet or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(text)) as line:
        yield lambda text: line.update(Text(text))


@contextmanager
def computing(about: Path | str, *, quiet: bool, doing: str = "computing") -> Iterator[None]:
    """Show on stderr, if anybody is looking, what is computed inside, and after a while how far it is.

    Args:
        about: the file, or what else it is about.
    """
    with status(f"{about}: {doing} ...", quiet=quiet) as show:
        started = time.monotonic()

        def say(done: Round | Counted) -> None:
            if time.monotonic() - started > _PATIENCE:
                show(f"{about}: {done} ...")

        with watching(say):
            yield


def aligned(
    rows: Sequence[Sequence[str | Text]], *, right: Container[int] = (), gap: int = 2, wrap: bool = False
) -> list[str]:
    """Return `rows` as lines with aligned columns, plain and each on one line unless they go to a terminal.

    Args:
        rows: the cells; styled ones have their colours on a terminal that may show them.
        right: the columns that are flush right.
        gap: spaces between columns.
        wrap: break the last column at the width of a terminal.
    """
    from rich.console import Console
    from rich.table import Table

    colours = colourful(sys.stdout)
    width = shutil.get_terminal_size().columns if wrap and sys.stdout.isatty() else _ENDLESS
    grid = Table.grid(padding=(0, gap, 0, 0))
    for column in range(len(rows[0])):
        last = column == len(rows[0]) - 1
        grid.add_column(justify="right" if column in right else "left", no_wrap=not last)
    for row in rows:
        grid.add_row(*row)
    page = Console(
        file=StringIO(), width=width, markup=False, emoji=False, highlight=False, force_terminal=colours
    )
    with page.capture() as captured:
        page.print(grid)
    return [line.rstrip() for line in captured.get().splitlines()]
