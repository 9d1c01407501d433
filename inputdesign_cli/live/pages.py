"""The pages that follow a spec, and the files whose changes they follow.

A page shows the new design beside the last good one, and each error at its line.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from inputdesign_cli.errors import Diagnostic, IdesignError
from inputdesign_cli.report.render import filled
from inputdesign_cli.report.run_page import run_page

_EVERY = 0.05  # seconds between looks at files
_AROUND = 2  # lines shown before and after one that is wrong
Stamp = tuple[tuple[int, int, int] | None, ...]


def stamp(paths: Sequence[Path]) -> Stamp:
    """Return modification times, sizes and inodes of files, which change with their content."""
    found: list[tuple[int, int, int] | None] = []
    for path in paths:
        try:
            of = os.stat(path)
            found.append((of.st_mtime_ns, of.st_size, of.st_ino))
        except OSError:
            found.append(None)
    return tuple(found)


def wait_for_change(paths: Sequence[Path], before: Stamp) -> Stamp:
    """Wait until some file differs from `before` and changes no more, and return the new stamp."""
    while (now := stamp(paths)) == before:
        time.sleep(_EVERY)
    # An editor may write in pieces, or take the file away for a moment.
    while (later := _later(paths)) != now or None in later:
        if None in later and _later(paths) == later:
            break
        now = later
    return later


def _later(paths: Sequence[Path]) -> Stamp:
    time.sleep(_EVERY)
    return stamp(paths)


@dataclass(frozen=True)
class Followed:
    """A spec that is followed; `designs` are the pages of the newest good design and of the one before."""

    name: str
    state: str = "computing"  # computing, done, failed
    said: str = ""
    designs: tuple[dict[str, object], ...] = ()
    errors: tuple[dict[str, object], ...] = field(default=())
    awaits: str = "computes whenever it is saved"

    def computing(self) -> Followed:
        """Return the followed spec with the state of a new computation."""
        return replace(self, state="computing", said="The file was saved: computing ..", errors=())

    def solved(self, run: Path, clock: str, seconds: float, *, pictures: bool = True) -> Followed:
        """Return the followed spec with the design in `run`; without `pictures` these are yet to be drawn."""
        made = run_page(run, pictures=pictures) | {"clock": clock}
        said = (
            f"Computed at {clock} in {seconds:.1f} s{'' if pictures else '; its pictures are being drawn'}."
        )
        return replace(self, state="done", said=said, designs=(made, *self.designs[:1]), errors=())

    def failed(self, error: IdesignError, lines: Sequence[str], file: str) -> Followed:
        """Return the followed spec with an error; `lines` are the lines of `file` when it was read."""
        listed = tuple(_placed(diagnostic, lines, file) for diagnostic in error.diagnostics)
        number = f"{len(listed)} errors" if len(listed) > 1 else "One error"
        said = f"{number}: the last good design stays." if self.designs else f"{number}."
        return replace(self, state="failed", said=said, errors=listed)

    @property
    def page(self) -> str:
        """Return the current page."""
        return filled("watch.html", {"title": f"{self.name}: {self.state}", **vars(self)})


def followed_page(report: str) -> str:
    """Return the page of a report, with the script that makes a browser follow it."""
    said = '<p id="connection" class="bad" role="status"></p>'
    return report.replace("</head>", '<script src="follow.js" defer></script>\n</head>', 1).replace(
        "</body>", f"{said}\n</body>", 1
    )


def message_page(name: str, said: str, awaits: str = "computes whenever it is saved") -> str:
    """Return a page with a message; `awaits` says what happens next."""
    return Followed(name, "waiting", said, awaits=awaits).page


def _placed(diagnostic: Diagnostic, lines: Sequence[str], file: str) -> dict[str, object]:
    """Return a diagnostic for the page, with the lines about its place."""
    place = diagnostic.location
    shown: list[tuple[str, str, bool]] = []
    where = ""
    if place is not None:
        stands = place.file == file and 1 <= place.line <= len(lines)
        where = f"{Path(place.file).name}, line {place.line}, column {place.column}"
        shown = [(str(place.line), place.text.rstrip(), True)]
        if stands:
            first, last = max(place.line - _AROUND, 1), min(place.line + _AROUND, len(lines))
            shown = [(str(n), lines[n - 1].rstrip(), n == place.line) for n in range(first, last + 1)]
    return {
        "code": diagnostic.code,
        "message": diagnostic.message,
        "hint": diagnostic.hint,
        "where": where or diagnostic.key,
        "lines": shown,
    }
