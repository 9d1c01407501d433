"""The end of commands and their output: data on stdout, everything else on stderr.

Standard streams may be closed, full or cut off, and signals may end the program.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from io import StringIO
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn, TextIO

import typer

from inputdesign_cli.compute.interruptions import bare_interruptions, interrupt
from inputdesign_cli.compute.time_limit import Counted, Round, watching
from inputdesign_cli.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, Diagnostic, IdesignError, OutputError

if TYPE_CHECKING:
    from rich.text import Text

EXIT_PIPE = 141  # the exit code in a shell of a command that SIGPIPE ended
EXIT_INTERNAL = 70  # EX_SOFTWARE of sysexits.h
_PATIENCE = 2.0  # seconds until a computation shows its progress
_UNBROKEN = 100_000  # characters of a line: wide enough never to break it


class _Errors(io.TextIOWrapper):
    """Writes to standard error; what cannot be written there is lost."""

    def __init__(self, stream: BinaryIO, encoding: str, *, by_line: bool) -> None:
        super().__init__(stream, encoding, errors="backslashreplace", line_buffering=by_line)

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as error:
            self._failed(error)
            return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            self._failed(error)

    def _failed(self, _error: OSError) -> None:
        # The rest of the buffer goes to the null device; otherwise Python reports an error at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())


class _Output(_Errors):
    """Writes to standard output; the program ends where it cannot, quietly if the reader has gone."""

    def _failed(self, error: OSError) -> NoReturn:
        super()._failed(error)
        if isinstance(error, BrokenPipeError):
            raise SystemExit(EXIT_PIPE) from None
        sys.stderr.write(f"error: standard output cannot be written: {error.strerror}\n")
        raise SystemExit(EXIT_BAD_INPUT) from None


def prepare_streams() -> None:
    """Make the standard streams fail in an orderly way; no file takes the place of a closed one."""
    for number, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # gets the lowest number that is free
    # A caller from Python may have replaced the streams.
    if sys.stderr is sys.__stderr__:
        sys.stderr = _Errors(*_parts(sys.stderr, 2), by_line=True)
    if sys.stdout is sys.__stdout__:
        sys.stdout = _Output(*_parts(sys.stdout, 1), by_line=os.isatty(1))


def _parts(stream: io.TextIOBase | None, number: int) -> tuple[BinaryIO, str]:
    if isinstance(stream, io.TextIOWrapper):
        return stream.buffer, stream.encoding
    return open(number, "wb", closefd=False), "utf-8"


def prepare_signals() -> None:
    """End in order after SIGTERM and SIGHUP, as after Ctrl-C, unless the caller had them ignored."""
    if threading.current_thread() is not threading.main_thread():
        return
    hangup = [signal.SIGHUP] if hasattr(signal, "SIGHUP") else []  # Windows has none
    for number in (signal.SIGINT, signal.SIGTERM, *hangup):
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, interrupt)


@contextmanager
def ending_early(stop: Callable[[], None]) -> Iterator[list[int]]:
    """Call `stop` at the first Ctrl-C or SIGTERM; the next one ends the program as usual.

    The list has the number of the signal that came.
    """
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def first(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        restore()
        stop()
        sys.stderr.write("ending with what is known so far; once more ends at once\n")

    for number in before:
        signal.signal(number, first)
    try:
        yield came
    finally:
        restore()


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
            from inputdesign_cli.plugins import culprit

            _trace()
            package = culprit(error)
            whose = f"in {package}, which adds to idesign" if package else "in idesign, not in your spec"
            typer.echo(
                f"internal error: {type(error).__name__}: {error}\n"
                f"This is a mistake {whose}. Please report it with the spec and with what IDESIGN_DEBUG=1 "
                "prints.",
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
    """Show `text` on stderr while the block runs, if it is a terminal; the block may replace it."""
    if quiet or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(text)) as line:
        yield lambda text: line.update(Text(text))


@contextmanager
def computing(about: Path | str, *, quiet: bool, doing: str = "computing") -> Iterator[None]:
    """Show on stderr, if it is a terminal, the computation inside, and after a while its progress.

    Args:
        about: the file, or another name for the computation.
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
    width = shutil.get_terminal_size().columns if wrap and sys.stdout.isatty() else _UNBROKEN
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
