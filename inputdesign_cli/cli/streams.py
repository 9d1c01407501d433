"""Standard streams that may be closed, full or cut off, and signals that end the program."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import BinaryIO, NoReturn

from inputdesign_cli.compute.interruptions import interrupt
from inputdesign_cli.errors import EXIT_BAD_INPUT

EXIT_PIPE = 141  # what a shell reports for a command that SIGPIPE ended


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
        # What is still in the buffer goes nowhere, or Python would complain about it on its way out.
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
    # Whoever calls from Python may have put streams of their own in place.
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
