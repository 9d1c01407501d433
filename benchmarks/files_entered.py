"""Count the files of the package that a plain `idesign solve` enters, and how often it switches between them.

Run as `python -m benchmarks.files_entered [SPEC]`. Importing a file counts as entering it only where one of
its functions runs: what is imported and not used is shown by the third figure.
"""

from __future__ import annotations

import sys
import tempfile
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
        self.switches += file != self._last
        self._last = file


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
    trail = trail_of(Path(sys.argv[1]) if len(sys.argv) > 1 else SPEC)
    print(f"files entered {len(trail.entered)}, switches of file {trail.switches}")
    print(f"files imported {len(trail.imported)}")
    rooms = sorted({Path(file).relative_to(ROOT).parts[0] for file in trail.entered})
    print(f"rooms: {' '.join(rooms)}")


if __name__ == "__main__":
    main()
