"""A line on the terminal that tells how far a sweep is, how fast it goes and when it will be done."""

from __future__ import annotations

import sys
import time
from datetime import timedelta
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from inputdesign_cli.sweeps.running import Progress


class ProgressLine:
    """Shows progress on stderr, if anybody is looking; call it with each `Progress`, and `close` it."""

    def __init__(self, *, quiet: bool) -> None:
        self._started = time.monotonic()
        self._bar = None
        if sys.stderr.isatty() and not quiet:
            from rich import progress
            from rich.console import Console

            columns = (progress.BarColumn(24), progress.MofNCompleteColumn(), "{task.description}")
            self._bar = progress.Progress(*columns, console=Console(stderr=True), transient=True)
            self._task = self._bar.add_task("", total=None)
            self._bar.start()
            # A sweep may be killed at any moment, and nobody would bring a hidden cursor back.
            self._bar.console.show_cursor(True)

    def __call__(self, progress: Progress) -> None:
        """Tell how far the sweep is."""
        if self._bar is not None:
            told = pace(progress, time.monotonic() - self._started)
            self._bar.update(self._task, completed=progress.passed, total=progress.total, description=told)

    def close(self) -> None:
        """Clear the line."""
        if self._bar is not None:
            self._bar.stop()


def pace(progress: Progress, seconds: float) -> str:
    """The rate, the time left and the failures. Points done before do not count as speed."""
    told = []
    if progress.computed and seconds > 0:
        rate = progress.computed / seconds
        left = timedelta(seconds=round((progress.total - progress.passed) / rate))
        told.append(f"{rate:.3g} points/s  {left} left")
    if progress.failed:
        told.append(f"{progress.failed} without a result")
    return "  ".join(told)
