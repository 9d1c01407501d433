"""A Dask cluster that is running already, by its address (needs the extra `cluster`)."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from inputdesign_cli.compute.executor import Answer, Finished, Job, WorkerLostError
from inputdesign_cli.errors import DataError
from inputdesign_cli.version import __version__

_AHEAD = 2  # submitted jobs for each thread of the cluster
_TICK = 2.0  # seconds between checks whether there still are workers


@dataclass(frozen=True)
class Cluster:
    """The workers behind the scheduler at `address`.

    A job whose worker is lost is given to another one by the scheduler, at most three times.
    Workers that join while jobs are running are used.
    """

    address: str
    patience: float = 10.0  # seconds to find the scheduler, and a first worker
    worker_timeout: float | None = None  # seconds without any worker before the work is given up
    say: Callable[[str], None] = field(default=lambda text: None)  # called with messages for the user
    shares_files: bool = field(default=False, init=False)

    def run(self, function: Callable[[Job], Answer], jobs: Iterable[Job]) -> Iterator[Finished[Job, Answer]]:
        """Yield every job with its answer, in the order in which they are finished.

        Raises:
            DataError: `cluster-extra`, `cluster-unreachable`, `cluster-version`, `cluster-no-workers`.
        """
        with self._client() as client:
            from distributed.scheduler import KilledWorker

            source = iter(jobs)
            known: dict[Any, Job] = {}
            while True:
                with _reaching(self.address):
                    free = _AHEAD * max(1, sum(client.nthreads().values())) - len(known)
                for job in islice(source, max(free, 0)):
                    with _reaching(self.address):
                        known[client.submit(function, job, pure=False)] = job
                if not known:
                    return
                for future in self._finished(client, list(known)):
                    job = known.pop(future)
                    with _reaching(self.address):
                        error = future.exception()
                    if isinstance(error, KilledWorker):
                        lost = f"the workers that were given it ended in the middle of it: {error}"
                        error = WorkerLostError(lost)
                    yield Finished(job, None if error else future.result(), error)
                    future.release()

    def _finished(self, client: Any, futures: list[Any]) -> Iterable[Any]:
        """Return the finished jobs, one at least; report an absence of workers and wait."""
        from distributed import wait

        alone_since: float | None = None
        while True:
            with _reaching(self.address), suppress(TimeoutError), client.as_current():
                return wait(futures, timeout=_TICK, return_when="FIRST_COMPLETED").done
            with _reaching(self.address):
                workers = client.nthreads()
            if workers:
                alone_since = None
                continue
            if alone_since is None:
                alone_since = time.monotonic()
                self.say(f"no workers at {self.address}; waiting")
            alone = time.monotonic() - alone_since
            if self.worker_timeout is not None and alone > self.worker_timeout:
                raise DataError.because(
                    "cluster-no-workers",
                    f"the cluster at {self.address} has had no workers for {alone:.0f} seconds",
                    "start workers (`dask worker ADDRESS --nthreads 1`), then give the same command again",
                )

    @contextmanager
    def _client(self) -> Iterator[Any]:
        try:
            from distributed import Client, Security
        except ImportError:
            raise DataError.because(
                "cluster-extra", "Dask is not installed", hint="pip install 'inputdesign-cli[cluster]'"
            ) from None
        # Its diagnostics about lost connections are hidden: their consequences are reported as our errors.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            encrypts = Security().get_connection_args("client").get("ssl_context") is not None
            if self.address.startswith("tls:") and not encrypts:
                raise ValueError("TLS asks for certificates: see docs/security.md")
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
