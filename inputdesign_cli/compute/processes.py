"""Processes of this machine: each imports the libraries once and computes on one thread.

The pool is that of concurrent.futures, which gives up all its jobs when one process is killed, and leaves
processes behind when its caller is. Here each of these jobs is tried again in a process of its own, and
a pipe whose other end only the caller holds ends the processes with it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection

from inputdesign_cli.compute.executor import ONE_THREAD, Answer, Finished, Job, WorkerLostError

_ATTEMPTS = 2


class Processes:
    """`count` processes; a job whose process is killed is tried again, in a process of its own.

    Once started they stay from one run to the next, with what they have imported, until they are ended.
    """

    shares_files = True

    def __init__(self, count: int) -> None:
        self.count = count
        self._standing: _Pool | None = None

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished."""
        if self._standing:
            yield from self._standing.run(function, jobs)
            return
        with closing(_Pool(self.count)) as pool:
            yield from pool.run(function, jobs)

    def start(self) -> None:
        """Start them all; in the main thread they are deaf to its interrupts."""
        self._standing = _Pool(self.count)
        for _ in range(self.count):
            self._standing.submit(os.getpid)

    def end(self) -> None:
        """End the processes that were started."""
        if self._standing:
            self._standing.close()
            self._standing = None


class _Pool:
    """An executor of the standard library that is replaced where one of its processes was killed."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._begin()

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        there, self._held = context.Pipe(duplex=False)
        self._executor = ProcessPoolExecutor(self._count, context, _end_with_the_caller, (there,))

    def submit(self, function: Callable[..., Answer], *args: object) -> Future[Answer]:
        with _inherited():
            return self._executor.submit(function, *args)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        source = iter(jobs)
        pending: dict[Future[Answer], Job] = {}
        while True:
            for job in islice(source, self._count - len(pending)):
                pending[self.submit(function, job)] = job
            if not pending:
                return
            done, _ = wait(pending, return_when=FIRST_COMPLETED)
            if any(isinstance(future.exception(), BrokenProcessPool) for future in done):
                done, _ = wait(pending)  # the others have ended as well
                self.close()
                self._begin()
            for future, job in [(future, pending.pop(future)) for future in done]:
                broken = isinstance(future.exception(), BrokenProcessPool)
                yield _alone(function, job) if broken else _finished(job, future)

    def close(self) -> None:
        """End the processes, whatever they compute."""
        self._held.close()
        self._executor.shutdown(cancel_futures=True)


def _alone(function: Callable[[Job], Answer], job: Job) -> Finished[Job, Answer]:
    """Compute a job in a process of its own: its process was killed, or that of another job."""
    for _ in range(_ATTEMPTS):
        with closing(_Pool(1)) as pool, suppress(BrokenProcessPool):
            return _finished(job, pool.submit(function, job))
    return Finished(job, None, WorkerLostError(f"{_ATTEMPTS} processes ended in the middle of it"))


def _finished(job: Job, future: Future[Answer]) -> Finished[Job, Answer]:
    """Return what a job has answered.

    Raises:
        BrokenProcessPool: its process was killed.
    """
    try:
        return Finished(job, future.result())
    except BrokenProcessPool:
        raise
    except Exception as error:
        return Finished(job, None, error)


@contextmanager
def _inherited() -> Iterator[None]:
    """Let processes that start inside compute on one thread, and ignore interrupts from the beginning."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    main = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
    try:
        yield
    finally:
        if main:
            signal.signal(signal.SIGINT, handler)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _end_with_the_caller(there: Connection) -> None:
    def watch() -> None:
        there.poll(None)  # until the other end is closed
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
