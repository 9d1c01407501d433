"""Writes docs/records.md: three logs that no one here made, explored as a user would.

    python docs/make_records_page.py [DIR]

The commands are real, and so is what they say and draw; the helpers are those of the tutorial.
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
PAGE = "records.md"
EXPLORED = ("estimate", "fit", "validated", "residuals", "note        y", "note        no trust", "verdict")
JUDGED = ("validated",)

TEXT = """\
# Three logs, from the raw file to a judged model

Each section is two or three commands, none edited by hand: one looks for a model, another judges it by data
that it has not seen. `python docs/make_records_page.py` runs them and writes this page; a test runs it. Whose
records these are is told in [data/README.md](data/README.md); what the commands do, in
[identification.md](identification.md#idesign-explore), and how a log leads to an assessed experiment, in
[tutorial.md](tutorial.md).

## A DC-DC converter: a file to learn from, a file to judge by

{converter_explore}

{converter_judge}

![fit to the second file](images/records_converter_fit.png)

A simulation error of {converter_left} is no noise: no linear model does both files. The converter answers a
step up otherwise than a step down. That is seen in the first half of the first file alone: after a step up
the output rings with a decay of 0.0154 +- 0.0004 and a frequency of 0.0503 +- 0.0004 per sample, after a step
down with 0.0204 +- 0.0008 and 0.0414 +- 0.0010 (a damped sinusoid fitted to each by robust least squares).
The model is one for both: good for a first design, and an experiment with small steps about one level would
tell that level's.

## Two hydraulic cylinders: several inputs and outputs, no header

Columns by number; the first minute teaches, the rest judges:

{cylinders_explore}

{cylinders_judge}

![fit to the rest of the record](images/records_cylinders_fit.png)

## The column of Wood and Berry: dead times and gains that are known

A record that others simulated, with noise, of a plant whose transfer functions were published: gains 12.8,
-18.9, 6.6, -19.4, time constants 16.7, 21, 10.9, 14.4 min, dead times 1, 3, 7, 3 min. One input moves in each
half; the rows about the middle have both:

{column_explore}

![frequency response of the data and of the model](images/records_column_frequency_response.png)

`idesign solve column/spec.yaml` designs the next experiment on it.
"""


@dataclass(frozen=True)
class Step:
    """A command of the page: its words, the lines that are shown, its exit code."""

    words: Sequence[str]
    kept: tuple[str, ...]
    code: int = 0


CYLINDERS = "time=1,u1=2,u2=3,y1=4,y2=5"
FILES = (
    "buck_converter/buck_id.csv",
    "buck_converter/buck_valid.csv",
    "cylinders/MultivariableCylinders.csv",
    "wood_berry/record.csv",
)
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
    "cylinders_explore": Step(
        (
            *("explore", "MultivariableCylinders.csv", "--columns", CYLINDERS),
            *("--range", "0:60", "-o", "cylinders"),
        ),
        EXPLORED,
    ),
    "cylinders_judge": Step(
        (
            *("explore", "MultivariableCylinders.csv", "--columns", CYLINDERS, "--range", "60:300"),
            *("--validate", "cylinders/model.yaml", "-o", "cylinders_judged"),
        ),
        JUDGED,
    ),
    "column_explore": Step(
        (
            *("explore", "record.csv", "--time-unit", "min", "--sample-time", "1"),
            *("--range", "2150:4450", "-o", "column"),
        ),
        EXPLORED,
    ),
}
FIGURES = {
    "converter_judged": {"fit": "converter_fit"},
    "cylinders_judged": {"fit": "cylinders_fit"},
    "column": {"frequency_response": "column_frequency_response"},
}


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
