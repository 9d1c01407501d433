"""Figures drawn by a second process: it loads what draws them while this one still computes.

python -m inputdesign_cli.figures.second_process   # reads what to draw from its input, writes the files
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from inputdesign_cli.runs.results import Results


class SecondProcess:
    """Draws the figures of one run, by a process of its own where that saves time, and otherwise here.

    It saves time where there is a second processor, unless this process has loaded matplotlib itself. Where
    the second process fails the figures are drawn here.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def begin(self) -> None:
        """Start the process, which then loads what it needs."""
        if len(os.sched_getaffinity(0)) < 2 or "matplotlib" in sys.modules or not sys.executable:
            return
        # -P: no module comes from the directory of the user. A session of its own: an interrupt from the
        # keyboard is for this process, and that one ends with its input.
        with suppress(OSError):
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )

    def draw_all(self, results: Results, file_type: str) -> dict[str, bytes]:
        """The figures of a run by their file names, see `plots.draw_all`."""
        return self._elsewhere(results, file_type) or _here(results, file_type)

    def _elsewhere(self, results: Results, file_type: str) -> dict[str, bytes]:
        if self._process is None:
            return {}
        drawn, _ = self._process.communicate(pickle.dumps((results, file_type)))
        return pickle.loads(drawn) if self._process.returncode == 0 else {}

    def end(self) -> None:
        """Stop the process, if it still runs."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.communicate()


@contextmanager
def second_process(*, wanted: bool) -> Iterator[SecondProcess]:
    """A second process that draws while this context lasts; none begins where no figures are `wanted`."""
    process = SecondProcess()
    try:
        if wanted:
            process.begin()
        yield process
    finally:
        process.end()


def _here(results: Results, file_type: str) -> dict[str, bytes]:
    from inputdesign_cli.figures.plots import draw_all

    return draw_all(results, file_type)


def _serve() -> None:
    import inputdesign_cli.figures.plots  # noqa: F401, before there is anything to draw

    results, file_type = pickle.load(sys.stdin.buffer)
    sys.stdout.buffer.write(pickle.dumps(_here(results, file_type)))


if __name__ == "__main__":
    _serve()
