"""Writes docs/mechatronics.md: plays a motor, calls `idesign` as a user would, keeps what it says and draws.

    python docs/make_mechatronics.py [DIR]

The motor is played by its difference equation with 20 % less gain than was said, 15 % more inertia and the
noise of the record at rest; the tool sees the data only.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from pages import Terminal, filled, keep, write

STEP, GAIN, LAG = 0.02, 8.0, 0.575
VOLTAGE, SPEED, NOISE, DIGIT = 10.0, 80.0, 1.0, 0.05

ANSWERS = """\
plant: gain about 10, time constant about 0.5 s, dead time about 0.02 s, each within 20 %
wish: PI loop with 6 dB
range: plus/minus 5 around 10
time: 20 s
noise: rest rest.csv
converter: 12 bits up to 24
"""

TEXT = (
    """\
# Mechatronics: from a data sheet to a speed loop with a proved margin

A motor is to get a PI loop for its speed. The data sheet states gain and time constant within 20 %, and the
drive takes 0 to 24 V through 12 bits. The experiment takes twenty seconds.

The motor is simulated (`python docs/make_mechatronics.py`), with a gain 20 % below the data sheet and a time
constant 15 % above.

## 1. What you know, in your words

`rest.csv` is half a minute of speed at a constant 10 V, which contains the noise. Six answers stand in
`answers.yaml`:

```yaml
"""
    + ANSWERS
    + """```

{wizard}

`speed.yaml` has a comment on every line. The margin became:

{deduced}

The controller is tuned anew at each of thirty motors. At each the margin must hold for every motor within
r_u.

## 2. The signal

The record has {levels} levels of voltage, which are codes of the converter. The lower panel shows the
expected speed:

![the voltage to apply and the speed to be expected](images/mechatronics_signal.png)

![the loop, its discs of uncertainty, and the circle to avoid](images/mechatronics_nyquist.png)

The discs of uncertainty stay out of the 6 dB circle about -1.

## 3. The experiment and its verdict

`signal.csv` is played to the drive; voltage and speed are logged in `log.csv`, beginning at rest at 10 V
and 80 rad/s:

{assess}

Met: exit code 0. The controller settings follow from the gain and time constant of this motor.

![what the model explains of the record](images/mechatronics_fit.png)

For a flexible axis see [wizard.md](wizard.md#limits).
"""
)


def speed(voltage: Array, rng: np.random.Generator) -> Array:
    """The recorded speed (n,) for voltages (n,) from rest at the operating point; dead time is one sample."""
    fall = np.exp(-STEP / LAG)
    y = SPEED + lfilter([0.0, 0.0, GAIN * (1.0 - fall)], [1.0, -fall], voltage - VOLTAGE)
    return np.asarray(np.round((y + NOISE * rng.standard_normal(y.size)) / DIGIT) * DIGIT)


def recorded(path: Path, **columns: Array) -> None:
    """Write a record with its times."""
    time = STEP * np.arange(next(iter(columns.values())).size)
    path.write_text(csv_text(Table({"time": time, **columns})), encoding="utf-8")


def mechatronics(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    rng, terminal = np.random.default_rng(3), Terminal(folder)
    recorded(folder / "rest.csv", y=speed(np.full(1500, VOLTAGE), rng))
    (folder / "answers.yaml").write_text(ANSWERS, encoding="utf-8")
    found = {}
    found["wizard"], _ = terminal.run("wizard", "--answers", "answers.yaml", "--solve", "-o", "speed.yaml")
    lines = (folder / "speed.yaml").read_text(encoding="utf-8").split("\n")
    begin = next(n for n, line in enumerate(lines) if line.startswith("uncertainty:"))
    end = next(n for n, line in enumerate(lines) if line.startswith("objective:"))
    found["deduced"] = "\n".join(["```", *lines[begin:end], "```"])
    u = csv_columns((folder / "runs" / "speed" / "signal.csv").read_bytes())["u1"]
    found["levels"] = str(np.unique(u).size)
    recorded(folder / "log.csv", u1=u, y1=speed(u, rng))
    found["assess"], _ = terminal.run(
        *("assess", "speed.yaml", "log.csv", "--operating-point", "u1=10,y1=80", "-o", "assessed"),
        kept=("estimate", "assessed", "verdict", "loop", "controller", "margin", "files"),
    )
    keep(folder / "runs" / "speed", images, "mechatronics", signal="signal", nyquist="nyquist")
    keep(folder / "assessed", images, "mechatronics", fit="fit")
    return filled(TEXT, found)


if __name__ == "__main__":
    write("mechatronics", mechatronics)
