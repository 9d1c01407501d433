"""Processes of this machine: each imports the libraries once and computes on one thread.

The standard pools end when one of their processes is killed, and leave processes behind when they are
killed themselves. Here each process has a pipe of its own: when the process ends, its job is given to
another one; when the caller ends, the pipe closes and the process ends too.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, Generic

from inputdesign_cli.compute.executor import Answer, Finished, Job, WorkerLostError
from inputdesign_cli.compute.threads import ONE_THREAD

_ATTEMPTS = 2


@dataclass
class _Worker(Generic[Job]):
    process: SpawnProcess
    pipe: Connection
    work: tuple[Job, int] | None = None  # with the attempts so far, while it is at work


@dataclass(frozen=True)
class Processes:
    """`count` processes; a job whose process is killed is tried once more, then it has failed."""

    count: int
    shares_files: bool = field(default=True, init=False)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished."""
        workers: list[_Worker[Job]] = []
        try:
            yield from self._run(workers, function, jobs)
        finally:
            for worker in workers:
                _end(worker)

    def _run(
        self, workers: list[_Worker[Job]], function: Callable[[Job], Answer], jobs: Iterable[Job]
    ) -> Iterator[Finished[Job, Answer]]:
        """The same with the processes that are there, and as many more as it takes."""
        again: list[tuple[Job, int]] = []
        source = iter(jobs)
        while True:
            self._feed(workers, function, again, source)
            busy = [worker for worker in workers if worker.work is not None]
            if not busy:
                return
            ready = wait([worker.pipe for worker in busy])
            for worker in [w for w in busy if w.pipe in ready]:
                assert worker.work is not None  # it is busy
                job, attempts = worker.work
                worker.work = None
                try:
                    answer, error = worker.pipe.recv()
                except (EOFError, OSError):
                    workers.remove(worker)
                    _end(worker)
                    if attempts < _ATTEMPTS:
                        again.append((job, attempts))
                        continue
                    lost = f"{_ATTEMPTS} processes ended in the middle of it"
                    answer, error = None, WorkerLostError(lost)
                yield Finished(job, answer, error)

    def _feed(
        self,
        workers: list[_Worker[Job]],
        function: Callable[[Job], object],
        again: list[tuple[Job, int]],
        source: Iterator[Job],
    ) -> None:
        """Give every free process a job, and start processes while there are jobs for them."""
        while True:
            free = next((worker for worker in workers if worker.work is None), None)
            if free is None and len(workers) >= self.count:
                return
            if again:
                job, attempts = again.pop()
            else:
                try:
                    job, attempts = next(source), 0
                except StopIteration:
                    return
            if free is None:
                free = _start()
                workers.append(free)
            free.work = (job, attempts + 1)
            # A process that has just ended tells so by its pipe, where its answer is awaited.
            with suppress(BrokenPipeError, ConnectionResetError):
                free.pipe.send((function, job))


@dataclass(frozen=True)
class StandingProcesses(Processes):
    """Processes that stay from one run to the next, with what they have imported, until they are ended."""

    _workers: list[_Worker[Any]] = field(default_factory=list, init=False, repr=False)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished."""
        try:
            yield from self._run(self._workers, function, jobs)
        finally:  # who goes away in the middle leaves answers behind that nobody wants
            for worker in [one for one in self._workers if one.work is not None]:
                self._workers.remove(worker)
                _end(worker)

    def start(self) -> None:
        """Start them all; in the main thread they are deaf to its interrupts."""
        while len(self._workers) < self.count:
            self._workers.append(_start())

    def end(self) -> None:
        """End them all."""
        while self._workers:
            _end(self._workers.pop())


def _start() -> _Worker[Job]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs,), daemon=True)
    with _environment(ONE_THREAD), _deaf_to_interrupts():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """What a process is told to ignore its children ignore from their first moment on."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _end(worker: _Worker[Job]) -> None:
    worker.pipe.close()
    worker.process.terminate()
    worker.process.join()


def _serve(pipe: Connection) -> None:
    """The life of a process: a job after the other until the caller has gone."""
    threading.Thread(target=_end_with_the_caller, daemon=True).start()
    while True:
        try:
            function, job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            reply: tuple[object, Exception | None] = (function(job), None)
        except Exception as error:
            reply = (None, _portable(error))
        try:
            pipe.send(reply)
        except OSError:
            return


def _end_with_the_caller() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _portable(error: Exception) -> Exception:
    """The error itself, or its words if it cannot be pickled."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
