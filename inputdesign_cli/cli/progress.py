"""A line on the terminal that tells how far a sweep is, how fast it goes and when it will be done."""

from __future__ import annotations

import sys
import time
from typing import Any

from inputdesign_cli.cli.terminal import CLEAR_LINE

_WIDTH = 24
_EVERY = 0.1  # seconds


class ProgressLine:
    """Shows progress on stderr, if anybody is looking; call it with each `Progress`, and `close` it."""

    def __init__(self, *, quiet: bool) -> None:
        self.shown = sys.stderr.isatty() and not quiet
        self.started = time.monotonic()
        self.next = 0.0

    def __call__(self, progress: Any) -> None:
        """Draw the line anew, ten times a second at most."""
        now = time.monotonic()
        if self.shown and (now >= self.next or progress.passed == progress.total):
            self.next = now + _EVERY
            line = progress_text(progress, now - self.started)
            print(f"{CLEAR_LINE}{line}", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Clear the line."""
        if self.shown:
            print(CLEAR_LINE, end="", file=sys.stderr, flush=True)


def progress_text(progress: Any, seconds: float) -> str:
    """The line: a bar, the count, the rate and the time left. Points done before do not count as speed."""
    filled = _WIDTH * progress.passed // max(progress.total, 1)
    text = f"[{'#' * filled}{'.' * (_WIDTH - filled)}] {progress.passed}/{progress.total}"
    if progress.computed and seconds > 0:
        rate = progress.computed / seconds
        left = (progress.total - progress.passed) / rate
        text += f"  {rate:.3g} points/s  {duration(left)} left"
    return text + (f"  {progress.failed} without a result" if progress.failed else "")


def duration(seconds: float) -> str:
    """Hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
