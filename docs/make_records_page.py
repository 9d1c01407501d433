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

FILES = (
    "buck_converter/buck_id.csv",
    "buck_converter/buck_valid.csv",
    "cylinders/MultivariableCylinders.csv",
    "wood_berry/record.csv",
)
PUBLISHED = DOCS.parent / "specs" / "wood_berry.yaml"

EXPLORED = ("estimate", "fit", "validated", "residuals", "note", "verdict")
JUDGED = ("validated", "note")

TEXT = """\
# Raw logs to judged models: converter, cylinders, column

One command looks for a model and judges its structure by a part of the record that it was not estimated from;
a second judges the model by another file. Nothing is edited by hand; every note is shown, its end cut off.
`python docs/make_records_page.py` runs the commands and writes this page; a test runs it. Whose records these
are stands in [data/README.md](data/README.md); what the commands do, in
[identification.md](identification.md#idesign-explore), and how a log leads to an assessed experiment, in
[tutorial.md](tutorial.md).

## A converter: a file to learn from and one to judge by

{converter_explore}

{converter_judge}

![fit to the second file](images/records_converter_fit.png)

A simulation error of {converter_left} is no noise. The converter answers a step up otherwise than a
step down. That is seen in the first half of the first file alone: after a step up
the output rings with a decay of 0.0154 +- 0.0004 and a frequency of 0.0503 +- 0.0004 per sample, after a step
down with 0.0204 +- 0.0008 and 0.0414 +- 0.0010 (a damped sinusoid fitted to each by robust least squares).
The model is one for both: good for a first design, and an experiment with small steps about one level would
tell that level's.

The first file does not tell which compromise the second asks for. ARX models of orders and delays to 8 that
are estimated from it reach 61.6 % there at best, chosen on that second file; 58.8 or 61.5 % where the first
alone chooses, by simulation or by BIC. In the halves of the first file it is 63.5, 59.1 and 44.8 %, where
`explore` gives 57.1 ([table](identification.md#idesign-explore)).

## Two cylinders: one file, halved by its times

A hydraulic test bench with two inputs and two outputs. The file has no header, so columns are told by their
numbers. The first half is explored, the second judges:

{cylinders_explore}

{cylinders_judge}

![fit to the second half](images/records_cylinders_fit.png)

Each output follows its own input within three samples, and the other input hardly acts on it. What the model
leaves is no noise either: overshoots and slow tails at some of the steps, which a linear model of this order
does not show. Notes of the first half name the samples that hold most of it.

## A column: a model in s, and the one that made the record

Reflux and steam of a distillation column, simulated by others after Wood and Berry, with noise. Each input
moves in one half of the record, so no half can judge the other: blocks in turn do. The file has no times;
samples are a minute apart.

{column_explore}

![fit to the record](images/records_column_fit.png)

![frequency response of the record alone, and of the model](images/records_column_frequency_response.png)

The record itself tells gains, time constants and dead times of all four entries. Beside them, what Wood and
Berry published ([specs/wood_berry.yaml](../specs/wood_berry.yaml)):

{column_table}

The noise drifts, and both outputs have the same. Filtered noise makes up for the drift; that one noise drives
both outputs no structure here says, so a test of whiteness still fails. Gains and time constants are within
{column_worst} of what was published, and all twelve within 1.1 deviations, though these come from the
covariance that a note does not trust.
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


def cylinders(terminal: Terminal, images: Path, found: dict[str, str]) -> None:
    """One file, halved."""
    file = ("MultivariableCylinders.csv", "--columns", "time=1,u1=2,u2=3,y1=4,y2=5")
    found["cylinders_explore"], _ = terminal.run(
        *("explore", *file, "--range", "0:119.4", "-o", "cylinders"), kept=EXPLORED
    )
    found["cylinders_judge"], _ = terminal.run(
        *("explore", *file, "--range", "119.5:239", "--validate", "cylinders/model.yaml"),
        *("-o", "cylinders_judged"),
        kept=JUDGED,
    )
    shutil.copy(terminal.folder / "cylinders_judged" / "fit.png", images / "records_cylinders_fit.png")


def column(terminal: Terminal, images: Path, found: dict[str, str]) -> None:
    """A record whose plant is known."""
    found["column_explore"], said = terminal.run(
        *("explore", "record.csv", "--sample-time", "1", "--time-unit", "min", "-o", "column"), kept=EXPLORED
    )
    published = yaml.safe_load(PUBLISHED.read_text(encoding="utf-8"))["plant"]["continuous"]
    rows, worst = ["| | found | published |", "|---|---|---|"], 0.0
    for letter, name, unit in (("K", "gain", ""), ("T", "time_constant", " min"), ("L", "dead_time", " min")):
        for i, row in enumerate(published[name], start=1):
            for j, value in enumerate(row, start=1):
                ((mean, deviation),) = re.findall(rf"{letter}_{i}{j} (\S+) \+- ([^\s,]+)", said)
                rows.append(f"| {letter}_{i}{j} | {mean} +- {deviation}{unit} | {value:g}{unit} |")
                if letter != "L":
                    worst = max(worst, abs(float(mean) / value - 1.0))
    found["column_table"] = "\n".join(rows)
    found["column_worst"] = f"{100.0 * worst:.1f} %"
    for name in ("fit", "frequency_response"):
        shutil.copy(terminal.folder / "column" / f"{name}.png", images / f"records_column_{name}.png")


def records(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    for file in FILES:
        shutil.copy(DOCS / "data" / file, folder)
    terminal, found = Terminal(folder), dict[str, str]()
    for part in (converter, cylinders, column):
        part(terminal, images, found)
    return filled(TEXT, found)


if __name__ == "__main__":
    write("records", records)
