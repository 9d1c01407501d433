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


def said(part: str, outcome: Outcome, **more: object) -> list[str]:
    """Return the sentences of a part of the template about a result.

    Args:
        part: asked, proofs (what is proved of all other experiments), verdict, assumptions, ..
        more: what else the part knows by name.
    """
    kind = None if outcome.objective is None else outcome.objective.kind
    known = vars(outcome) | {
        "kind": kind,
        "words": objective(kind),
        "length": outcome.samples if outcome.signal is None else outcome.signal.samples,
        "given": None if outcome.identification is not None else _GIVEN.get(outcome.status or ""),
    }
    return sentences("inputdesign_cli.report", "result.txt", part, known | more)


def facts(outcome: Outcome, time_unit: str = "", part: str = "facts") -> list[Fact]:
    """Return the cost of an experiment and its accuracy, if the result has them.

    Args:
        time_unit: of frequencies.
        part: or how well an `estimate` explains the data, or how a campaign stands (`campaign_stands`).
    """
    parts = (text.split("::") for text in said(part, outcome, time_unit=time_unit))
    return [Fact(*(one.strip() for one in each)) for each in parts]


def answer(verb: str, outcome: Outcome) -> str:
    """Return the answer in sentences; the verb is the command that gave it."""
    stands, verdicts = facts(outcome, part="campaign_stands"), said("verdict", outcome)
    return " ".join(said("answer", outcome, verb=verb, stands=stands, verdicts=verdicts))


def provenance(environment: Mapping[str, object], more: Iterable[Fact] = ()) -> list[Fact]:
    """Return the versions, and further facts that show where numbers come from."""
    return [*more, *(Fact(name, str(version)) for name, version in environment.items() if version)]
