"""Limit the time of a computation, and report its progress.

The limit is set where a task begins, and read wherever work is repeated.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from math import inf
from threading import Event

from inputdesign_cli.errors import InaccurateError

# The longest search for a remedy of an infeasible problem. No design depends on it, only a hint.
HINT_SECONDS = 5.0


class OutOfTimeError(InaccurateError):
    """Raised where the time limit has passed, or the computation was asked to end."""


_end: ContextVar[float] = ContextVar("end", default=inf)
_stopped: ContextVar[Event | None] = ContextVar("stopped", default=None)


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """End the computation inside the block after `seconds`, at the next `seconds_left`."""
    token = _end.set(time.monotonic() + seconds)
    try:
        yield
    finally:
        _end.reset(token)


@contextmanager
def time_for_hints() -> Iterator[None]:
    """End the computation inside the block after `HINT_SECONDS`, or earlier with the time limit around it."""
    with time_limit(min(HINT_SECONDS, _end.get() - time.monotonic())):
        yield


@contextmanager
def finishing() -> Iterator[None]:
    """Let the last steps of a computation run on after the time limit has passed."""
    tokens = _end.set(inf), _stopped.set(None)
    try:
        yield
    finally:
        _end.reset(tokens[0])
        _stopped.reset(tokens[1])


@contextmanager
def stoppable() -> Iterator[Callable[[], None]]:
    """Yield a function that, once called, ends the computation inside the block as if its time were over."""
    stopped = Event()
    token = _stopped.set(stopped)
    try:
        yield stopped.set
    finally:
        _stopped.reset(token)


def seconds_left() -> float:
    """Return the seconds left of the time limit; infinite where there is none.

    Raises:
        OutOfTimeError: `out-of-time` when nothing is left.
    """
    left = _end.get() - time.monotonic()
    if left <= 0.0 or was_stopped():
        raise out_of_time("")
    return left


def time_is_over() -> bool:
    """Return whether the time limit has passed, or the computation was asked to end."""
    return _end.get() <= time.monotonic() or was_stopped()


def was_stopped() -> bool:
    """Return whether the computation was asked to end."""
    stopped = _stopped.get()
    return stopped is not None and stopped.is_set()


def what_ended() -> str:
    """Return the reason that a computation ran out of time, as the subject of a sentence."""
    return "the interrupt" if was_stopped() else "solver.time_limit"


def more_time() -> str:
    """Return the demand for more time for a computation."""
    return "let it run to its end" if was_stopped() else "raise solver.time_limit"


def out_of_time(reached: str) -> OutOfTimeError:
    """Return the error `out-of-time`, with a sentence on the result that was reached."""
    when = "before the interrupt" if was_stopped() else "within solver.time_limit"
    message = f"the answer was not found {when}"
    return OutOfTimeError.because(
        "out-of-time",
        f"{message}: {reached}" if reached else message,
        hint=f"{more_time()}, lower the orders, or ask for a shorter signal",
        key="solver.time_limit",
    )


@dataclass(frozen=True)
class Round:
    """A round of an exchange: the best objective so far, its proved lower bound, and the cuts in play."""

    number: int
    objective: float
    bound: float
    cuts: int

    def __str__(self) -> str:
        gap = (self.objective - self.bound) / self.objective if self.objective > 0 else 0.0
        return f"round {self.number}: {self.objective:.6g}, proved to {gap:.1e}, {self.cuts} cuts"


@dataclass(frozen=True)
class Counted:
    """Holds the number of finished tasks in a series."""

    what: str
    done: int
    of: int

    def __str__(self) -> str:
        return f"{self.what}: {self.done} of {self.of}"


Watcher = Callable[[Round | Counted], None]
_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def watching(watcher: Watcher) -> Iterator[None]:
    """Let the computation inside the block report its progress."""
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


def report_progress(done: Round | Counted) -> None:
    """Report to the watcher, if there is one."""
    watcher = _watcher.get()
    if watcher is not None:
        watcher(done)
