"""Times that a clock counts from 1970 are the same moments as the dates that they stand for."""

import numpy as np
import pytest

from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation

COUNT, STEP = 40, 2.5
MOMENTS = np.datetime64("2024-03-12T10:15:00", "ns") + np.arange(COUNT) * np.timedelta64(2500, "ms")
U = np.where(np.arange(COUNT) // 7 % 2, 1.0, -1.0)
Y = np.sin(np.arange(COUNT))
PARTS = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
UNITS = {"s": 1.0, "min": 60.0}


def counted(part):
    return MOMENTS.astype(f"datetime64[{part}]").astype(np.int64)


def log(path, stamps, name="timestamp"):
    if path.suffix == ".npz":
        np.savez(path, **{name: stamps, "u": U, "y": Y})
    else:
        rows = zip(stamps.tolist(), U.tolist(), Y.tolist(), strict=True)
        path.write_text(f"{name},u,y\n" + "".join(f"{t},{u},{y}\n" for t, u, y in rows))
    return path


@pytest.mark.parametrize("ending", ["csv", "npz"])
@pytest.mark.parametrize("part", PARTS)
def test_parts_of_a_second_are_told_by_their_size(part, ending, tmp_path):
    found = read_log(log(tmp_path / f"log.{ending}", counted(part)), Preparation())
    assert (found.step, found.time_unit) == (STEP, "s")
    assert f"timestamp counts {PARTS[part]} since 1970 (the first is 2024-03-12 10:15:00 UTC)" in found.steps


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("part", PARTS)
def test_a_spec_gets_the_times_that_it_gets_of_dates(part, unit, tmp_path):
    units = Units(unit, STEP / UNITS[unit], sampled=True, closed_loop=False, inputs=1, outputs=1)
    of_dates, of_counts = (
        read_data([log(tmp_path / "log.csv", stamps)], units, Preparation())
        for stamps in (MOMENTS.astype("datetime64[ms]").astype(str), counted(part))
    )
    np.testing.assert_allclose(of_counts.time, of_dates.time, atol=1e-6)
    np.testing.assert_array_equal(of_counts.u, of_dates.u)


@pytest.mark.parametrize(
    ("name", "stamps", "said", "step", "unit"),
    [
        ("timestamp", counted("ms") / 1000, {}, STEP, "s"),
        ("time_ms", counted("ms"), {}, 1000.0 * STEP, "ms"),
        ("timestamp", counted("us"), {"time_unit": "us"}, 1e6 * STEP, "us"),
        ("time", 2500 * np.arange(COUNT), {}, 2500.0, "s"),
        ("time", 10**10 + 2500 * np.arange(COUNT), {}, 2500.0, "s"),
    ],
)
def test_what_says_its_unit_or_counts_seconds_is_left_alone(name, stamps, said, step, unit, tmp_path):
    found = read_log(log(tmp_path / "log.csv", stamps, name), Preparation(**said))
    assert (found.step, found.time_unit) == (pytest.approx(step), unit)
    assert not any("since 1970" in told for told in found.steps)
