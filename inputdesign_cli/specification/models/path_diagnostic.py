"""A diagnostic that knows the path of its key, but not yet the line of the file where the key stands."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic_core import PydanticCustomError

from inputdesign_cli.errors import Diagnostic
from inputdesign_cli.specification.yaml.places import Path, Places, format_key

CARRIER = "diagnostics"
"""The type of the one pydantic error that carries diagnostics of ours, and their place in its context."""


@dataclass(frozen=True)
class PathDiagnostic:
    """One thing that is wrong. `{key}` in message and hint stands for the full dotted name of `path`.

    Args:
        code: A code that `idesign explain` knows.
        message: What is wrong.
        hint: How to mend it.
        path: Where it is wrong, seen from the model that says so; from the root of the file in the end.
        at_key: Whether to point at the key and not at its value.
        keys: The parts of `path` that it is about, if not all of it.
        meant: The key that an unknown one probably stands for.
    """

    code: str
    message: str
    hint: str = ""
    path: Path = ()
    at_key: bool = False
    keys: tuple[str, ...] = ()
    meant: str = ""

    def placed(self, places: Places, whole: str) -> Diagnostic:
        """The diagnostic with its line; `whole` stands for the key where the whole file is meant."""
        key = format_key(self.path)
        location = places.location(places.mark(self.path, at_key=self.at_key))
        message, hint = (text.replace("{key}", key or whole) for text in (self.message, self.hint))
        return Diagnostic(self.code, message, hint, key, location)


def carry(*diagnostics: PathDiagnostic) -> PydanticCustomError:
    """The pydantic error that carries the diagnostics; a validator raises it."""
    return PydanticCustomError(CARRIER, CARRIER, {CARRIER: diagnostics})


def fail(code: str, message: str, hint: str = "") -> PydanticCustomError:
    """The pydantic error of one diagnostic about the value at hand."""
    return carry(PathDiagnostic(code, message, hint))
