"""What a page shows, shared by the one who computes it and by those who look at it."""

from __future__ import annotations

from threading import Condition

_FIRST = 1


class Board:
    """One page, and a number that grows whenever it changes."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._page, self._version = "", _FIRST - 1

    def show(self, page: str) -> None:
        """Put up another page, a whole HTML document."""
        with self._changed:
            if page != self._page:
                self._page, self._version = page, self._version + 1
                self._changed.notify_all()

    @property
    def page(self) -> tuple[str, int]:
        """The page, and its number."""
        with self._changed:
            return self._page, self._version

    def newer_than(self, version: int, patience: float) -> int:
        """The number of the page, as soon as it is another than `version` or after `patience` seconds."""
        with self._changed:
            self._changed.wait_for(lambda: self._version != version, patience)
            return self._version
