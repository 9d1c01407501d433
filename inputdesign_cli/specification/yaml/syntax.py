"""The YAML parser's diagnostics in the words of this house."""

from __future__ import annotations

import re

import yaml

from inputdesign_cli.errors import Location, SpecError

# What PyYAML says (a pattern: its C and its Python parser word it differently), what it means, what to do.
_MEANINGS = (
    ("',' or ']'", "a list is not closed, or a comma is missing", 'close it with "]"'),
    ("',' or '}'", "a mapping is not closed, or a comma is missing", 'close it with "}"'),
    (
        "mapping values are not allowed",
        "a colon stands where no key can begin",
        "start the key on its own line, at the indentation of its neighbours; put a text that contains "
        '": " in quotes',
    ),
    ("could not (find|found) expected ':'", "a key is not followed by a colon", 'write "key: value"'),
    (
        "did not find expected key|expected <block end>|did not find expected '-' indicator",
        "this line does not fit the indentation of the lines above",
        "keys of one mapping begin in the same column; so do the dashes of one list",
    ),
    ("unexpected end of stream", "a quotation mark is not closed", "close it on the same line"),
    ("undefined alias", "this alias (*name) refers to no anchor (&name) above it", "write the value out"),
    (
        "undefined tag handle",
        "tags (!name) are not used in a spec",
        'remove the tag; put a text that begins with "!" in quotes',
    ),
    (
        "unknown escape character",
        "this backslash is not a known escape",
        "use single quotes, or double the \\",
    ),
    (
        "expected the node content|did not find expected node content",
        "a value is missing or begins with a character that YAML reserves",
        "write a value; put a text that begins with a special character in quotes",
    ),
    (
        "expected <document start>",
        "the text goes on after the end of the spec",
        "a spec is one mapping of keys; check the indentation of this line",
    ),
)


def syntax_error(error: yaml.YAMLError, file: str, lines: list[str], shift: int = 0) -> SpecError:
    """The parser's error as a `SpecError` with its place; `shift` columns are added on the first line."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    line, column = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
    column += shift if line == 1 else 0
    if line > len(lines):
        # The end of the file: point behind the last character that was written.
        line = max(len(lines), 1)
        while line > 1 and not lines[line - 1].strip():
            line -= 1
        column = len(lines[line - 1].rstrip()) + 1 if lines else 1
    text = lines[line - 1] if lines else ""
    message, hint = _meaning(error, text[column - 1 : column])
    opened = getattr(error, "context_mark", None)
    if opened is not None and opened.line + 1 != line and "closed" in message:
        message += f" (it begins on line {opened.line + 1})"
    location = Location(file, line, column, text)
    return SpecError.because("yaml-syntax", message, hint, location=location)


def _meaning(error: yaml.YAMLError, character: str) -> tuple[str, str]:
    problem = " ".join(str(part) for part in (getattr(error, "problem", ""), getattr(error, "context", "")))
    if "cannot start any token" in problem or character == "\t":
        if character == "\t":
            return "a tab is used where YAML wants spaces", "indent with spaces"
        return f'a value cannot begin with "{character}"', "put the text in quotes"
    for pattern, message, hint in _MEANINGS:
        if re.search(pattern, problem):
            return message, hint
    return "this is not valid YAML", "compare with an example spec (`idesign init` writes one)"
