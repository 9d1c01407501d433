"""Read the text of a spec file, with plain words for errors of files and encodings."""

from __future__ import annotations

import difflib
import errno
import os
from pathlib import Path

from inputdesign_cli.errors import STANDARD_STREAM, Diagnostic, Location, SpecError
from inputdesign_cli.regular_file import read_regular

MAX_BYTES = 10 * 1024 * 1024
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


def read_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a spec file in UTF-8; `SpecError` if it is missing, a folder or unreadable."""
    name = os.fspath(path)
    try:
        # The path may hold what the operating system cannot even name (a NUL): that is a ValueError.
        if Path(name).is_dir():
            what = f"{name} is a folder, not a spec file"
            raise _error("file-unreadable", what, name, "name the YAML file itself")
        raw = read_regular(name, MAX_BYTES + 1)
    except FileNotFoundError:
        raise _error("file-missing", f"there is no file {name}", name, _nearby(Path(name))) from None
    except PermissionError:
        hint = "check the permissions of the file"
        raise _error("file-unreadable", f"{name} may not be read", name, hint) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "the name is not a file name"
        piped = isinstance(error, OSError) and error.errno == errno.EINVAL
        hint = "name a file, or give - to read the spec from standard input" if piped else ""
        raise _error("file-unreadable", f"{name!r} cannot be read: {reason}", name, hint) from None
    if len(raw) > MAX_BYTES:
        hint = "is it a data file? A spec is a page of text; data belong into a CSV file that it names"
        raise _error("file-too-large", f"{name} is larger than {MAX_BYTES // 2**20} MiB", name, hint)
    return decode(raw, name)


def is_outside(path: Path, folder: Path) -> bool:
    """Return whether a file lies outside a folder, links followed."""
    try:
        return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
    except ValueError:
        return True


def outside(name: str, confine: Path, key: str, location: Location | None) -> Diagnostic:
    """Return the diagnostic about a file that a spec names and may not read."""
    message = f"{key} names {name}, which lies outside {confine}"
    return Diagnostic("file-outside", message, "move the file there, or widen --confine", key, location)


def decode(raw: bytes, file: str) -> str:
    """Return the text of UTF-8 bytes without a mark; `SpecError` (`file-encoding`) at a wrong byte."""
    if raw.startswith(_UTF16_MARKS):
        raise _error("file-encoding", f"{file} is encoded as UTF-16", file, "save it as UTF-8")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # Everything before the bad byte decodes, so the place can be counted in characters.
        before = error.object[: error.start].decode("utf-8", errors="replace")
        rows = (before + "|").splitlines()
        text = error.object.decode("utf-8", errors="replace").splitlines()[len(rows) - 1]
        place = Location(file, len(rows), len(rows[-1]), text)
        hint = "save the file as UTF-8 (an editor may have used Latin-1 or Windows-1252)"
        message = f"the byte 0x{error.object[error.start]:02X} is not UTF-8"
        raise SpecError.because("file-encoding", message, hint, location=place) from None


def _nearby(path: Path) -> str:
    if str(path) == STANDARD_STREAM:
        return "this command does not read standard input: write the spec to a file, and name that"
    folder = path.parent
    try:
        names = sorted(entry.name for entry in folder.iterdir() if entry.is_file())
    except OSError:
        return f"there is no folder {folder} either"
    near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.6)
    same_stem = [n for n in names if Path(n).stem == path.name or n.startswith(path.name + ".")]
    if near or same_stem:
        return f'did you mean "{folder / (near or same_stem)[0]}"?'
    return "`idesign init` writes a spec to start from"


def _error(code: str, message: str, file: str, hint: str) -> SpecError:
    return SpecError.because(code, message, hint, location=Location(file, 1, 1))
