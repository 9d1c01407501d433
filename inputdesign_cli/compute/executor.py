"""The place where the pieces of a study are computed: the contract of all executors, and the simplest one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

Job = TypeVar("Job")
Answer = TypeVar("Answer")


# One thread for the linear algebra: matrices are small, and results must not depend on the machine.
# The libraries read this when numpy is first imported.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


@dataclass(frozen=True)
class Finished(Generic[Job, Answer]):
    """Holds one job with its answer, or with the error in place of the answer."""

    job: Job
    answer: Answer | None
    error: Exception | None = None


class Executor(Protocol):
    """Computes a function of many jobs.

    Jobs are drawn from the iterable as workers become free, never all at once; answers come in the order in
    which they are finished. The answer to a job must depend on nothing but the job; a random stream travels
    as its seed. Then every executor gives the same answers to the last digit.
    """

    @property
    def shares_files(self) -> bool:
        """Return whether the function sees the file system of the caller."""

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer.

        Workers import `function` by its name, and receive jobs as pickles.
        """


class WorkerLostError(Exception):
    """Raised where every worker that was given a job ended in the middle of it."""


class InProcess:
    """Computes in the calling process itself, one job after the other."""

    shares_files = True

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in order."""
        for job in jobs:
            try:
                answer = function(job)
            except Exception as error:
                yield Finished(job, None, error)
            else:
                yield Finished(job, answer)
