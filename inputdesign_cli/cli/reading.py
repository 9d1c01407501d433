"""The spec of a command: from a file, or from standard input."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from inputdesign_cli.cli.options import Changes
from inputdesign_cli.errors import STANDARD_STREAM, bad_spec

if TYPE_CHECKING:
    from inputdesign_cli.specification import Spec


def read_spec(file: Path, changes: Changes, *, design: bool | None = True) -> Spec:
    """Return the spec in a file; in standard input (`-`) names are relative to the current folder.

    Args:
        design: whether it must ask for a design, None: if it states anything of one; see `load_spec`.

    Raises:
        SpecError: as `load_spec`.
    """
    from inputdesign_cli import specification

    overrides, confine = changes.overrides or (), changes.confine
    if str(file) != STANDARD_STREAM:
        return specification.load_spec(file, overrides, confine=confine, design=design)
    return specification.parse_spec(standard_input(), "<stdin>", overrides, confine=confine, design=design)


def standard_input() -> str:
    """Return the text of a spec on standard input.

    Raises:
        SpecError: it is closed, too large, or no text.
    """
    from inputdesign_cli.specification.yaml.files import MAX_BYTES, decode

    if sys.stdin is None:
        raise bad_spec("file-unreadable", "standard input is closed", hint="name a file")
    raw = sys.stdin.buffer.read(MAX_BYTES + 1)
    if len(raw) > MAX_BYTES:
        raise bad_spec("file-too-large", f"the spec is larger than {MAX_BYTES // 2**20} MiB")
    return decode(raw, "<stdin>")


def name_of(file: Path) -> str:
    """Return the name of a spec in names of directories."""
    return "stdin" if str(file) == STANDARD_STREAM else file.stem
