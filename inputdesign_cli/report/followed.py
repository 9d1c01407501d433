"""The content of a file that somebody else may have written, which tells what was read of it last.

Nothing says what each entry of a result must be. Where one is not of its kind something fails right after it
was read: the error can then name it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import SupportsIndex

from inputdesign_cli.outcome.results import Json


@dataclass
class Trail:
    """The path of the entry that was read last, such as `signal.power[0]`; empty before."""

    last: str = ""

    def follow(self, value: Json, path: str = "") -> Json:
        """The value; mappings and lists note what is read of them."""
        if isinstance(value, dict):
            return _Mapping(self, value, path)
        return _List(self, value, path) if isinstance(value, list) else value


class _Mapping(dict[str, Json]):
    def __init__(self, trail: Trail, content: dict[str, Json], path: str) -> None:
        self._trail, self._prefix = trail, f"{path}." if path else ""
        super().__init__({key: trail.follow(value, self._prefix + key) for key, value in content.items()})

    def __getitem__(self, key: str) -> Json:
        self._trail.last = self._prefix + key
        return super().__getitem__(key)

    def get(self, key: str, default: Json = None) -> Json:
        self._trail.last = self._prefix + key
        return super().get(key, default)


class _List(list[Json]):
    def __init__(self, trail: Trail, content: list[Json], path: str) -> None:
        self._trail, self._path = trail, path
        super().__init__(trail.follow(value, f"{path}[{i}]") for i, value in enumerate(content))

    def __getitem__(self, index: SupportsIndex | slice) -> Json:
        if not isinstance(index, slice):
            self._trail.last = f"{self._path}[{index}]"
        return super().__getitem__(index)

    def __iter__(self) -> Iterator[Json]:
        return (self[i] for i in range(len(self)))
