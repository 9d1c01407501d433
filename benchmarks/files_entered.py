"""Count the files of the package that a plain `idesign solve` enters, and how often it switches between them.

Run as `python -m benchmarks.files_entered [SPEC] [--list]`. Importing a file counts as entering it only where
one of its functions runs: what is imported and not used is shown by the third figure. `--list` adds the files
entered, with their functions and calls, and the pairs of functions between which the run switches most often.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import FrameType

import inputdesign_cli

ROOT = str(Path(inputdesign_cli.__file__).parent)
SPEC = Path(__file__).parents[1] / "specs/first_order.yaml"


class Trail:
    """The files of the package in the order in which their functions are called."""

    def __init__(self) -> None:
        self.entered: set[str] = set()
        self.imported: set[str] = set()
        self.switches = 0
        self.calls: Counter[tuple[str, str]] = Counter()
        self.pairs: Counter[tuple[str, str, str]] = Counter()
        self._last = ""

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        """Note a call; `sys.setprofile` gives every event here."""
        file = frame.f_code.co_filename
        if event != "call" or not file.startswith(ROOT):
            return
        self.imported.add(file)
        if frame.f_code.co_name == "<module>" or _of_a_class_body(frame):
            return
        self.entered.add(file)
        self.calls[file, frame.f_code.co_name] += 1
        if file != self._last:
            self.switches += 1
            self.pairs[self._last, file, frame.f_code.co_name] += 1
        self._last = file

    def listing(self, most: int = 60) -> str:
        """Return the files entered with their calls, and the most frequent switches between two files."""
        lines = []
        for file in sorted(self.entered):
            called = ", ".join(
                f"{name} {n}" for (where, name), n in sorted(self.calls.items()) if where == file
            )
            lines.append(f"{_short(file)}: {called}")
        for (before, file, name), n in self.pairs.most_common(most):
            lines.append(f"{n:5d} {_short(before)} -> {_short(file)} {name}")
        return "\n".join(lines)


def _short(file: str) -> str:
    """Return the path of a file inside the package."""
    return file.removeprefix(ROOT + "/")


def _of_a_class_body(frame: FrameType) -> bool:
    """Whether a call belongs to the import of its module."""
    return frame.f_back is not None and frame.f_back.f_code.co_name == "<module>"


def trail_of(spec: Path) -> Trail:
    """Solve a spec as the command line does, and return where the command went."""
    trail = Trail()
    with tempfile.TemporaryDirectory() as folder:
        sys.argv = ["idesign", "solve", str(spec), "-o", folder, "--no-figures", "--quiet"]
        sys.setprofile(trail)
        try:
            from inputdesign_cli.cli import main

            main()
        except SystemExit as end:
            if end.code:
                raise
        finally:
            sys.setprofile(None)
    return trail


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spec", nargs="?", type=Path, default=SPEC)
    parser.add_argument("--list", action="store_true", help="list the files entered and the hot pairs")
    options = parser.parse_args()
    trail = trail_of(options.spec)
    if options.list:
        print(trail.listing())
    print(f"files entered {len(trail.entered)}, switches of file {trail.switches}")
    print(f"files imported {len(trail.imported)}")
    rooms = sorted({Path(file).relative_to(ROOT).parts[0] for file in trail.entered})
    print(f"rooms: {' '.join(rooms)}")


if __name__ == "__main__":
    main()
