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
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1b]")
# What some loggers leave where a file ended early, or where DOS ended it.
_FILLING = "\x00\x1a"


def decoded(path: Path, key: str, raw: bytes) -> str:
    """The text of a file: UTF-8, UTF-16 (by its mark or by its zeros), UTF-32 by its mark, or Windows-1252.

    Raises:
        DataError: `data-unreadable`; it is no text.
    """
    text = None
    for encoding in _encodings(raw):
        try:
            text = raw.decode(encoding).rstrip(_FILLING)
            break
        except UnicodeDecodeError:
            continue
    if text is None or _CONTROL.search(text):
        raise _no_text(path, key)
    return text


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


def _no_text(path: Path, key: str) -> DataError:
    return unreadable(
        path,
        key,
        "is no text (in UTF-8, UTF-16 or Windows-1252)",
        "name a CSV file; arrays have the ending .mat or .npz, tables .xlsx or .parquet",
    )
