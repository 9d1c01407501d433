"""The spectrum of a draft: the simplest that is near to every spectrum, and rather no sinusoids.

Filtered noise has power between the lines of a multisine, so that its record does not repeat. A dead time
that is a period longer would explain a record that does nearly as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from inputdesign_cli.outcome.results import Result
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.composing import Draft
from inputdesign_cli.wizard.faults import in_their_words

# From the simplest on; sinusoids no more than half the samples.
_ORDERS, _LINES = (20, 40), (60, 120, 240)
_ENOUGH = 1.02  # of the bound over every spectrum
_LEAST_GAP = 1e-3  # smaller gaps are written as this
_BEYOND = 2.0  # a bound that many times better leaves limits out, and says nothing

Solve = Callable[[Spec], Result]


@dataclass(frozen=True)
class _Tried:
    """A draft with a spectrum, the value that it reaches, and a bound on that of every spectrum."""

    draft: Draft
    value: float
    bound: float
    rivals: bool

    def commented(self) -> Draft:
        """Return the draft; its comment says how much better another spectrum may be."""
        comment = f"{self.draft.why}; longer ones are no better, as far as was tried"
        if self.value <= _BEYOND * self.bound:
            gap = max(self.value / self.bound - 1.0, _LEAST_GAP)
            comment = f"{self.draft.why}: no other is better by more than {per_cent(gap, 2)}"
        return replace(self.draft, why=comment)


def with_spectrum(draft: Draft, solve: Solve) -> Draft:
    """Return the draft with the simplest spectrum that is within 2 % of every other at the plant as stated.

    Where none is, it gets the simplest of the best; one whose record leaves other dead times open only where
    all do.

    Raises:
        IdesignError: nothing can be designed; in words of the answers.
    """
    if draft.spectrum is None:
        return draft
    tried: list[_Tried] = []
    for words, what in _spectra(draft.spec().experiment.samples):
        one = replace(draft, spectrum=words, why=what)
        with in_their_words(draft.said):
            result = solve(one.spec().with_(uncertainty=None, **{"signal.candidates": 1}))
        value, bound = (result["objective"].get(name) for name in ("value", "any_spectrum_bound"))
        rivals = bool(result.get("foreseen", {}).get("rivals"))
        tried.append(_Tried(one, float(value), float(bound or 0.0), rivals))
        if value <= _ENOUGH * tried[-1].bound and not rivals:
            break
    clear = [one for one in tried if not one.rivals] or tried
    least = min(one.value for one in clear)
    return next(one for one in clear if one.value <= _ENOUGH * least).commented()


def _spectra(samples: int) -> list[tuple[str, str]]:
    """Return the spectra to try in words of a spec and of a comment."""
    most = max(samples // 2, 1)
    lines = [min(_LINES[0], most), *(number for number in _LINES[1:] if number <= most)]
    return [
        *((f"{{type: fir, order: {order}}}", f"filtered noise of order {order}") for order in _ORDERS),
        *((f"{{type: multisine, lines: {number}}}", f"{number} sinusoids") for number in lines),
    ]
