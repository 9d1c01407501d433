"""Diagnostics as text for a terminal and as plain data, with the meaning of codes; nothing is printed here.

`error_codes.yaml` explains the codes of errors; it is read at the first question.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files

import yaml
from rich.cells import cell_len

from inputdesign_cli.errors import Diagnostic, IdesignError, Location, bad_spec

_WIDTH = 100
"""Characters of an offending line that are shown; longer lines are clipped around the column."""

_BOLD, _RED, _BLUE, _CYAN, _RESET = "\x1b[1m", "\x1b[1;31m", "\x1b[1;34m", "\x1b[36m", "\x1b[0m"


def render(error: IdesignError, color: bool = False) -> str:
    """Return all diagnostics of an error, each with its place, the line with a caret, and the help.

    The last line says how to learn more. With `color` there are ANSI colours.
    """
    blocks = [_block(diagnostic, color) for diagnostic in error.diagnostics]
    codes = {diagnostic.code for diagnostic in error.diagnostics if diagnostic.code}
    footer = f"{len(blocks)} errors. " if len(blocks) > 1 else ""
    if codes:
        footer += f"`idesign explain {codes.pop() if len(codes) == 1 else 'CODE'}` says more."
    return "\n\n".join(filter(None, [*blocks, footer.strip()]))


def as_json(error: IdesignError) -> list[dict[str, object]]:
    """Return the diagnostics as plain data; `location` is null where absent, `details` are left out."""
    return [
        {key: value for key, value in asdict(diagnostic).items() if key != "details" or value}
        for diagnostic in error.diagnostics
    ]


def _block(diagnostic: Diagnostic, color: bool) -> str:
    place = diagnostic.location

    def paint(text: str, style: str) -> str:
        return f"{style}{text}{_RESET}" if text and color else text

    head = f"{paint(_where(place), _BOLD)}: " if place else ""
    code = f"[{diagnostic.code}]" if diagnostic.code else ""
    lines = [f"{head}{paint('error' + code, _RED)} {_clean(diagnostic.message)}"]
    # A file that could not be read has a place but no line to show.
    if place and place.text.strip():
        text, caret = _excerpt(place.text, place.column)
        number = "" if _is_override(place) else str(place.line)
        bar = paint("|", _BLUE)
        lines += [
            f"{paint(number, _BLUE)}{' ' if number else ''}{bar} {text}",
            f"{' ' * len(number)}{' ' if number else ''}{bar} {' ' * caret}{paint('^', _RED)}",
        ]
    if diagnostic.hint:
        lines.append(f"{paint('help:', _CYAN)} {_clean(diagnostic.hint)}")
    return "\n".join(lines)


def _where(place: Location) -> str:
    file = _clean(place.file).replace("\n", " ")
    return file if _is_override(place) else f"{file}:{place.line}:{place.column}"


def _is_override(place: Location) -> bool:
    return place.file.startswith("--set ")


def _excerpt(text: str, column: int) -> tuple[str, int]:
    """Return the line, clipped around the column if it is long, and the number of cells before the caret."""
    line = text.replace("\t", " ").rstrip()
    at = min(max(column - 1, 0), len(line))
    if len(line) > _WIDTH:
        start = max(0, min(at - _WIDTH // 2, len(line) - _WIDTH))
        before, after = "..." if start else "", "..." if start + _WIDTH < len(line) else ""
        line = before + line[start : start + _WIDTH] + after
        at += len(before) - start
    line = _clean(line)
    return line, cell_len(line[:at])


def _clean(text: str) -> str:
    """Return a text without characters that move the cursor or change the colours of a terminal."""
    return "".join(c if c.isprintable() or c == "\n" else "\N{REPLACEMENT CHARACTER}" for c in text)


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
