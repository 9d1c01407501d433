"""Let interruptions reach the caller unchanged, although compiled modules lose or replace them."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_came: list[int] = []  # numbers of the signals raised
# An interrupted import may drop the interruption, or crash in a compiled module: it is finished first.
_PATIENCE = 5.0  # seconds that it may take
# Lookups and finalizers may drop an interruption, too.
_MOMENT = 0.05  # seconds until it is raised again
_waiting_since: list[float] = []
_HAS_ALARM = hasattr(signal, "SIGALRM")  # not on Windows: dropped interruptions are lost there


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handle a signal: Ctrl-C is `KeyboardInterrupt`, others end the program in order.

    An import that is under way is finished first. A dropped interruption is raised again.

    Raises:
        KeyboardInterrupt, SystemExit: now, or in a moment by way of SIGALRM.
    """

    def later(_: int, frame: FrameType | None) -> None:
        if _is_under_way(sys.exc_info()[1]):
            signal.setitimer(signal.ITIMER_REAL, _MOMENT)
        else:
            interrupt(number, frame)

    if _HAS_ALARM:
        signal.signal(signal.SIGALRM, later)
        signal.setitimer(signal.ITIMER_REAL, _MOMENT)
        while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
            frame = frame.f_back
        if frame is not None:
            _waiting_since.append(time.monotonic())
            if _waiting_since[-1] - _waiting_since[0] < _PATIENCE:
                return
    _came.append(number)
    raise _end(number)


def _is_under_way(handled: BaseException | None) -> bool:
    """Return whether an interruption is being handled, or a generator ends: a clean-up may be under way."""
    while handled is not None:
        if isinstance(handled, KeyboardInterrupt | SystemExit | GeneratorExit):
            return True
        handled = handled.__context__
    return False


@contextmanager
def bare_interruptions() -> Iterator[None]:
    """Let Ctrl-C and the end by a signal leave the block unchanged, never as the cause of another error.

    Some errors name an interruption in their text alone: the signals that `interrupt` raised are kept.

    Raises:
        KeyboardInterrupt, SystemExit: one of them has caused an error.
    """
    _came.clear()
    _waiting_since.clear()
    try:
        yield
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt | SystemExit):
            raise error.__cause__ from None
        if _came:
            raise _end(_came[-1]) from None
        raise
    finally:
        if _HAS_ALARM and (_came or _waiting_since):
            signal.signal(signal.SIGALRM, signal.SIG_IGN)  # a pending alarm would come after the end
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def _end(number: int) -> KeyboardInterrupt | SystemExit:
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
