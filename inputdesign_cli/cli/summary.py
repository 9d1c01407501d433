"""The summary of a run in the terminal: a few aligned lines, the same in a pipe."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.report.facts import (
    BREAK,
    Fact,
    Rows,
    estimate_table,
    facts,
    requirement_table,
    said,
    simulation_table,
)

_NONE = Rows((), ())
Line = tuple[str, str]


def summary(outcome: Outcome, time_unit: str, files: Sequence[Path], *, replaced: bool = False) -> str:
    """Return a result in lines: the question, its cost, the proved bounds, the error reached, and the folder.

    Lines whose numbers the result does not have are left out.

    Args:
        replaced: whether a run with other values stood there before.
    """
    lines = [
        *_lines(facts(outcome, part="campaign_stands")),
        *(_trouble(outcome, files) if _is_trouble(outcome) else _everything(outcome, time_unit)),
        *(("files", str(file.parent)) for file in files[:1]),
        *([("replaced", "a run of the same files with other values in the spec")] if replaced else []),
    ]
    title = outcome.title
    # A command is to be copied: a terminal must not break it.
    page = [*aligned(lines, gap=3, wrap=True), *said("next", outcome)]
    return "\n".join([*([title, ""] if title else []), *page])


def _is_trouble(outcome: Outcome) -> bool:
    """Return whether one finding leaves a verdict open and explains the others."""
    assessment = outcome.assessment
    return outcome.campaign is None and assessment is not None and assessment.next is not None


def _trouble(outcome: Outcome, files: Sequence[Path]) -> Iterator[Line]:
    """Yield the finding that comes first: no number of a refuted model counts."""
    yield from _named("verdict", said("verdict", outcome))
    more = len(outcome.notes or ()) - 1
    if more > 0:
        yield "note", f"{more} more {'in result.json' if files else 'with --json'}; most follow from this one"


def _everything(outcome: Outcome, time_unit: str) -> list[Line]:
    """Return the results and the proofs, with all notes."""
    return [
        *_data(outcome, time_unit),
        *(("asked", text) for text in said("asked", outcome)),
        *_lines(facts(outcome, time_unit)),
        *_named("proved", said("proofs", outcome)),
        *_simulated(outcome),
        *_notes(outcome),
    ]


def _notes(outcome: Outcome) -> Iterator[Line]:
    """Yield the findings, each by its severity: a doubt is more than a note."""
    severities = {one.message: str(one.severity) for one in outcome.findings or ()}
    return ((severities.get(text, "note"), text) for text in outcome.notes or ())


def _lines(found: Iterable[Fact]) -> Iterator[Line]:
    return ((name, f"{text}   ({note})" if note else text) for name, text, note in found)


def _data(outcome: Outcome, time_unit: str) -> Iterator[Line]:
    """Yield the estimate with its standard deviations, and each requirement with the ratio reached."""
    estimate = estimate_table(outcome)
    if estimate:
        rivals = outcome.identification is not None and outcome.identification.rivals
        listed = ", ".join(f"{name} {value} +- {spread}" for name, value, spread, _ in estimate.rows)
        also = "; levels are estimated as well" * (outcome.exploration is not None)
        also += "; or other parameters, see rivals in result.json" * bool(rivals)
        yield "estimate", f"{listed}   (+-: one standard deviation{also})"
    yield from _lines(facts(outcome, part="estimate"))
    verdicts = []
    for name, ratio, frequency, found in (requirement_table(outcome, time_unit) or _NONE).rows:
        places = {"": "", "0": ", most at the lowest frequencies"}
        where = places.get(frequency, f", most at {frequency} rad/{time_unit}")
        verdicts.append(
            f"{name} {found}: the error with these data is {ratio} of the admissible error{where}"
        )
    yield from _named("assessed", verdicts)
    yield from _named("verdict", said("verdict", outcome))


def _simulated(outcome: Outcome) -> Iterator[Line]:
    """Yield a line for every input that was tried; remarks on a number follow it in parentheses."""
    found = outcome.simulation
    table = simulation_table(found)
    if table and found is not None:
        yield "simulated", f"{found.runs} runs of each input"
        for name, *cells in table.rows:
            figures = [
                f"{head} {' ('.join(cell.split(BREAK))}{')' * cell.count(BREAK)}"
                for head, cell in zip(table.head[1:], cells, strict=True)
                if cell
            ]
            yield "", f"{name}: {', '.join(figures)}".replace("±", "+-")


def _named(name: str, texts: Iterable[str]) -> Iterator[Line]:
    """Return lines of which only the first carries the name."""
    return (("" if i else name, text) for i, text in enumerate(texts))
