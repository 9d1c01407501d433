"""Findings: remarks for or against data, a model or a design, with a stable code and a severity.

A kind of finding is declared once, in the file that tests for it and words it. Verdict and
trust follow from the severities, here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial, wraps
from inspect import cleandoc
from types import MappingProxyType
from typing import Concatenate, Literal, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
R = TypeVar("R")
CAUSES = ("unsettled", "contradicted", "unasked", "undetermined", "spikes", "drift", "nonlinearity", "chance")
"""Causes of an open verdict. The search did not settle; the data contradict the model; the question has no
answer at the estimate; other parameters explain the data nearly as well. For a response without a model:
spikes, a drift, a nonlinearity, or the scatter of its periods."""


class Severity(StrEnum):
    """The weight of a finding, from a remark to a contradiction."""

    NOTE = "note"
    """Good to know; it changes no verdict."""
    DOUBT = "doubt"
    """A reason to look again before numbers are trusted; it changes no verdict."""
    UNDECIDED = "undecided"
    """The verdict can be neither met nor missed."""
    REFUTED = "refuted"
    """The data contradict the model, so that nothing can be said of its accuracy."""


@dataclass(frozen=True)
class Finding:
    """One thing that was found.

    Attributes:
        code: stable name, explained by `idesign explain CODE`.
        severity: its effect on a verdict.
        message: one or two plain sentences: the fact, its place, and the remedy.
        where: the key, channel, parameter or file that it is about; empty for all of it.
        figures: its numbers and names as plain data.
    """

    code: str
    severity: Severity
    message: str
    where: str = ""
    figures: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}), hash=False)


KINDS: dict[str, FindingKind] = {}
"""Every kind that was declared, by its code."""


@dataclass(frozen=True)
class FindingKind:
    """A kind of finding: its code, its usual severity, and its explanation.

    Attributes:
        title: a short statement that begins with a capital letter.
        text: its meaning, and the test that finds it.
        remedy: the action to take.
        cause: one of `CAUSES`, for findings that are `undecided`; refuting ones have "contradicted".
    """

    code: str
    severity: Severity
    title: str
    text: str
    remedy: str
    cause: str = "undetermined"

    def __post_init__(self) -> None:
        if self.code in KINDS:
            raise ValueError(f"two kinds of findings have the code {self.code}")
        KINDS[self.code] = self

    def found(
        self,
        fact: str = "",
        *,
        where: str = "",
        remedy: str = "",
        severity: Severity | None = None,
        **figures: object,
    ) -> Finding:
        """Return a finding of this kind: its message is the title, the fact and the remedy.

        Args:
            fact: the fact in the case at hand.
            where: the key, channel, parameter or file that it is about.
            remedy: the remedy in the case at hand, if not that of the kind. One that begins with "Nothing" is
                left out of the message.
            severity: its severity, if the case at hand weighs more or less than usual.
            figures: its numbers and names.
        """
        advice = (remedy or self.remedy).replace("`", "")
        message = f"{self.title}{': ' * bool(fact)}{fact}. {'' if advice.startswith('Nothing') else advice}"
        return Finding(self.code, severity or self.severity, message.rstrip(), where, figures)

    def when(
        self,
        holds: object,
        fact: str = "",
        *,
        where: str = "",
        remedy: str = "",
        severity: Severity | None = None,
        **figures: object,
    ) -> list[Finding]:
        """Return a finding of this kind where something holds."""
        found = self.found(fact, where=where, remedy=remedy, severity=severity, **figures)
        return [found] if holds else []


def _kind(severity: Severity, code: str, text: str, remedy: str, cause: str = "undetermined") -> FindingKind:
    """Return a kind whose title is the first sentence of its text."""
    title, _, rest = text.partition(". ")
    return FindingKind(code, severity, title.rstrip("."), rest or text, remedy, cause)


note, doubt, unsure, refuted = (partial(_kind, severity) for severity in Severity)
"""Declare a kind by its code, text, remedy and, for `unsure`, the cause of the open verdict."""
NOTE, DOUBT, UNDECIDED, REFUTED = Severity.NOTE, Severity.DOUBT, Severity.UNDECIDED, Severity.REFUTED


def finding(
    severity: Severity, code: str, remedy: str, cause: str = "undetermined"
) -> Callable[[Callable[Concatenate[FindingKind, P], R]], Callable[P, R]]:
    """Declare the kind of findings that a function makes; its docstring explains them, up to `Args`."""

    def declared(function: Callable[Concatenate[FindingKind, P], R]) -> Callable[P, R]:
        text = cleandoc(function.__doc__ or "").partition("\n\nArgs:")[0]
        kind = _kind(severity, code, " ".join(text.split()), remedy, cause)

        @wraps(function)
        def made(*args: P.args, **kwargs: P.kwargs) -> R:
            return function(kind, *args, **kwargs)

        return made

    return declared


def cause_of(finding: Finding) -> str:
    """Return the cause why a finding leaves a verdict open; empty if it does not."""
    if finding.severity is Severity.REFUTED:
        return "contradicted"
    return KINDS[finding.code].cause if finding.severity is Severity.UNDECIDED else ""


def reasons(findings: Iterable[Finding]) -> dict[str, list[Finding]]:
    """Return the findings that forbid the verdicts "met" and "missed", by their cause."""
    found = list(findings)
    listed = {cause: [one for one in found if cause_of(one) == cause] for cause in CAUSES}
    return {cause: those for cause, those in listed.items() if those}


def verdict(findings: Iterable[Finding], *, met: bool) -> Literal["met", "missed", "undecided"]:
    """Return "met" or "missed" as the numbers show, or "undecided" if a finding forbids both."""
    if undecided(findings):
        return "undecided"
    return "met" if met else "missed"


def undecided(findings: Iterable[Finding]) -> bool:
    """Return whether findings forbid the verdicts "met" and "missed"."""
    return any(one.severity in (Severity.UNDECIDED, Severity.REFUTED) for one in findings)


def trusted(findings: Iterable[Finding]) -> bool:
    """Return whether nothing found speaks against trusting a model."""
    return not any(one.severity is not Severity.NOTE for one in findings)


def listed(rows: Sequence[int] | np.ndarray, word: str = "row", shown: int = 5) -> str:
    """Return numbers of rows, in rising order, for a message: `row 5`, `rows 5 to 9, 12, ..`."""
    numbers = np.asarray(rows, dtype=np.int64)
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    parts = [f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs[:shown]]
    more = ", .." if len(runs) > shown else ""
    return f"{word}{'s' * (len(numbers) > 1)} {', '.join(parts)}{more}"
