"""Where the pieces of a study are computed: the contract that every executor keeps, and the simplest one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

Task = TypeVar("Task")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Finished(Generic[Task, Answer]):
    """One task with its answer, or with the error that stands in its place."""

    task: Task
    answer: Answer | None
    error: Exception | None = None


class Executor(Protocol):
    """Computes a function of many tasks.

    Tasks are drawn from the iterable as workers become free, never all at once; answers come in the order
    in which they are finished. What a task answers must depend on nothing but the task (a random stream
    travels as its seed), so that every executor gives the same answers to the last digit.
    """

    @property
    def shares_files(self) -> bool:
        """Whether the function sees the file system of the caller."""
        ...

    def run(
        self, function: Callable[[Task], Answer], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Answer]]:
        """Yield every task with its answer. `function` is importable by name; everything can be pickled."""
        ...


class WorkerLostError(Exception):
    """A worker ended in the middle of a task, and so did the second one that was given it."""


class InProcess:
    """The calling process itself, one task after the other."""

    shares_files = True

    def run(
        self, function: Callable[[Task], Answer], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Answer]]:
        """Yield every task with its answer, in order."""
        for task in tasks:
            try:
                answer = function(task)
            except Exception as error:
                yield Finished(task, None, error)
            else:
                yield Finished(task, answer)
