"""The sources of the methods behind the numbers of a run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from inputdesign_cli.outcome import Outcome
from inputdesign_cli.report.question import Question

_ENTRY = re.compile(r"^@\w+\{([^,]+),\n(.*?)^\}\n", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"^  (\w+) = \{(.*)\},$", re.MULTILINE)


@dataclass(frozen=True)
class Source:
    """Holds a publication: its entry in BibTeX, and its fields by name."""

    bibtex: str
    fields: Mapping[str, str]

    def __str__(self) -> str:
        """Return the citation: authors, title, journal or publisher, and year."""
        *others, last = self.fields["author"].split(" and ")
        authors = f"{', '.join(others)} and {last}" if others else last
        names = ("journal", "volume", "edition", "publisher", "eprint", "year", "pages")
        known = {name: self.fields[name].replace("--", "-") for name in names if name in self.fields}
        forms = {"edition": "{} edition,", "publisher": "{},", "eprint": "arXiv:{},"}
        forms |= {"year": "({})"} if "volume" in known else {}
        where = " ".join(forms.get(name, "{}").format(text) for name, text in known.items())
        return f"{authors}, {self.fields['title']}{f', {where}' if where else ''}."


@cache
def _known() -> Mapping[str, Source]:
    text = (resources.files(__package__) / "sources.bib").read_text(encoding="utf-8")
    return {found[1]: Source(found[0], dict(_FIELD.findall(found[2]))) for found in _ENTRY.finditer(text)}


def citations(question: Question, outcome: Outcome) -> list[Source]:
    """Return the sources of the methods that were used."""
    kind = None if outcome.objective is None else outcome.objective.kind
    lines, linear = "frequency_response" in question.asked, question.regression
    used = {
        "pintelon-schoukens-2012": lines,
        "bombois-least-costly": kind in ("least_cost", "shortest_experiment") and not (linear or lines),
        "rojas-asymptotic": "closed_loop_error" in question.asked,
        "eckhard-mse": "mean_squared_error" in question.asked,
        "mohan-spectral": question.family == "polynomial",
        "campi-garatti-2008": outcome.robust is not None and outcome.robust.risk is not None,
        "campi-garatti-2018": outcome.robust is not None and outcome.robust.risk is not None,
        "kiefer-wolfowitz-1960": outcome.objective is not None
        and outcome.objective.any_spectrum_bound is not None,
        "howard-1960": outcome.objective is not None and outcome.objective.any_record_bound is not None,
        "ljung-1999": not (linear or lines),
    }
    return [_known()[key] for key, is_used in used.items() if is_used]
