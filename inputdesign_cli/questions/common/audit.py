"""The last check of every design: what is about to be written is reread, and evaluated by other means."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.outcome import Objective

APART = 1e-6
"""Two ways to the same number may differ by this share of it."""


def check_claims(wrong: Iterable[str], remedy: str) -> None:
    """Raise `InaccurateError` (`internal-disagreement`) with the first sentence on a claim that is wrong."""
    for claim in wrong:
        hint = f"{remedy}; if the spec is plain, please report it: the spec is enough to see the same"
        raise InaccurateError.because("internal-disagreement", claim, hint, "accuracy")


def of_bounds(claimed: Objective, apart: float = APART, size: float = 0.0) -> Iterator[str]:
    """No value lies beyond a bound that is called proved, by this share of the value, or of a larger size."""
    value, largest = claimed.value, claimed.upper_bound is not None
    for name, bound in (
        ("upper_bound", claimed.upper_bound),
        ("lower_bound", claimed.lower_bound),
        ("any_spectrum_bound", claimed.any_spectrum_bound),
    ):
        beyond = 0.0 if bound is None else value - bound
        if not (beyond if largest else -beyond) <= apart * max(abs(value), size):
            yield f"the value {value:.10g} lies beyond {name} ({bound:.10g})"


def of_cost(found: float, claimed: float) -> Iterator[str]:
    """The excitation costs what is claimed."""
    if not abs(found - claimed) <= APART * abs(found):
        yield f"the spectrum costs {found:.10g}, not {claimed:.10g}"


def of_limit(limit: PowerLimit, power: float) -> Iterator[str]:
    """The power keeps to its limit."""
    excess = power - limit.bound if limit.upper else limit.bound - power
    if not excess <= APART * limit.bound:
        yield f"{limit.key} is {limit.bound:.6g}, but the spectrum has {power:.10g}"
