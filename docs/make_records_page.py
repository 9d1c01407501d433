"""Writes docs/records.md: logs that no one here made, explored as a user would.

    python docs/make_records_page.py [DIR]

The commands are real, and so is what they say and draw.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import yaml

from pages import DOCS, Terminal, filled, write

FILES = ("buck_converter/buck_id.csv", "buck_converter/buck_valid.csv", "wood_berry/record.csv")
PUBLISHED = DOCS.parent / "specs" / "wood_berry.yaml"

EXPLORED = ("estimate", "fit", "validated", "residuals", "verdict")
JUDGED = ("validated",)

TEXT = """\
# Raw logs to judged models: a converter and a column

[explore](explore.md) finds a model and judges its structure on a part of the record that it was not
estimated from, or on another file. The records come from [others](data/README.md); notes are not shown
(`python docs/make_records_page.py`).

## A converter: a file to learn from and one to judge by

{converter_explore}

{converter_judge}

![fit to the second file](images/records_converter_fit.png)

A simulation error of {converter_left} is not noise. The converter responds differently to steps up and
down. After a step up the output rings with a decay of 0.0154 +- 0.0004 and a frequency of 0.0503 +- 0.0004
per sample. After a step down these are 0.0204 +- 0.0008 and 0.0414 +- 0.0010. The linear model is a
compromise, good for a first design. (ARX models of orders and delays to 8 explain at most 61.6 %.)

## A column: a model in s, and the one that made the record

Reflux and steam of a distillation column, simulated by others after Wood and Berry, with noise. Each input
moves in one half of the record, so blocks in turn estimate and judge. The file has no times; samples are a
minute apart.

{column_explore}

![fit to the record](images/records_column_fit.png)

![frequency response of the record alone, and of the model](images/records_column_frequency_response.png)

One drifting noise drives both outputs, which no structure here contains, so a test of whiteness fails.
Gains and time constants are within {column_worst} of the published ones
([specs/wood_berry.yaml](../specs/wood_berry.yaml)), and all twelve values within 1.1
deviations.
"""


def converter(terminal: Terminal, images: Path, found: dict[str, str]) -> None:
    """Two files."""
    columns = ("--columns", "u1=input,y1=y")
    found["converter_explore"], _ = terminal.run(
        *("explore", "buck_id.csv", *columns, "-o", "converter"), kept=EXPLORED
    )
    found["converter_judge"], said = terminal.run(
        *("explore", "buck_valid.csv", *columns, "--validate", "converter/model.yaml"),
        *("-o", "converter_judged"),
        kept=JUDGED,
    )
    (fit,) = re.findall(r"validated +simulation explains ([\d.]+) %", said)
    found["converter_left"] = f"{100.0 - float(fit):.0f} %"
    shutil.copy(terminal.folder / "converter_judged" / "fit.png", images / "records_converter_fit.png")


def column(terminal: Terminal, images: Path, found: dict[str, str]) -> None:
    """A record whose plant is known."""
    found["column_explore"], said = terminal.run(
        *("explore", "record.csv", "--sample-time", "1", "--time-unit", "min", "-o", "column"), kept=EXPLORED
    )
    published = yaml.safe_load(PUBLISHED.read_text(encoding="utf-8"))["plant"]["continuous"]
    worst = 0.0
    for letter, name in (("K", "gain"), ("T", "time_constant")):
        for i, row in enumerate(published[name], start=1):
            for j, value in enumerate(row, start=1):
                (mean,) = re.findall(rf"{letter}_{i}{j} (\S+) \+-", said)
                worst = max(worst, abs(float(mean) / value - 1.0))
    found["column_worst"] = f"{100.0 * worst:.1f} %"
    for name in ("fit", "frequency_response"):
        shutil.copy(terminal.folder / "column" / f"{name}.png", images / f"records_column_{name}.png")


def records(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    for file in FILES:
        shutil.copy(DOCS / "data" / file, folder)
    terminal, found = Terminal(folder), dict[str, str]()
    for part in (converter, column):
        part(terminal, images, found)
    return filled(TEXT, found)


if __name__ == "__main__":
    write("records", records)
