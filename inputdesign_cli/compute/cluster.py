"""A Dask cluster that is running already, by its address (needs the extra `cluster`)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from inputdesign_cli.compute.executor import Answer, Finished, Job, WorkerLostError
from inputdesign_cli.errors import DataError
from inputdesign_cli.version import __version__

_AHEAD = 2  # jobs on their way for each thread of the cluster


@dataclass(frozen=True)
class Cluster:
    """The workers behind the scheduler at `address`.

    A job whose worker is lost is given to another one (the scheduler sees to it, three times at most).
    Workers that join while jobs are running are used.
    """

    address: str
    patience: float = 10.0  # seconds to find the scheduler, and a first worker
    shares_files: bool = field(default=False, init=False)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished.

        Raises:
            DataError: `cluster-extra`, `cluster-unreachable`, `cluster-version`.
        """
        with self._client() as client:
            from distributed import as_completed
            from distributed.scheduler import KilledWorker

            source = iter(jobs)
            known: dict[str, Job] = {}
            running = as_completed(loop=client.loop)
            while True:
                with _reaching(self.address):
                    free = _AHEAD * _threads(client) - len(known)
                for job in _take(source, free):
                    with _reaching(self.address):
                        future = client.submit(function, job, pure=False)
                        known[future.key] = job
                        running.add(future)
                if not known:
                    return
                with _reaching(self.address):
                    future = next(running)
                    if future.cancelled():
                        raise CancelledError
                    error = future.exception()
                job = known.pop(future.key)
                if isinstance(error, KilledWorker):
                    error = WorkerLostError(
                        f"the workers that were given it ended in the middle of it: {error}"
                    )
                yield Finished(job, None if error else future.result(), error)
                future.release()

    @contextmanager
    def _client(self) -> Iterator[Any]:
        try:
            from distributed import Client
        except ImportError:
            raise DataError.because(
                "cluster-extra", "Dask is not installed", hint="pip install 'inputdesign-cli[cluster]'"
            ) from None
        # Its diagnostics about lost connections are no news: what they lead to is an error of ours.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            client = Client(self.address, timeout=self.patience, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise _unreachable(self.address, str(error).splitlines()[0] if str(error) else "") from None
        try:
            client.wait_for_workers(1, timeout=self.patience)
            self._check_versions(client)
            yield client
        except TimeoutError:
            raise _unreachable(self.address, "it has no workers") from None
        finally:
            client.close()

    def _check_versions(self, client: Any) -> None:
        for worker, version in client.run(_version, on_error="return").items():
            if version != __version__:
                found = version if isinstance(version, str) else "no inputdesign-cli that can be imported"
                message = f"the worker {worker} has {found}, and this is {__version__}"
                hint = "install the same version everywhere, so that every point is computed alike"
                raise DataError.because("cluster-version", message, hint)


def _version() -> str:
    return __version__


def _threads(client: Any) -> int:
    return max(1, sum(client.nthreads().values()))


def _take(source: Iterator[Job], count: int) -> Iterator[Job]:
    for _ in range(count):
        try:
            yield next(source)
        except StopIteration:
            return


@contextmanager
def _reaching(address: str) -> Iterator[None]:
    try:
        yield
    except (OSError, TimeoutError, CancelledError) as lost:
        raise _unreachable(address, "the scheduler has ended") from lost


def _unreachable(address: str, why: str) -> DataError:
    message = f"there is no Dask cluster to compute on at {address}{f': {why}' if why else ''}"
    hint = "start one (`dask scheduler`, `dask worker ADDRESS --nthreads 1`) or leave out --cluster"
    return DataError.because("cluster-unreachable", message, hint)
