"""How long an answer may take: set once where a task begins, asked wherever work is repeated."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf

from inputdesign_cli.errors import InaccurateError


class OutOfTimeError(InaccurateError):
    """The time limit has passed; `reached` is what a design underway had attained, and its proved bound."""

    reached: tuple[float, float] | None = None


_end: ContextVar[float] = ContextVar("end", default=inf)


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """What is computed inside ends after so many seconds, at the next `seconds_left`."""
    token = _end.set(time.monotonic() + seconds)
    try:
        yield
    finally:
        _end.reset(token)


def seconds_left() -> float:
    """What is left of the time limit; infinite where there is none.

    Raises:
        OutOfTimeError: `out-of-time` when nothing is left.
    """
    left = _end.get() - time.monotonic()
    if left <= 0.0:
        raise out_of_time("")
    return left


def out_of_time(reached: str) -> OutOfTimeError:
    """The error, with a sentence on what was reached."""
    told = "the answer was not found within solver.time_limit"
    return OutOfTimeError.because(
        "out-of-time",
        f"{told}: {reached}" if reached else told,
        hint="raise solver.time_limit (in seconds), lower the orders, or ask for a shorter signal",
        key="solver.time_limit",
    )
