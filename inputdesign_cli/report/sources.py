"""What the numbers of a run rest on, and whose methods gave them."""

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
    """A publication: its entry in BibTeX, and its fields by name."""

    bibtex: str
    fields: Mapping[str, str]

    def __str__(self) -> str:
        """Authors, title, where it appeared, and the year."""
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


def assumptions(question: Question, outcome: Outcome) -> list[str]:
    """What the numbers rest on, beyond the arithmetic."""
    rests = "The design is best" if outcome.objective is not None else "The figures hold"
    if outcome.frequency_response is not None and outcome.frequency_response.method:
        said = [
            "The plant is linear and in steady state; the noise is estimated from the scatter of the data."
        ]
    elif outcome.identification is not None:
        from_spec = "Orders and delay are those of the spec; the numbers were estimated from the data."
        chosen = "Orders and delays were chosen by what estimates from one part simulate of the other."
        said = [chosen if outcome.exploration is not None else from_spec]
    elif outcome.robust is not None:
        said = [
            f"The plant is as the uncertainty of the spec describes it. {rests} for the plants that were "
            "drawn from it or listed; shares of other plants are those of plants drawn in the same way. If "
            "the description is wrong nothing is said: none of this is a statement about the true plant."
        ]
    else:
        said = [
            f"The plant and the noise are as the spec has them. {rests} for this nominal system; the "
            "accuracy of a model of another system may differ."
        ]
    if outcome.model_error is not None and outcome.model_error.worst_ratio is not None:
        first = " and of first order in the parameters" if question.linearised else ""
        said.append(
            "The covariance of the estimate is the asymptotic one of a consistent and efficient estimate; "
            f"r_u is therefore asymptotic in the number of samples{first}."
        )
    found = outcome.objective
    if found is not None and (found.lower_bound is not None or found.upper_bound is not None):
        said.append(
            "The proved bounds are values of dual points, computed in double precision; they hold to the "
            "rounding of integrals and eigenvalues, and of maxima over frequency sought on a refined grid."
        )
    if question.closed_loop:
        said.append(
            "Powers are those that the excitation r adds to the normal operation of the loop; what the noise "
            "causes anyway is not counted."
        )
    if outcome.signal is not None and outcome.signal.worst_ratio is not None:
        said.append(
            "The worst ratio of the signal is computed from the very samples of signal.csv, which start "
            "from rest; the spectrum's own figures hold for a stationary signal of that spectrum."
        )
    if outcome.solver is not None and outcome.solver.method == "lmi":
        said.append("The accuracy was imposed on a grid of frequencies: between them it may be violated.")
    return said


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
        "ljung-1999": not (linear or lines),
    }
    return [_known()[key] for key, is_used in used.items() if is_used]
