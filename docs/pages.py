"""Pages that run commands as a user would, and keep what these say and draw."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

DOCS = Path(__file__).parent
WIDTH = 112


class Terminal:
    """Runs commands in a folder and shows them as a page does, the lines that begin with `kept` words."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def run(self, *words: str, kept: tuple[str, ...] = ("",), code: int = 0) -> tuple[str, str]:
        """The block of a page for a command, and its whole output; the exit code must be as expected."""
        return self._shown(["-m", "inputdesign_cli", *words], command(words), kept, code)

    def _shown(self, run: list[str], typed: str, kept: tuple[str, ...], code: int) -> tuple[str, str]:
        done = subprocess.run(
            [sys.executable, *run], cwd=self.folder, capture_output=True, text=True, check=False
        )
        if done.returncode != code:
            raise SystemExit(f"{typed}: exit code {done.returncode}\n{done.stderr}")
        lines, keeps = [], False
        for line in done.stdout.splitlines():
            keeps = line.startswith(kept) if not line.startswith(" ") else keeps
            if keeps:
                lines.append(line if len(line) <= WIDTH else line[: WIDTH - 3].rsplit(" ", 1)[0] + " ..")
        return f"```\n$ {typed}\n" + "\n".join(lines).strip("\n") + "\n```", done.stdout


def command(words: tuple[str, ...]) -> str:
    """A command as one types it, an option with its value to a line where it is long."""
    typed = [f'"{word}"' if re.search(r"[\s{}=,]", word) else word for word in words]
    text = " ".join(["idesign", *typed])
    if len(text) <= WIDTH - 2:
        return text
    head = typed[: next(n for n, word in enumerate(typed) if word.startswith("-"))]
    pairs = typed[len(head) :]
    rest = [f"    {option} {value}" for option, value in zip(pairs[::2], pairs[1::2], strict=True)]
    return " \\\n".join([" ".join(["idesign", *head]), *rest])


def filled(text: str, found: Mapping[str, str]) -> str:
    """A text with what was found in place of each {name}."""
    return re.sub(r"\{(\w+)\}", lambda match: found[match[1]], text)


def keep(run: Path, images: Path, page: str, **figures: str) -> None:
    """Copy figures of a run beside a page, by the names that they have there."""
    for name, target in figures.items():
        shutil.copy(run / f"{name}.png", images / f"{page}_{target}.png")


def write(name: str, page: Callable[[Path, Path], str]) -> None:
    """docs/NAME.md: `page` runs its commands in the folder of the command line (default runs/NAME), and
    copies its figures into docs/images.
    """
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "runs" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (DOCS / f"{name}.md").write_text(page(folder, DOCS / "images"), encoding="utf-8")
