"""Interruptions as they are: imports of compiled modules make other errors of them, or lose them."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
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
    Where a module that is imported drops the interruption, the next import raises it again.

    Raises:
        KeyboardInterrupt, SystemExit: where an error was made of one of them, or it was dropped.
    """
    again = _Again()
    sys.meta_path.insert(0, again)
    try:
        yield
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt | SystemExit):
            raise error.__cause__ from None
        if _came:
            raise _end(_came[-1]) from None
        raise
    finally:
        sys.meta_path.remove(again)
        _came.clear()


class _Again(MetaPathFinder):
    """Finds no module, and raises an interruption that is on its way no longer."""

    def find_spec(self, *_: object) -> None:
        # What tidies up after an interruption may import, too, and other threads have none.
        under_way = isinstance(sys.exc_info()[1], KeyboardInterrupt | SystemExit)
        if _came and not under_way and threading.current_thread() is threading.main_thread():
            raise _end(_came[-1])


def _end(number: int) -> KeyboardInterrupt | SystemExit:
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
