"""The summary of a run in the terminal: a few aligned lines, the same in a pipe."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.outcome.results import Result
from inputdesign_cli.report.evidence import (
    campaign_facts,
    estimate_facts,
    estimate_table,
    requirement_table,
    simulation_table,
    verdict,
)
from inputdesign_cli.report.facts import GIVEN, facts, proofs
from inputdesign_cli.report.numbers import BREAK, Rows

_NONE = Rows((), ())
Line = tuple[str, str]


def summary(result: Result, time_unit: str, files: Sequence[Path], *, replaced: bool = False) -> str:
    """What was asked, what it costs, what is proved, how close the error comes, and where the files are.

    Lines whose numbers the result does not have are left out.

    Args:
        replaced: whether a run with other values stood there before.
    """
    lines = [
        *campaign_facts(result),
        *_data(result, time_unit),
        *_asked(result),
        *((name, f"{text}   ({note})" if note else text) for name, text, note in facts(result, time_unit)),
        *_named("proved", proofs(result)),
        *_simulated(result),
        *(("note", text) for text in result.get("notes", [])),
        *(("files", f"{files[-1].parent}: {', '.join(file.name for file in files)}") for _ in files[:1]),
        *([("replaced", "a run of the same files with other values in the spec")] if replaced else []),
    ]
    title = result.get("title")
    return "\n".join([*([title, ""] if title else []), *aligned(lines, gap=3, wrap=True)])


def _data(result: Result, time_unit: str) -> Iterator[Line]:
    """An estimate with its standard deviations; each requirement with what the data reach."""
    estimate = estimate_table(result)
    if estimate:
        yield "estimate", ", ".join(f"{name} {value} +- {spread}" for name, value, spread, _ in estimate.rows)
    yield from ((name, text) for name, text, _ in estimate_facts(result))
    verdicts = []
    for name, ratio, frequency, found in (requirement_table(result, time_unit) or _NONE).rows:
        where = f" at {frequency} rad/{time_unit}" if frequency else ""
        verdicts.append(f"{name} {found}: the error that these data give is {ratio} of the admissible{where}")
    yield from _named("assessed", verdicts)
    yield from _named("verdict", verdict(result))


def _asked(result: Result) -> Iterator[Line]:
    status, asked = result.get("status"), objective(result.get("objective", {}).get("kind")).asked
    if status in GIVEN and "identification" not in result:
        asked = f"what the given excitation buys{GIVEN[status]}"
    if asked:
        yield "asked", asked


def _simulated(result: Result) -> Iterator[Line]:
    """A line for every input that was tried; remarks on a number follow it in parentheses."""
    table = simulation_table(result)
    if table:
        yield "simulated", f"{result['simulation']['runs']} runs of each input"
        for name, *cells in table.rows:
            told = [
                f"{head} {' ('.join(cell.split(BREAK))}{')' * cell.count(BREAK)}"
                for head, cell in zip(table.head[1:], cells, strict=True)
                if cell
            ]
            yield "", f"{name}: {', '.join(told)}".replace("±", "+-")


def _named(name: str, texts: Iterable[str]) -> Iterator[Line]:
    """Lines of which the first alone carries the name."""
    return (("" if i else name, text) for i, text in enumerate(texts))
