"""Did you mean: near words for unknown keys and choices."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any

from inputdesign_cli.specification.models.findings import describe

# Words that people use for ours; difflib would not find them.
_SYNONYMS = {
    "Ts": "sample_time",
    "dt": "sample_time",
    "sampling_time": "sample_time",
    "N": "samples",
    "length": "samples",
    "num": "numerator",
    "den": "denominator",
    "lambda": "variance",
    "sigma2": "variance",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "minute": "min",
    "minutes": "min",
    "hour": "h",
    "hours": "h",
    "day": "d",
    "days": "d",
    "optimized": "optimised",
    "gaussian": "filtered_noise",
}


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that was probably meant."""
    known = list(known)
    if (synonym := _SYNONYMS.get(word)) in known:
        return synonym
    lower = {k.lower(): k for k in known}
    flat = word[:80].lower().replace("-", "_").replace(" ", "_")
    near = difflib.get_close_matches(flat, lower, n=1, cutoff=0.6)
    return lower[near[0]] if near else None


def choices(known: Sequence[str]) -> str:
    """ "a, b or c"."""
    return known[0] if len(known) == 1 else ", ".join(known[:-1]) + " or " + known[-1]


def unknown_word(value: Any, known: Sequence[str]) -> tuple[str, str]:
    """Message and hint for a value that is not one of the known words."""
    message = f"{{key}} must be {choices(known)}, not {describe(value)}"
    near = nearest(value, known) if isinstance(value, str) else None
    return message, f'did you mean "{near}"?' if near else ""
