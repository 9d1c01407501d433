"""Files that hold another one in fewer bytes: what they are, and how to unpack them."""

from __future__ import annotations

import io
import shlex
import zipfile
from pathlib import Path

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files.sheet import unreadable

ZIP, _OLE, _ARRAY = b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x93NUMPY"
# How each kind begins, the program that unpacks it, and the ending that this asks for, if any.
_COMPRESSED = (
    (b"\x1f\x8b", "gzip", "gunzip", ".gz"),
    (b"BZh", "bzip2", "bunzip2", ".bz2"),
    (b"\xfd7zXZ\x00", "xz", "unxz", ".xz"),
    (b"\x28\xb5\x2f\xfd", "zstd", "unzstd", ".zst"),
    (b"7z\xbc\xaf\x27\x1c", "7z", "7z x", ""),
)
_ARRAYS = ".npy"
# What Excel's workbooks have inside, and those of ODF.
_WORKBOOK = ("[Content_Types].xml", "xl/", "content.xml")


def check_unpacked(path: Path, key: str, raw: bytes, *, workbook: bool) -> None:
    """Whether a file is what it holds.

    Args:
        workbook: whether its ending says that it is one.

    Raises:
        DataError: `data-unreadable`; it is compressed, or a spreadsheet that is not called so.
    """
    for mark, kind, program, ending in _COMPRESSED:
        if raw.startswith(mark) and not (mark == b"BZh" and not raw[3:4].isdigit()):
            raise _compressed(path, key, kind, program, ending)
    if raw.startswith(_ARRAY) and path.suffix.lower() != _ARRAYS:
        raise unreadable(path, key, "holds an array of NumPy", f"give it the ending {_ARRAYS}")
    if raw.startswith(ZIP):
        names = _names(raw)
        if names and all(name.endswith(_ARRAYS) for name in names):
            hint = "give it the ending .npz"
            raise unreadable(path, key, "holds arrays of NumPy, and its name does not end like that", hint)
        if names and not any(name.startswith(_WORKBOOK) for name in names):
            raise _compressed(path, key, "zip", "unzip")
        if not names and not workbook:
            hint = "write or copy it anew, and unpack it where it is an archive"
            raise unreadable(path, key, "is a damaged zip archive or workbook", hint)
    if raw.startswith((ZIP, _OLE)) and not workbook:
        hint = "save the sheet as CSV (comma separated values, UTF-8), and name that file"
        raise unreadable(path, key, "is a spreadsheet, no CSV file", hint)


def _names(raw: bytes) -> list[str]:
    """What an archive holds; nothing where it cannot be read."""
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            return archive.namelist()
    except Exception:  # whatever a broken archive leads the reader to
        return []


def _compressed(path: Path, key: str, kind: str, program: str, ending: str = "") -> DataError:
    file = shlex.quote(str(path))
    if ending and path.suffix != ending:
        file = f"< {file} > unpacked.csv"
    hint = f"unpack it, and name the file that it holds: {program} {file}"
    return unreadable(path, key, f"is compressed ({kind})", hint)
