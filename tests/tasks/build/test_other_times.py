"""Inputs and outputs that have times of their own: a constant shift is told, with its amount."""

import numpy as np
import pytest

from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation

COUNT, STEP = 30, 10.0
UNITS = Units("s", STEP, sampled=True, closed_loop=False, inputs=1, outputs=1)
BEGIN = np.datetime64("2024-03-12T10:15:00", "ms")
KINDS = {
    "numbers": lambda seconds: [f"{x:.6g}" for x in seconds],
    "dates": lambda seconds: (BEGIN + (1e3 * seconds).astype("timedelta64[ms]")).astype(str),
    "times of day": lambda seconds: [f"10:{int(x // 60):02d}:{x % 60:06.3f}" for x in seconds],
}


def log(path, of_inputs, of_outputs):
    rows = zip(of_inputs, of_outputs, strict=True)
    lines = [f"{a},{k % 3},{b},{k % 7}\n" for k, (a, b) in enumerate(rows)]
    path.write_text("time_u,u,time_y,y\n" + "".join(lines))
    return path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("shift", "told"), [(3.0, "3 later"), (25.0, "25 later"), (0.0, ""), (1e3, "")])
def test_a_constant_shift_is_told_as_samples(kind, shift, told, tmp_path):
    seconds = STEP * np.arange(COUNT)
    path = log(tmp_path / "log.csv", KINDS[kind](seconds), KINDS[kind](seconds + shift))
    for column, word in (("time_u", "later"), ("time_y", "earlier")):
        taken = Preparation(columns={"time": column})
        for notes in (read_log(path, taken).steps, read_data([path], UNITS, taken).notes):
            found = [note for note in notes if "in every row" in note]
            assert len(found) == bool(told)
            assert all(f"{told.replace('later', word)} than those of {column}" in note for note in found)
            assert all(f"({shift / STEP:g} samples)" in note for note in found)


def test_times_that_drift_apart_are_no_shift(tmp_path):
    seconds = STEP * np.arange(COUNT)
    path = log(tmp_path / "log.csv", seconds, 3.0 + 1.01 * seconds)
    assert not any("in every row" in t for t in read_log(path, Preparation(columns={"time": "time_u"})).steps)
