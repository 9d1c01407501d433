"""Writes docs/records.md: a log that no one here made, explored as a user would.

    python docs/make_records_page.py [DIR]

The commands are real, and so is what they say and draw; the helpers are those of the tutorial.
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).parent
PAGE = "records.md"
EXPLORED = ("estimate", "fit", "validated", "residuals", "note        y", "note        no trust", "verdict")
JUDGED = ("validated",)

TEXT = """\
# A raw log to a judged model: the converter

Two commands, none edited by hand: one looks for a model, the other judges it by data that it has not seen.
`python docs/make_records_page.py` runs them and writes this page; a test runs it. Whose record this is stands
in [data/README.md](data/README.md); what the commands do, in
[identification.md](identification.md#idesign-explore), and how a log leads to an assessed experiment, in
[tutorial.md](tutorial.md).

A DC-DC converter has a file to learn from and a file to judge by:

{converter_explore}

{converter_judge}

![fit to the second file](images/records_converter_fit.png)

A simulation error of {converter_left} is no noise. The converter answers a step up otherwise than a
step down. That is seen in the first half of the first file alone: after a step up
the output rings with a decay of 0.0154 +- 0.0004 and a frequency of 0.0503 +- 0.0004 per sample, after a step
down with 0.0204 +- 0.0008 and 0.0414 +- 0.0010 (a damped sinusoid fitted to each by robust least squares).
The model is one for both: good for a first design, and an experiment with small steps about one level would
tell that level's.
"""


class Step(NamedTuple):
    """A command of the page: its words, the lines that are shown, its exit code."""

    words: Sequence[str]
    kept: tuple[str, ...]
    code: int = 0


FILES = ("buck_converter/buck_id.csv", "buck_converter/buck_valid.csv")
STEPS = {
    "converter_explore": Step(
        ("explore", "buck_id.csv", "--columns", "u1=input,y1=y", "-o", "converter"), EXPLORED
    ),
    "converter_judge": Step(
        (
            *("explore", "buck_valid.csv", "--columns", "u1=input,y1=y"),
            *("--validate", "converter/model.yaml", "-o", "converter_judged"),
        ),
        JUDGED,
    ),
}
FIGURES = {"converter_judged": {"fit": "converter_fit"}}


def tutorial():
    """The script of the tutorial, for its terminal."""
    found = importlib.util.spec_from_file_location("make_tutorial", DOCS / "make_tutorial.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def page(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    for file in FILES:
        shutil.copy(DOCS / "data" / file, folder)
    terminal, text = tutorial().Terminal(folder), TEXT
    for name, step in STEPS.items():
        block, said = terminal.run(*step.words, kept=step.kept, code=step.code)
        text = text.replace(f"{{{name}}}", block)
        if name == "converter_judge":
            (fit,) = re.findall(r"validated +simulation explains ([\d.]+) %", said)
            text = text.replace("{converter_left}", f"{100.0 - float(fit):.0f} %")
    for run, figures in FIGURES.items():
        for figure, target in figures.items():
            shutil.copy(folder / run / f"{figure}.png", images / f"records_{target}.png")
    return text


def main() -> None:
    """The page and its figures in docs, its runs in DIR (default runs/records)."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "runs" / "records"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (DOCS / PAGE).write_text(page(folder, DOCS / "images"), encoding="utf-8")


if __name__ == "__main__":
    main()
