"""Records are cut at gaps and evened out; what was done is told, and what was not asked is not done."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.extremes import absurd
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation, limits_of_sensor, trend

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
N = 60
TIME = np.arange(float(N))
U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = 5.0 + np.sin(0.1 * TIME)


def read(path, time=TIME, u=U, y=Y, **preparation):
    table = np.column_stack([time, u, y])
    path.write_text("time,u,y\n" + "\n".join(",".join(f"{x:.12g}" for x in row) for row in table) + "\n")
    return read_data([path], UNITS, Preparation(**preparation))


def test_missing_numbers_and_gaps_cut_the_record(tmp_path):
    y, time = Y.copy(), TIME + 5.0 * (TIME >= 40)
    y[20] = np.nan
    found = read(tmp_path / "a.csv", time=time, y=y)
    assert found.lengths == (20, 19, 20)
    np.testing.assert_allclose(found.y[:, 0], np.delete(Y, 20))
    told = " ".join(found.notes)
    # Line 1 of the file is the header.
    assert "1 row with a missing number was left out (row 22)" in told
    assert "1 gap (before row 42)" in told
    assert "3 segments" in told


def test_what_is_left_out_is_told_with_its_rows(tmp_path):
    y = Y.copy()
    y[[5, 6, 7, 20, 50, 55]] = np.nan
    told = read(tmp_path / "a.csv", y=y).notes
    assert "6 rows with a missing number were left out (rows 7 to 9, 22, 52, 57)" in told
    assert any(
        "13 samples in shorter ones were left out (rows 2 to 6, 53 to 56, 58 to 61)" in t for t in told
    )


def test_an_even_record_is_left_alone(tmp_path):
    found = read(tmp_path / "a.csv")
    assert found.lengths == (N,)
    assert found.notes == ()
    np.testing.assert_allclose(found.y[:, 0], Y, atol=1e-11)


def test_jitter_is_told_and_evened_out(tmp_path):
    """A straight line is what interpolation gives back exactly."""
    time = TIME + 0.03 * np.sin(3.0 * TIME)
    found = read(tmp_path / "a.csv", time=time, y=2.0 * time)
    np.testing.assert_allclose(np.diff(found.y[:, 0]), 2.0, atol=1e-9)
    np.testing.assert_array_equal(found.u[:, 0], U)
    assert "jitter by up to 6 %" in found.notes[0]


def test_much_jitter_is_evened_out_on_request_only(tmp_path):
    time = TIME + 0.2 * np.sin(3.0 * TIME)
    with pytest.raises(DataError, match="unasked") as caught:
        read(tmp_path / "a.csv", time=time)
    assert "--resample" in caught.value.diagnostics[0].hint
    found = read(tmp_path / "a.csv", time=time, y=2.0 * time, resample=True)
    np.testing.assert_allclose(np.diff(found.y[:, 0]), 2.0, atol=1e-9)


def test_rows_are_left_out_on_request(tmp_path):
    np.testing.assert_allclose(read(tmp_path / "a.csv", skip=10).y[:, 0], Y[10:], atol=1e-11)
    found = read(tmp_path / "a.csv", span=(5.0, 30.0))
    np.testing.assert_allclose(found.y[:, 0], Y[5:31], atol=1e-11)
    with pytest.raises(DataError, match="nothing is left"):
        read(tmp_path / "a.csv", span=(500.0, 600.0))


def test_trends_are_taken_away():
    x = 3.0 + 0.5 * np.arange(50.0)
    np.testing.assert_allclose(x - trend(x, "linear")[0], 0.0, atol=1e-11)
    np.testing.assert_allclose(x - trend(x, "auto")[0], 0.0, atol=1e-11)
    wave = np.sin(np.arange(50.0))
    np.testing.assert_allclose(trend(wave, "auto")[0], wave.mean())


def test_saturation_and_rounding_are_seen():
    x = np.sin(0.05 * np.arange(400.0))
    assert limits_of_sensor("y", x) == []
    assert "saturated" in limits_of_sensor("y", np.minimum(x, 0.8))[0]
    assert limits_of_sensor("y", np.concatenate([np.full(50, x.min()), x])) == limits_of_sensor("y", x)
    assert "rounded to steps of 0.25" in limits_of_sensor("y", np.round(4 * x) / 4)[0]


def test_columns_that_the_plant_has_not_are_refused(tmp_path):
    from inputdesign_cli.errors import SpecError

    with pytest.raises(SpecError, match="no such channel"):
        read(tmp_path / "a.csv", columns={"u3": "1"})


def test_two_columns_of_times_are_a_question(tmp_path):
    (tmp_path / "a.csv").write_text("time,t,u,y\n" + "\n".join(f"{i},{i},{i % 3},1" for i in range(20)))
    with pytest.raises(DataError, match="several columns of times"):
        read_data([tmp_path / "a.csv"], UNITS, Preparation())
    found = read_data([tmp_path / "a.csv"], UNITS, Preparation(columns={"time": "t"}))
    assert found.lengths == (20,)


@pytest.mark.parametrize(("header", "channel"), [("u,u1,y", "u1"), ("u,y1,Y (degC)", "y1")])
def test_two_names_of_one_channel_are_a_question(tmp_path, header, channel):
    (tmp_path / "a.csv").write_text(header + "\n" + "\n".join(f"{i % 3},{i % 2},{i % 5}" for i in range(20)))
    with pytest.raises(DataError, match=f"several columns that may be {channel}"):
        read_data([tmp_path / "a.csv"], UNITS, Preparation())
    found = read_data([tmp_path / "a.csv"], UNITS, Preparation(columns={channel: "2"}))
    assert (found.u if channel == "u1" else found.y)[:3, 0].tolist() == [0.0, 1.0, 0.0]


BETWEEN = {
    "": ((20,), (20,), ""),
    "\n": ((10, 10), (20,), "1 blank line between the numbers (line 12)"),
    "\n  \n": ((10, 10), (20,), "2 blank lines between the numbers (lines 12, 13)"),
    ",,\n": ((10, 10), (10, 10), "1 row with a missing number was left out (row 12)"),
    "# 10.2,1.0,2.0\n": ((10, 10), (20,), "1 row that is commented out between the numbers (line 12)"),
    "# a pause\n": ((20,), (20,), "1 comment between the numbers (line 12) passed over"),
}


def lines_of(count):
    return [f"{k}.0,{k % 3},{np.sin(k):.12g}" for k in range(count)]


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("line", BETWEEN)
def test_lines_between_the_numbers_are_told(line, timed, tmp_path):
    """Without times nobody knows what is missing; with them it is seen, and nothing is."""
    rows, path = lines_of(20), tmp_path / "log.csv"
    head = "time,u,y" if timed else "step,u,y"
    path.write_text("\n".join([head, *rows[:10], line + "\n".join(rows[10:])]))
    found = read_data([path], UNITS, Preparation())
    untimed, with_times, told = BETWEEN[line]
    assert found.lengths == (with_times if timed else untimed)
    assert "".join(found.notes).startswith(told)
    assert bool(found.notes) == bool(line)


def test_blank_lines_between_all_rows_are_the_layout(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("step,u,y\n\n" + "\n\n".join(lines_of(20)))
    found = read_data([path], UNITS, Preparation())
    assert found.lengths == (20,)
    assert found.notes == ("blank lines stand between most rows: they were passed over",)


def test_rows_that_are_left_out_take_their_lines_along(tmp_path):
    path, (first, *others) = tmp_path / "log.csv", lines_of(20)
    path.write_text("\n".join(["step,u,y", first, "", *others]))
    found = read_data([path], UNITS, Preparation(skip=1))
    assert (found.lengths, found.notes) == ((19,), ())


@pytest.mark.parametrize("column", ["time", "u", "y"])
@pytest.mark.parametrize("value", [9e99, -1e308, 1e30, 1e19, 1e12])
def test_values_beside_which_all_others_are_rounding_are_refused_with_their_line(column, value, tmp_path):
    signals = {"time": TIME.copy(), "u": U.copy(), "y": Y.copy()}
    signals[column][-1 if column == "time" else 30] = abs(value) if column == "time" else value
    if column == "time" and abs(value) < 1e18:
        return  # a gap of the record
    with pytest.raises(DataError, match=f"column {column}") as caught:
        read(tmp_path / "a.csv", **signals)
    (told,) = caught.value.diagnostics
    assert told.code == "beyond-precision"
    assert told.location.line == (N + 1 if column == "time" else 32)


@pytest.mark.parametrize("scale", [1e19, 1e200, 1e-19, 1e-320])
def test_signals_whose_squares_leave_the_range_are_refused(scale, tmp_path):
    with pytest.raises(DataError, match="column y has values up to") as caught:
        read(tmp_path / "a.csv", y=scale * Y)
    assert caught.value.diagnostics[0].code == "beyond-precision"


def test_pulses_steps_and_tiny_values_are_no_faults():
    pulse = np.eye(1, 200)[0]
    late = np.where(np.arange(200) < 195, 0.0, 1.0)
    for x in (pulse, late, 0.9 ** np.arange(400.0), 20.0 + 1e-14 * Y, np.r_[Y, 1e-320], 20.0 + pulse):
        assert absurd(x) is None
    assert absurd(np.r_[Y, 1e25, Y]) == N


def test_a_column_that_may_hold_the_times_is_told(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["Sekunden,u,y", *lines_of(20)]))
    (first, second, *_) = read_log(path, Preparation()).steps
    assert first.startswith("the file has no times")
    assert second.startswith("Sekunden rises by even steps")


def test_a_stated_sample_time_is_converted_as_times_are(tmp_path):
    """Thirty seconds are half a minute, whether the file or the user says so."""
    units = Units("s", 30.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
    np.savez(tmp_path / "a.npz", u=U, y=Y, Ts=0.5)
    np.savez(tmp_path / "b.npz", u=U, y=Y)
    assert read_data([tmp_path / "a.npz"], units, Preparation(time_unit="min")).lengths == (N,)
    stated = Preparation(time_unit="min", sample_time=0.5)
    assert read_data([tmp_path / "b.npz"], units, stated).lengths == (N,)
    with pytest.raises(DataError, match=r"sampled every 0\.5 s"):
        read_data([tmp_path / "a.npz"], units, Preparation())


def _said_to_be_rounded(x):
    return any("rounded" in one for one in limits_of_sensor("y", x))


@pytest.mark.parametrize("samples", [3, 4, 5, 7, 10, 20, 50])
@pytest.mark.parametrize("digits", [3, 5, None])
def test_continuous_records_are_not_said_to_be_rounded(samples, digits):
    rng = np.random.default_rng(samples)
    drawn = np.cumsum(rng.standard_normal((1000, samples)), axis=1)
    if digits is not None:
        drawn = np.round(drawn, digits)
    assert sum(map(_said_to_be_rounded, drawn)) <= 10


def test_a_periodic_record_is_not_said_to_be_rounded():
    assert not _said_to_be_rounded(np.tile([0.0, 1.03, 2.61, 0.37, -1.2], 20))


@pytest.mark.parametrize("samples", [10, 20, 200])
def test_short_rounded_records_still_are(samples):
    rng = np.random.default_rng(samples)
    for _ in range(100):
        x = np.round(2.0 * rng.standard_normal(samples)) * 1.04
        assert _said_to_be_rounded(np.round(40.0 + x, 3))
    assert _said_to_be_rounded(np.array([0.0, 1.0] * 5))


@pytest.mark.parametrize("stated", [0.5, 0.8, 1.2, 2.0, 1000.0])
def test_a_sample_time_that_contradicts_the_times_is_refused_with_both(stated, tmp_path):
    """Unless the column of times is said not to count, which is what the hint says."""
    units = Units("s", stated, sampled=True, closed_loop=False, inputs=1, outputs=1)
    read(tmp_path / "a.csv")
    for read_one in (
        lambda said: read_log(tmp_path / "a.csv", said),
        lambda said: read_data([tmp_path / "a.csv"], units, said),
    ):
        with pytest.raises(DataError) as caught:
            read_one(Preparation(sample_time=stated))
        (found,) = caught.value.diagnostics
        assert f"in column time, advance by 1, and --sample-time says {stated:g}" in found.message
        assert "add time=none to --columns" in found.hint
        assert read_one(Preparation(sample_time=stated, columns={"time": "none"})).lengths == (N,)


def test_a_sample_time_that_the_times_advance_by_may_be_stated(tmp_path):
    jittering = TIME + 0.02 * np.sin(3.0 * TIME)
    assert read(tmp_path / "a.csv", time=jittering, sample_time=1.0).lengths == (N,)
    assert read_log(tmp_path / "a.csv", Preparation(sample_time=1.0)).step == 1.0


def test_times_count_more_than_the_sample_time_beside_them(tmp_path):
    """In a record for a spec as in one without."""
    np.savez(tmp_path / "a.npz", u=U, y=Y, time=TIME, Ts=2.0)
    assert read_data([tmp_path / "a.npz"], UNITS, Preparation()).lengths == (N,)
    assert read_log(tmp_path / "a.npz", Preparation()).step == 1.0


@pytest.mark.parametrize("held", [1, 2, 3, 4, 6])
def test_inputs_that_move_between_resampled_instants_are_told(held, tmp_path):
    """Every second sample is kept: an input that is held for an even number of samples loses nothing."""
    u = np.repeat(np.random.default_rng(5).standard_normal(N), held)[:N]
    units = Units("s", 2.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
    read(tmp_path / "a.csv", u=u)
    found = read_data([tmp_path / "a.csv"], units, Preparation(sample_time=2.0, resample=True))
    np.testing.assert_array_equal(found.u[:30, 0], [float(f"{x:.12g}") for x in u[::2]])
    lost = sum(u[k] != u[k - 1] for k in range(1, N - 1, 2))
    told = [note for note in found.notes if "the resampled instants" in note]
    assert len(told) == bool(lost)
    assert all(f"move between {lost} of" in note for note in told)
