"""What a validator found wrong: several things at once, with paths relative to where it stands.

A pydantic validator may raise one error; ours raise a `Findings` full of them, which travels through
pydantic in the context of a `PydanticCustomError` and is unfolded by `translate`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError

from inputdesign_cli.specification.yaml.places import Path
from inputdesign_cli.specification.yaml.scalars import clip

CARRIER = "findings"


@dataclass(frozen=True)
class Finding:
    """One thing wrong. `{key}` in message and hint stands for the full dotted name of `path`.

    `at_key` points at the key and not at its value; `keys` are the parts of `path` that it is about, if not
    all of it. `meant` is the key that an unknown one probably stands for.
    """

    code: str
    message: str
    hint: str = ""
    path: Path = ()
    at_key: bool = False
    keys: tuple[str, ...] = ()
    meant: str = ""


class Findings(list[Finding]):
    """A list of findings that a validator fills and then raises."""

    def add(self, code: str, message: str, hint: str = "", *path: str | int, at_key: bool = False) -> None:
        """Note one thing that is wrong with the value at `path` (relative)."""
        self.append(Finding(code, message, hint, path, at_key))

    def stop(self) -> None:
        """Raise all findings as one pydantic error, if there are any."""
        if self:
            raise PydanticCustomError(CARRIER, "findings", {CARRIER: tuple(self)})


def fail(code: str, message: str, hint: str = "", *path: str | int) -> PydanticCustomError:
    """A single finding, to be raised from a validator."""
    return PydanticCustomError(CARRIER, "findings", {CARRIER: (Finding(code, message, hint, path),)})


def describe(value: Any) -> str:
    """A value in words: "the number 5", "a list"."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"the number {show(value)}"
    if isinstance(value, str):
        return f"the text {clip(value)}"
    if isinstance(value, list | tuple):
        return "a list"
    if isinstance(value, dict):
        return "a mapping"
    return "nothing" if value is None else "something else"


def show(value: float) -> str:
    """A number as a person would write it."""
    return str(value) if isinstance(value, int) and abs(value) < 10**9 else f"{float(value):.6g}"
