"""Interruptions as they are: Python and compiled modules make other errors of those that come at imports."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

_came: list[int] = []


def interrupt(number: int, _frame: FrameType | None) -> NoReturn:
    """A handler of signals: Ctrl-C is `KeyboardInterrupt`, others end the program in order."""
    _came.append(number)
    raise _end(number)


@contextmanager
def bare_interruptions() -> Iterator[None]:
    """Within, Ctrl-C and the end by a signal are never the cause of another error, but themselves.

    Some errors name an interruption in their text alone, so that the signals are kept that `interrupt` saw.

    Raises:
        KeyboardInterrupt, SystemExit: where an error was made of one of them.
    """
    _came.clear()
    try:
        yield
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt | SystemExit):
            raise error.__cause__ from None
        if _came:
            raise _end(_came[-1]) from None
        raise


def _end(number: int) -> KeyboardInterrupt | SystemExit:
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
