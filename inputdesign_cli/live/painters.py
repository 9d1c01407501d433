"""Processes that draw the pictures of a page side by side, once they have imported what it takes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

from inputdesign_cli.compute.executor import Executor, InProcess
from inputdesign_cli.compute.processes import Processes

_MOST = 4


class Painters:
    """Where pictures are drawn: here, until other processes are ready to."""

    def __init__(self, count: int) -> None:
        """Begin with none; `count` processes are made ready when asked for."""
        self._processes = Processes(count)
        self._getting_ready: Thread | None = None

    @property
    def executor(self) -> Executor:
        """Who draws the next page."""
        ready = self._getting_ready is not None and not self._getting_ready.is_alive()
        return self._processes if ready else InProcess()

    def get_ready(self) -> None:
        """Start the processes, if they have not been, beside everything else."""
        if self._getting_ready is None and self._processes.count > 1:
            jobs = range(self._processes.count)
            self._processes.start()
            self._getting_ready = Thread(target=lambda: list(self._processes.run(_import, jobs)), daemon=True)
            self._getting_ready.start()

    def end(self) -> None:
        """End the processes."""
        if self._getting_ready is not None:
            self._getting_ready.join()
        self._processes.end()


@contextmanager
def painters() -> Iterator[Painters]:
    """As many as there are processors, while the block runs."""
    found = Painters(min(os.cpu_count() or 1, _MOST))
    try:
        yield found
    finally:
        found.end()


def _import(_: int) -> None:
    from inputdesign_cli.figures.style import rendered

    rendered(lambda page: page.add_subplot().plot([0.0, 1.0], label="a"), "svg")
