"""Bytes -> text, in the encodings that loggers and spreadsheets write."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files.sheet import unreadable

# The longer marks first: that of UTF-32 begins like that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
    (codecs.BOM_UTF8, "utf-8-sig"),
)
_LOOKED_AT = 4096
# Digits and Latin letters in UTF-16 have a zero in one of their two bytes.
_MOSTLY, _HARDLY = 0.4, 0.05
# Stretches of characters that no text has, and of what stands in place of bytes that are no text.
_CONTROL, _UNDECODED = re.compile(r"([\x00-\x08\x0e-\x1b])\1*"), re.compile("\ufffd+")
# More of them, and more than this share, are no faults in a text: it is none.
_FEW, _RARE = 3, 0.01
# What some loggers leave where a file ended early, or where DOS ended it.
_FILLING = "\x00\x1a"


def decoded(path: Path, key: str, raw: bytes) -> str:
    """The text of a file: UTF-8, UTF-16 (by its mark or by its zeros), UTF-32 by its mark, or Windows-1252.

    Raises:
        DataError: `data-unreadable`; it is no text.
    """
    encodings = _encodings(raw)
    for encoding in encodings:
        try:
            text = raw.decode(encoding).rstrip(_FILLING)
        except UnicodeDecodeError:
            continue
        if _CONTROL.search(text):
            raise _no_text(path, key, text, _CONTROL)
        return text
    raise _no_text(path, key, raw.decode(encodings[-1], errors="replace"), _UNDECODED)


def _encodings(raw: bytes) -> list[str]:
    marked = next((encoding for mark, encoding in _MARKS if raw.startswith(mark)), None)
    if marked:
        return [marked]
    begin = raw[:_LOOKED_AT]
    even, odd = (begin[k::2].count(0) / max(len(begin) // 2, 1) for k in (0, 1))
    if odd > _MOSTLY and even < _HARDLY:
        return ["utf-16-le"]
    if even > _MOSTLY and odd < _HARDLY:
        return ["utf-16-be"]
    return ["utf-8", "cp1252"]


def _no_text(path: Path, key: str, text: str, wrong: re.Pattern[str]) -> DataError:
    """The error about what is no text at all, or a text with a few faults: the line of the first."""
    others = sum(1 for one in (_CONTROL, _UNDECODED) for _ in one.finditer(text))
    if others > max(_FEW, _RARE * len(text)):
        what = "is no text (in UTF-8, UTF-16 or Windows-1252)"
        hint = "name a CSV file; arrays have the ending .mat or .npz, tables .xlsx or .parquet"
        return unreadable(path, key, what, hint)
    first = next(wrong.finditer(text))
    line = len(f"{text[: first.start()]}|".splitlines())
    count = len(first[0])
    character = f"{count} control character{'s' * (count > 1)} (code {ord(first[0][0])})"
    if wrong is _UNDECODED:
        character = "bytes that are no letters in UTF-8 or Windows-1252"
    hint = (
        "a logger that lost its power leaves such characters: take the line out, with times or a blank line "
        "to tell that samples are missing there; or save the file as UTF-8"
    )
    return unreadable(path, key, f"is no clean text: line {line} has {character}", hint, line)
