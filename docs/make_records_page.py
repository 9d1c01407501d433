"""Writes docs/records.md: a log that no one here made, explored as a user would.

    python docs/make_records_page.py [DIR]

The commands are real, and so is what they say and draw.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from pages import DOCS, Terminal, filled, write

EXPLORED = ("estimate", "fit", "validated", "residuals", "note        y", "note        no trust", "verdict")

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


FILES = ("buck_converter/buck_id.csv", "buck_converter/buck_valid.csv")
COLUMNS = ("--columns", "u1=input,y1=y")


def records(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    for file in FILES:
        shutil.copy(DOCS / "data" / file, folder)
    terminal, found = Terminal(folder), {}
    found["converter_explore"], _ = terminal.run(
        *("explore", "buck_id.csv", *COLUMNS, "-o", "converter"), kept=EXPLORED
    )
    found["converter_judge"], said = terminal.run(
        *("explore", "buck_valid.csv", *COLUMNS, "--validate", "converter/model.yaml"),
        *("-o", "converter_judged"),
        kept=("validated",),
    )
    (fit,) = re.findall(r"validated +simulation explains ([\d.]+) %", said)
    found["converter_left"] = f"{100.0 - float(fit):.0f} %"
    shutil.copy(folder / "converter_judged" / "fit.png", images / "records_converter_fit.png")
    return filled(TEXT, found)


if __name__ == "__main__":
    write("records", records)
