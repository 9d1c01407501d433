"""Processes of this machine: each imports the libraries once and computes on one thread.

The pool of concurrent.futures gives up all its jobs when one process is killed, and leaves processes behind
when its caller is. Here each of these jobs is tried again in a process of its own. A pipe whose other end
only the caller holds ends the processes with the caller.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from multiprocessing.connection import Connection

from inputdesign_cli.compute.executor import ONE_THREAD, Answer, Finished, Job, WorkerLostError

_ATTEMPTS = 2  # processes of its own in which such a job is tried


@dataclass(frozen=True)
class Processes:
    """Computes in `count` processes; a job whose process is killed is tried again, in its own process."""

    count: int
    shares_files: bool = field(default=True, init=False)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished."""
        source, pending = iter(jobs), dict[Future[Answer], Job]()
        more = True
        while more:
            with _pool(self.count) as pool:
                while more and not any(map(_was_killed, pending)):
                    for future in [future for future in pending if future.done()]:
                        yield _finished(pending.pop(future), future)
                    for job in islice(source, self.count - len(pending)):
                        pending[pool.submit(function, job)] = job
                    more = bool(pending)
                    wait(pending, return_when=FIRST_COMPLETED)
                wait(pending)  # the pool ends the other jobs as well
            for future, job in list(pending.items()):
                del pending[future]
                yield _alone(function, job) if _was_killed(future) else _finished(job, future)


@contextmanager
def _pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Start processes that end with the block, whatever they compute, and with the caller."""
    context = multiprocessing.get_context("spawn")
    there, held = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, _begin, (there,))
    try:
        yield pool
    finally:
        held.close()
        pool.shutdown(cancel_futures=True)


def _begin(there: Connection) -> None:
    """Let a process compute on one thread, leave interrupts to the caller, and end with it."""
    os.environ.update(ONE_THREAD)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        there.poll(None)  # until the other end is closed
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _was_killed(future: Future[Answer]) -> bool:
    return future.done() and isinstance(future.exception(), BrokenProcessPool)


def _finished(job: Job, future: Future[Answer]) -> Finished[Job, Answer]:
    error = future.exception()
    if error is None:
        return Finished(job, future.result())
    if not isinstance(error, Exception):
        raise error
    return Finished(job, None, error)


def _alone(function: Callable[[Job], Answer], job: Job) -> Finished[Job, Answer]:
    """Compute a job in a process of its own, after its process or that of another job was killed."""
    for _ in range(_ATTEMPTS):
        with _pool(1) as pool:
            future = pool.submit(function, job)
            wait([future])
        if not _was_killed(future):
            return _finished(job, future)
    return Finished(job, None, WorkerLostError(f"{_ATTEMPTS} processes ended in the middle of it"))
