"""Interruptions as they are: Python wraps those that come while a class is made, up to version 3.11."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def bare_interruptions() -> Iterator[None]:
    """Within, Ctrl-C and the end by a signal are never the cause of a RuntimeError, but themselves.

    Raises:
        KeyboardInterrupt, SystemExit: where `type.__new__` made a RuntimeError of them.
    """
    try:
        yield
    except RuntimeError as error:
        if isinstance(error.__cause__, KeyboardInterrupt | SystemExit):
            raise error.__cause__ from None
        raise
