"""Say a result in words, for the terminal and for a page; `templates/result.txt` has the sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.outcome.sentences import sentences

# The status of an excitation that was given, in words.
_GIVEN = {"given": "", "met": ": it meets the accuracy", "missed": ": it misses the accuracy"}


class Fact(NamedTuple):
    """Holds a line of a table: its name, the value, and a note that may be empty."""

    name: str
    value: str
    note: str = ""


def _said(part: str, outcome: Outcome, **more: object) -> list[str]:
    """Return the sentences of a part of the template about a result."""
    kind = None if outcome.objective is None else outcome.objective.kind
    known = vars(outcome) | {
        "kind": kind,
        "words": objective(kind),
        "length": outcome.samples if outcome.signal is None else outcome.signal.samples,
        "given": None if outcome.identification is not None else _GIVEN.get(outcome.status or ""),
    }
    return sentences("inputdesign_cli.report", "result.txt", part, known | more)


def _facts(part: str, outcome: Outcome, time_unit: str = "") -> list[Fact]:
    parts = (text.split("::") for text in _said(part, outcome, time_unit=time_unit))
    return [Fact(*(one.strip() for one in each)) for each in parts]


def facts(outcome: Outcome, time_unit: str) -> list[Fact]:
    """Return the cost of an experiment and the accuracy that it gives, as far as they are in the result."""
    return _facts("facts", outcome, time_unit)


def estimate_facts(outcome: Outcome) -> list[Fact]:
    """Return how well the estimate explains the data."""
    return _facts("estimate", outcome)


def campaign_facts(outcome: Outcome) -> list[Fact]:
    """Return how a campaign stands: its parts so far, what has been reached, and what comes next."""
    return _facts("campaign_stands", outcome)


def asked(outcome: Outcome) -> list[Fact]:
    """Return what was asked of the experiment."""
    return [Fact("asked", text) for text in _said("asked", outcome)]


def proofs(outcome: Outcome) -> list[str]:
    """Return the sentences on what is proved of all other experiments."""
    return _said("proofs", outcome)


def verdict(outcome: Outcome) -> list[str]:
    """Return the verdict of an assessment, and what remains to be done."""
    return _said("verdict", outcome)


def answer(verb: str, outcome: Outcome) -> str:
    """Return the answer in sentences; the verb is the command that gave it."""
    stands, verdicts = campaign_facts(outcome), verdict(outcome)
    return " ".join(_said("answer", outcome, verb=verb, stands=stands, verdicts=verdicts))


def assumptions(outcome: Outcome, question: object) -> list[str]:
    """Return the assumptions on which the numbers rest, beyond the arithmetic."""
    return _said("assumptions", outcome, question=question)


def provenance(environment: Mapping[str, object], more: Iterable[Fact] = ()) -> list[Fact]:
    """Return the versions, and further facts that show where numbers come from."""
    return [*more, *(Fact(name, str(version)) for name, version in environment.items() if version)]
