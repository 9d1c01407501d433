"""The line on the terminal while something is computed, which tells how far it is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from inputdesign_cli.cli.terminal import status
from inputdesign_cli.compute.watching import Counted, Round, watching

_PATIENCE = 2.0  # seconds after which it is told how far a computation is


@contextmanager
def computing(about: Path | str, *, quiet: bool, doing: str = "computing") -> Iterator[None]:
    """Show on stderr, if anybody is looking, what is computed inside, and after a while how far it is.

    Args:
        about: the file, or what else it is about.
    """
    with status(f"{about}: {doing} ...", quiet=quiet) as show:
        started = time.monotonic()

        def told(done: Round | Counted) -> None:
            if time.monotonic() - started > _PATIENCE:
                show(f"{about}: {done} ...")

        with watching(told):
            yield
