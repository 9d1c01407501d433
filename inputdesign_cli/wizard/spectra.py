"""Which spectrum a draft gets: as many unknowns as bring it near to every spectrum, and rather no sinusoids.

Filtered noise has power between the lines of a multisine, so that its record does not repeat: a dead time
that is a period longer would explain a record that does nearly as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from inputdesign_cli.outcome.results import Result
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.composing import Draft
from inputdesign_cli.wizard.faults import in_their_words

# From the simplest on; sinusoids no more than half the samples.
_ORDERS, _LINES = (20, 40), (60, 120, 240)
_ENOUGH = 1.02  # of what every spectrum reaches
_TOLD = 1e-3  # smaller gaps are told as this
_BEYOND = 2.0  # a bound that many times better leaves limits out, and tells nothing

Solve = Callable[[Spec], Result]


@dataclass(frozen=True)
class _Tried:
    """A spectrum in words of a spec and of the user, what it reaches, and what every spectrum may."""

    words: str
    what: str
    value: float
    bound: float | None
    rivals: bool

    @property
    def near(self) -> bool:
        """Whether no other can be much better."""
        return self.bound is not None and self.value <= _ENOUGH * self.bound

    @property
    def told(self) -> str:
        """The comment on it."""
        if self.bound is None or self.value > _BEYOND * self.bound:
            return f"{self.what}; longer ones are no better, as far as was tried"
        gap = max(self.value / self.bound - 1.0, _TOLD)
        return f"{self.what}: no other is better by more than {per_cent(gap, 2)}"


def with_spectrum(draft: Draft, solve: Solve) -> Draft:
    """The draft with the simplest spectrum that is, at the plant as stated, within 2 % of every other.

    Where none is found that is, the simplest of the best; one whose record leaves other dead times open only
    where all do.

    Raises:
        IdesignError: nothing can be designed; said in words of the answers.
    """
    if not draft.chooses:
        return draft
    tried: list[_Tried] = []
    for words, what in _spectra(draft.spec()):
        with in_their_words(draft.said):
            one = _solved(draft, words, what, solve)
        tried.append(one)
        if one.near and not one.rivals:
            break
    clear = [one for one in tried if not one.rivals] or tried
    least = min(one.value for one in clear)
    best = next(one for one in clear if one.value <= _ENOUGH * least)
    return draft.with_spectrum(best.words, best.told)


def _spectra(spec: Spec) -> list[tuple[str, str]]:
    found = [(f"{{type: fir, order: {order}}}", f"filtered noise of order {order}") for order in _ORDERS]
    most = max(spec.experiment.samples // 2, 1)
    return found + [
        (f"{{type: multisine, lines: {min(lines, most)}}}", f"{min(lines, most)} sinusoids")
        for lines in _LINES
        if lines == _LINES[0] or lines <= most
    ]


def _solved(draft: Draft, words: str, what: str, solve: Solve) -> _Tried:
    spec = draft.with_spectrum(words, what).spec()
    result = solve(spec.with_(uncertainty=None, **{"signal.candidates": 1}))
    objective, rivals = result["objective"], result.get("foreseen", {}).get("rivals", [])
    bound = objective.get("any_spectrum_bound")
    return _Tried(
        words, what, float(objective["value"]), None if bound is None else float(bound), bool(rivals)
    )
