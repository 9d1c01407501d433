"""The error types of the package.

Every error that a user can cause is a `Diagnostic`: a stable code, a sentence that states the error, and a
hint at its remedy. `idesign explain CODE` documents the code, see `error_codes.yaml`. The mathematics names
only the key (`plant.F`); the spec adds file, line and column if it was read from a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

STANDARD_STREAM = "-"  # stands for standard input or output in place of the name of a file

EXIT_DONE = 0
EXIT_MISSED = 1
EXIT_BAD_INPUT = 2
EXIT_INFEASIBLE = 3
EXIT_INACCURATE = 4
EXIT_UNDECIDED = 5
EXIT_INTERRUPTED = 130


@dataclass(frozen=True)
class Location:
    """A place in a text file: `line` and `column` count from 1, `text` is the whole line."""

    file: str
    line: int
    column: int
    text: str = ""


@dataclass(frozen=True)
class Diagnostic:
    """One error or warning: its code to look up, its message, its remedy, and its place.

    `details` are the figures of the message for programs: plain data, ready for JSON.
    """

    code: str
    message: str
    hint: str = ""
    key: str = ""
    location: Location | None = None
    details: Mapping[str, object] = field(default_factory=dict, hash=False)


class IdesignError(Exception):
    """An error that the user can understand and mend; carries one or more diagnostics.

    `exit_code` is the exit code of the command line for it.
    """

    exit_code = EXIT_BAD_INPUT

    def __init__(self, diagnostics: Diagnostic | Sequence[Diagnostic]) -> None:
        self.diagnostics = (diagnostics,) if isinstance(diagnostics, Diagnostic) else tuple(diagnostics)
        super().__init__("; ".join(c.message for c in self.diagnostics))

    @classmethod
    def because(
        cls, code: str, message: str, hint: str = "", key: str = "", location: Location | None = None
    ) -> Self:
        """Return an error with a single diagnostic."""
        return cls(Diagnostic(code, message, hint, key, location))


class SpecError(IdesignError):
    """Raised where the spec cannot be read, or states a problem that is not well posed."""


class DataError(IdesignError):
    """Raised where a data file (table of r_adm, recorded signals) cannot be used."""


class OutputError(IdesignError):
    """Raised where the results cannot be written."""


class InfeasibleError(IdesignError):
    """Raised where no excitation can meet the requirements of the spec."""

    exit_code = EXIT_INFEASIBLE


class InaccurateError(IdesignError):
    """Raised where the solver stopped before the accuracy that the spec asks for was proved."""

    exit_code = EXIT_INACCURATE


def bad_spec(code: str, message: str, *, hint: str = "", key: str = "") -> SpecError:
    """Return a `SpecError` with a single diagnostic."""
    return SpecError.because(code, message, hint, key)


def refuse(key: str, what: str, hint: str, *, who: str = "this version") -> SpecError:
    """Return the error `not-supported`: `who` does not do `what`."""
    return bad_spec("not-supported", f"{who} does not {what}", hint=hint, key=key)
