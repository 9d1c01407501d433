"""Explain the codes of errors by `error_codes.yaml`, which is read at the first question."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import yaml

from inputdesign_cli.errors import bad_spec


@dataclass(frozen=True)
class Explanation:
    """Explains a code in full: its title, its meaning, and its remedy."""

    title: str
    text: str
    remedy: str


@cache
def explanations() -> dict[str, Explanation]:
    """Return every code with its explanation, in the order of the file."""
    content = files("inputdesign_cli").joinpath("error_codes.yaml").read_text(encoding="utf-8")
    return {code: Explanation(**entry) for code, entry in yaml.safe_load(content).items()}


def explanation(code: str, known: Mapping[str, Explanation]) -> str:
    """Return the explanation of a code as text for a terminal.

    Args:
        code: the code to explain.
        known: all codes there are.

    Raises:
        SpecError: there is no such code; the hint names a similar one.
    """
    if code not in known:
        near = difflib.get_close_matches(code, known, n=1)
        hint = f'did you mean "{near[0]}"?' if near else "`idesign explain` lists all codes"
        raise bad_spec("unknown-code", f"there is no code {code!r}", hint=hint)
    found = known[code]
    return f"{code}: {found.title}\n\n{found.text}\n\nWhat to do: {found.remedy}"
