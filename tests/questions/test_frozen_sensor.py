"""A sensor that stood still leaves the verdict open; without these rows the record is judged."""

import numpy as np
import pytest

from inputdesign_cli import assess, identify, parse_spec
from inputdesign_cli.records import Preparation
from tests.questions.test_repeated_samples import SPEC, rows_of

FIRST, LAST = 200, 259


def saved(path, rows):
    cells = ["" if np.isnan(y) else f"{y:.12g}" for y in rows[:, 1]]
    path.write_text("u,y\n" + "".join(f"{u:.12g},{y}\n" for u, y in zip(rows[:, 0], cells, strict=True)))
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("digits", "options"), [(12, {}), (0, {"preparation": Preparation(detrend="linear")})]
)
def test_a_frozen_sensor_is_named_and_leaves_the_verdict_open(digits, options, tmp_path):
    rows = rows_of(3, 560)
    rows[:, 1] = np.round(rows[:, 1], digits)
    good = assess(parse_spec(SPEC), saved(tmp_path / "good.csv", rows), **options)
    assert "stands still" not in str(good.results.result.get("notes"))
    rows[FIRST : LAST + 1, 1] = rows[FIRST, 1]
    stuck = saved(tmp_path / "stuck.csv", rows)
    found = assess(parse_spec(SPEC), stuck, **options)
    assert found.verdict == "undecided"
    first, *others = found.results.result["assessment"]["undecided"]
    # Line 1 of the file is the header; a sample before or after may happen to be the same when rounded.
    assert f"rows {FIRST + 2} to {LAST + 2}" in first or digits == 0
    assert first.startswith("An output stands still while the input moves")
    assert not any("given twice" in other for other in others)
    assert first in identify(parse_spec(SPEC), stuck, **options).result["notes"]


def test_without_these_rows_the_record_is_judged(tmp_path):
    rows = rows_of(3, 560)
    rows[FIRST : LAST + 1, 1] = np.nan
    found = assess(parse_spec(SPEC), saved(tmp_path / "a.csv", rows))
    assert found.verdict == "met"
    assert "stands still" not in str(found.results.result["notes"])


def test_faults_of_measurement_are_told_alone(tmp_path):
    """Spikes in a twentieth of a record upset every test and the estimate: one sentence sums them up."""
    rng = np.random.default_rng(0)
    rows = rows_of(5)
    at = np.sort(rng.choice(len(rows), 24, replace=False))
    rows[at, 1] += 30.0 * rng.choice([-1.0, 1.0], at.size)
    found = assess(parse_spec(SPEC), saved(tmp_path / "a.csv", rows)).results.result
    (only,) = found["assessment"]["undecided"]
    assert "24 of 500 samples of y hold" in only
    assert f"(at {', '.join(f'{k} s' for k in at[:5])}, ..)" in only
    assert not any("plant of the spec" in note or "structure" in note for note in found["notes"])
