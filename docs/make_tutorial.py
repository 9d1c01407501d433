"""Writes docs/tutorial.md: plays a plant, calls `idesign` as a user would, keeps what it says and draws.

    python docs/make_tutorial.py [DIR]

The plant is a heat exchanger: a lag with dead time, noise that fades in a minute, a sensor with few digits.
Its log has uneven times, a gap, a spike and a drift, as logs of plants do. The tool knows the data alone.
"""

from __future__ import annotations

import datetime
import math
import re
import shutil
from pathlib import Path

import numpy as np
import scipy.signal

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from pages import DOCS, Terminal, filled, keep, write

LOG = DOCS / "data" / "exchanger" / "log.csv"
GAIN, LAG, DEAD = 1.7, 260.0, 32  # degC per %, s, s
VALVE, TEMPERATURE = 45.0, 82.0  # the operating point, % and degC
NOISE, FADES, DIGIT = 0.1, 60.0, 0.05  # standard deviation in degC, s, degC
SCAN, HOURS, DRIFT = 10, 4, 0.2  # s between rows, length of the log, degC per hour
# What the operator did, as shares of the log and positions of the valve.
MOVES = (
    (0.06, 48.0),
    (0.16, 43.0),
    (0.25, 47.0),
    (0.33, 45.0),
    (0.58, 50.0),
    (0.68, 46.0),
    (0.8, 42.5),
    (0.9, 46.5),
)
MISSING, SPIKE = (0.42, 0.5), 0.37  # shares of the log: no rows, one value that is 20 degC too high
MORNING = datetime.datetime(2026, 3, 12, 6)

TEXT = """\
# From a log to an assessed experiment

A log of a heat exchanger leads to an experiment and a verdict on its data. Run the commands in a folder
with a copy of [`log.csv`](data/exchanger/log.csv). Plant, log and experiments are simulated (`python
docs/make_tutorial.py`), so that the truth is known: a gain of 1.7 degC/%, a lag of 260 s, a dead time of 32
s. The tool knows the data alone.

## 1. What is in the log

Four hours, a row about every ten seconds, as a control system exports them. The operator moved the valve
eight times. Twenty minutes are missing, one value is a spike, and the temperature drifts:

{explore}

One command reads the file, repairs it, finds a structure on one part of the record, and judges it on the
other. It notes what it did. Estimated from the first part alone, this structure explains {validated} of the
other; the parameters above use the whole log:

![fit of the model to the log](images/tutorial_log_fit.png)

The dots and their band show the frequency response of the data alone, the line that of the model:

![frequency response of the log, without a model and by the model](images/tutorial_log_frequency_response.png)

The band is wide at the frequencies that matter for a controller, beyond 0.01 rad/s.

## 2. The shortest experiment

We ask for errors below 3 % of |G| from 0.0005 to 0.01 rad/s, with 95 % confidence. The valve may move by 3
% to either side, and keeps each position for a minute:

{solve}

White excitation of equal power needs {white} samples, the best spectrum {spectrum}, a record within 42 and
48 % {record}. It has two levels:

![the signal](images/tutorial_design_signal.png)

![the model error that it buys](images/tutorial_design_bound.png)

## 3. The experiment

The plant settles at 45 % and 82 degC, `design/signal.csv` is applied, and `first.csv` is recorded. Do these
data meet the target?

{first}

They miss it: exit code 1. At the new estimate the error is {ratio} times the admissible one. The same
command has designed the top-up: the shortest record that, with these data, meets the target.

![the error that the first experiment leaves](images/tutorial_first_data_bound.png)

## 4. The top-up

That record is just enough if its model is right, so we leave a reserve and ask for 2.5 % instead of 3 %:

{reserve}

`reserve/signal.csv`, {reserved} samples instead of {needed}, is applied in the same way. Both records are
estimated jointly and judged by the 3 %:

{second}

Met: exit code 0. The model, with its covariance, is `second_assessed/model.yaml`. All three true values lie
within two standard deviations.

![the error that both experiments leave](images/tutorial_second_bound.png)

![fit of the model to both experiments, separated by a dotted line](images/tutorial_second_fit.png)

Further: [questions.md](questions.md) (requirements), [assess.md](assess.md) (verdicts),
[frequency_response.md](frequency_response.md) (a response without a model).
"""

TARGET = (
    "accuracy={model_error: {relative: 0.03, band: [0.0005, 0.01]}}",
    "limits={amplitude: 3}",
    "objective=shortest_experiment",
    "spectrum={type: multisine, lines: 200}",
    "signal={type: binary, hold: 6, seed: 1, offset: 45}",
)
RESERVE = "accuracy.model_error.relative=0.025"
REST = ("--operating-point", "u1=45,y1=82")


def answer(valve: Array, rng: np.random.Generator) -> Array:
    """The temperature (n,) every second, for valve positions (n,); the plant has settled at the first one."""
    late = np.concatenate([np.full(DEAD, valve[0]), valve[: len(valve) - DEAD]]) - VALVE
    fall, fade = math.exp(-1.0 / LAG), math.exp(-1.0 / FADES)
    clean = scipy.signal.lfilter([0.0, GAIN * (1.0 - fall)], [1.0, -fall], late)
    e = NOISE * math.sqrt(1.0 - fade**2) * rng.standard_normal(len(valve) + 600)
    return np.asarray(TEMPERATURE + clean + scipy.signal.lfilter([1.0], [1.0, -fade], e)[600:])


def log_text(seed: int = 4) -> str:
    """The log as a control system exports it."""
    rng, seconds = np.random.default_rng(seed), 3600 * HOURS
    times = SCAN * np.arange(1, seconds // SCAN) + rng.integers(-1, 2, seconds // SCAN - 1)
    valve = np.full(seconds, VALVE)
    for share, position in MOVES:
        valve[times[int(share * times.size)] :] = position
    y = answer(valve, rng)[times] + DRIFT * times / 3600
    y[int(SPIKE * times.size)] += 20.0
    lines = ["Time;Valve [%];Temperature [degC]"]
    for time, position, value in zip(times.tolist(), valve[times], DIGIT * np.round(y / DIGIT), strict=True):
        if not MISSING[0] <= time / seconds < MISSING[1]:
            stamp = MORNING + datetime.timedelta(seconds=time)
            lines.append(
                f"{stamp:%d.%m.%Y %H:%M:%S};{position:.1f};{value:.2f}".replace(".", ",").replace(",", ".", 2)
            )
    return "\n".join(lines) + "\n"


def experiment(signal: Path, record: Path, seed: int) -> None:
    """Apply a signal to the settled plant and write the record."""
    time, u = csv_columns(signal.read_bytes()).values()
    every = round(float(time[1] - time[0]))
    y = answer(np.repeat(u, every), np.random.default_rng(seed))[::every]
    read = DIGIT * np.round(y / DIGIT)
    record.write_text(
        csv_text(Table({"Time (s)": time, "Valve (%)": u, "Temperature (degC)": read})), encoding="utf-8"
    )


def tutorial(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    shutil.copy(LOG, folder / LOG.name)
    terminal, found = Terminal(folder), {}
    columns = "time=Time,u1=Valve,y1=Temperature"
    found["explore"], said = terminal.run(
        *("explore", LOG.name, "--columns", columns, "-o", "found"),
        kept=(
            "estimate",
            "fit",
            "validated",
            "residuals",
            "note        Single",
            "note        The record",
            "note        A structure",
            "note        An output",
            "files",
        ),
    )
    (found["validated"],) = re.findall(r"validated +simulation explains ([\d.]+ %)", said)
    changes = [word for change in TARGET for word in ("--set", change)]
    found["solve"], said = terminal.run(
        *("solve", "found/spec.yaml", *changes, "-o", "design"),
        kept=("asked", "samples", "power", "model error", "signal", "proved"),
    )
    (found["white"],) = re.findall(r"white excitation: (\d+)", said)
    (least,) = re.findall(r"by the spectrum alone ([\d.]+)", said)
    found["spectrum"] = str(math.ceil(float(least)))
    (found["record"],) = re.findall(r"signal +(\d+) samples", said)
    shown = ("estimate", "assessed", "verdict", "signal", "files")
    experiment(folder / "design" / "signal.csv", folder / "first.csv", seed=1)
    found["first"], said = terminal.run(
        *("assess", "design/spec.yaml", "first.csv", *REST, "-o", "first_assessed"), kept=shown, code=1
    )
    (found["ratio"],) = re.findall(r"error with these data is ([\d.]+) of", said)
    (found["needed"],) = re.findall(r"signal +(\d+) samples", said)
    found["reserve"], said = terminal.run(
        *("assess", "design/spec.yaml", "first.csv", *REST, "--set", RESERVE, "-o", "reserve"),
        kept=("asked", "samples", "signal"),
        code=1,
    )
    (found["reserved"],) = re.findall(r"signal +(\d+) samples", said)
    experiment(folder / "reserve" / "signal.csv", folder / "second.csv", seed=11)
    found["second"], _ = terminal.run(
        *("assess", "design/spec.yaml", "first.csv", "second.csv", *REST, "-o", "second_assessed"), kept=shown
    )
    keep(folder / "found", images, "tutorial", fit="log_fit", frequency_response="log_frequency_response")
    keep(folder / "design", images, "tutorial", signal="design_signal", bound="design_bound")
    keep(folder / "first_assessed", images, "tutorial", data_bound="first_data_bound")
    keep(folder / "second_assessed", images, "tutorial", bound="second_bound", fit="second_fit")
    return filled(TEXT, found)


if __name__ == "__main__":
    write("tutorial", tutorial)
