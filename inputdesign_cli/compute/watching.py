"""Report the progress of a long computation to a watcher."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


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
    """Counts the finished ones of a series of tasks."""

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


def tell(done: Round | Counted) -> None:
    """Report to the watcher, if there is one."""
    watcher = _watcher.get()
    if watcher is not None:
        watcher(done)
