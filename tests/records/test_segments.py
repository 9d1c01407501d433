"""Jitter, gaps, spikes and columns of other times: each change of a record is reported by its code."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records import Preparation, read_data, read_log, read_logs
from inputdesign_cli.records.segments import trend

N = 400
UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)


def signals(seed=0, noise=0.05):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 20), 20)
    return u, scipy.signal.lfilter([0.0, 0.1], [1.0, -0.9], u) + noise * rng.standard_normal(N)


def log(path, time, u, y, names="time,u,y"):
    columns = [column for column in (time, u, y) if column is not None]
    rows = [
        ",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in zip(*columns, strict=True)
    ]
    path.write_text("\n".join([names, *rows]) + "\n")
    return path


def codes(record):
    return [one.code for one in record.findings]


def figures(record, code):
    (found,) = (one for one in record.findings if one.code == code)
    return found.figures


def refused(read):
    with pytest.raises(DataError) as caught:
        read()
    return caught.value.diagnostics[0]


def test_a_clean_record_is_left_alone(tmp_path):
    u, y = signals()
    record = read_log(log(tmp_path / "log.csv", np.arange(N), u, y), Preparation())
    assert codes(record) == []
    np.testing.assert_array_equal(record.y[:, 0], y)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_a_gap_and_a_spike_are_repaired_in_one_record(seed, tmp_path):
    """The even samples agree with the smooth signal to the accuracy of linear interpolation."""
    rng = np.random.default_rng(seed)
    u = signals(seed)[0]
    time = np.cumsum(np.r_[0.0, 1.0 + 0.2 * rng.uniform(-1, 1, N - 1)])
    smooth = np.sin(0.02 * time)
    logged = smooth + 1e-3 * rng.standard_normal(N)
    logged[140] += 25.0
    keep = np.delete(np.arange(N), np.arange(250, 300))
    record = read_data([log(tmp_path / "log.csv", time[keep], u[keep], logged[keep])], UNITS, Preparation())
    assert sorted(codes(record)) == ["jitter-evened-out", "record-cut", "spikes-replaced"]
    assert figures(record, "spikes-replaced")["rows"] == [142]
    assert figures(record, "record-cut")["segments"] == len(record.lengths) == 2
    assert 0.1 < figures(record, "jitter-evened-out")["largest"] <= 0.2 + 1e-9
    assert np.max(np.abs(record.y[:, 0] - np.sin(0.02 * record.time))) < 0.01
    ends = np.cumsum(record.lengths)[:-1]
    assert all(np.allclose(np.diff(part), 1.0) for part in np.split(record.time, ends))


def test_large_jitter_is_evened_out_on_request_only(tmp_path):
    u, y = signals()
    time = np.arange(N) + 0.4 * np.random.default_rng(1).uniform(-0.5, 0.5, N)
    path = log(tmp_path / "log.csv", time, u, y)
    found = refused(lambda: read_log(path, Preparation(sample_time=1.0)))
    assert found.code == "data-not-uniform"
    assert "--resample" in found.hint
    assert "jitter-evened-out" in codes(read_log(path, Preparation(sample_time=1.0, resample=True)))


def test_inputs_that_move_between_the_resampled_times_are_reported(tmp_path):
    u, y = np.sign(np.random.default_rng(2).standard_normal(N)), signals()[1]
    path = log(tmp_path / "log.csv", 0.7 * np.arange(N), u, y)
    record = read_log(path, Preparation(sample_time=1.0, resample=True))
    assert figures(record, "inputs-move-between-samples")["instants"] > 0


@pytest.mark.parametrize("sd", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("resolution", [0.0, 0.05])
def test_single_spikes_are_replaced_by_the_mean_of_their_neighbours(sd, resolution, tmp_path):
    u, y = signals(noise=sd)
    y = np.round(y / resolution) * resolution if resolution else y
    broken = y.copy()
    broken[[50, 200, 333]] += [30.0, -40.0, 25.0]
    record = read_log(log(tmp_path / "log.csv", np.arange(N), u, broken), Preparation())
    assert figures(record, "spikes-replaced")["rows"] == [52, 202, 335]
    at = np.array([50, 200, 333])
    expected = y.copy()
    expected[at] = 0.5 * (y[at - 1] + y[at + 1])
    np.testing.assert_allclose(record.y[:, 0], expected, atol=1e-12)
    assert "outlying-values" not in codes(record)


@pytest.mark.parametrize(
    "make", ["pulses of the input", "two samples each", "heavy tails", "steps", "resonance"]
)
@pytest.mark.parametrize("seed", range(5))
def test_pulses_heavy_tails_steps_and_resonances_are_no_spikes(make, seed, tmp_path):
    rng = np.random.default_rng(seed)
    u, y = signals(seed)
    if make == "pulses of the input":
        u = np.where(rng.random(N) < 0.03, 10.0, 0.0)
        y = np.r_[0.0, u[:-1]] + 0.01 * rng.standard_normal(N)
    elif make == "two samples each":
        y[100:102] += 20.0
    elif make == "heavy tails":
        y = y + 0.05 * rng.laplace(size=N)
    elif make == "steps":
        y = u + 1e-3 * rng.standard_normal(N)
    else:
        y = scipy.signal.lfilter([1.0], [1.0, -1.2, 0.95], rng.standard_normal(N))
    assert "spikes-replaced" not in codes(
        read_log(log(tmp_path / "log.csv", np.arange(N), u, y), Preparation())
    )


def test_missing_numbers_and_rows_left_out_on_request_cut_the_record(tmp_path):
    u, y = signals()
    y[[100, 101]] = np.nan
    path = log(tmp_path / "log.csv", np.arange(N), u, y)
    record = read_log(path, Preparation(without=(("", 302, 311),)))
    assert record.lengths == (100, 198, 90)
    assert [one.figures["rows"] for one in record.findings if one.code == "rows-left-out"] == [10, 2]
    assert refused(lambda: read_log(path, Preparation(without=(("", 900, 901),)))).code == "data-unreadable"
    assert refused(lambda: read_log(path, Preparation(without=(("", 1, 900),)))).code == "data-unreadable"
    assert read_log(path, Preparation(skip=300, span=(320, 350))).lengths == (31,)
    assert refused(lambda: read_log(path, Preparation(span=(900, 1000)))).code == "data-unreadable"


@pytest.mark.parametrize(
    ("line", "timed", "lengths"),
    [
        ("\n", False, (100, 300)),
        ("# 1.0,2.0\n", False, (100, 300)),
        ("# a pause\n", False, (100, 300)),
        ("\n", True, (400,)),
        ("# 1.0,2.0\n", True, (400,)),
    ],
)
def test_lines_between_rows_cut_a_record_without_times(line, timed, lengths, tmp_path):
    u, y = signals()
    path = tmp_path / "log.csv"
    log(path, np.arange(N) if timed else None, u, y, "time,u,y" if timed else "u,y")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:101], line, *lines[101:]]))
    record = read_log(path, Preparation())
    assert record.lengths == lengths
    assert codes(record).count("lines-passed-over") == len(lengths) - 1
    assert ("times-assumed" in codes(record)) is not timed


def test_blank_lines_between_all_rows_do_not_cut_the_record(tmp_path):
    u, y = signals()
    path = log(tmp_path / "log.csv", None, u, y, "u,y")
    path.write_text(path.read_text().replace("\n", "\n\n"))
    assert read_log(path, Preparation()).lengths == (N,)


@pytest.mark.parametrize("detrend", ["constant", "linear", "auto"])
def test_means_and_lines_are_subtracted_segment_by_segment(detrend, tmp_path):
    u, y = signals()
    time = np.r_[np.arange(150), np.arange(170, 170 + N - 150)].astype(float)
    record = read_log(log(tmp_path / "log.csv", time, u, y + 0.5 * time), Preparation(detrend=detrend))
    assert [one.code for one in record.findings].count("trend-removed") == 4
    assert record.lined is (detrend != "constant")
    for _, part in record.parts:
        assert abs(part.mean()) < 1e-9
        if detrend != "constant":
            assert abs(np.polyfit(np.arange(len(part)), part[:, 0], 1)[0]) < 1e-9


def test_automatic_detrending_subtracts_a_line_that_explains_half_the_power():
    x = np.random.default_rng(1).standard_normal(200)
    ramp = np.arange(200.0)
    assert trend(x, "auto")[1] is False
    away, line = trend(x + ramp, "auto")
    assert line
    np.testing.assert_allclose(away, np.polyval(np.polyfit(ramp, x + ramp, 1), ramp))


def test_the_operating_point_is_subtracted(tmp_path):
    u, y = signals()
    prepared = Preparation(operating_point={"u1": 40.0, "y1": -3.0})
    record = read_data([log(tmp_path / "log.csv", np.arange(N), 40.0 + u, y - 3.0)], UNITS, prepared)
    np.testing.assert_allclose(record.u[:, 0], u)
    np.testing.assert_allclose(record.y[:, 0], y)
    np.testing.assert_allclose(record.means, 40.0 + u.mean())


@pytest.mark.parametrize("apart", [1.157407, 1.4142, 1.9])
@pytest.mark.parametrize("rounding", [np.round, np.floor])
def test_even_times_that_are_rounded_coarsely_are_refused(apart, rounding, tmp_path):
    """Days with five decimals at a sample time of a second take steps of one and of two digits."""
    u, y = signals()
    path = log(tmp_path / "log.csv", rounding(apart * np.arange(N)), u, y)
    assert refused(lambda: read_log(path, Preparation())).code == "data-not-uniform"
    found = read_log(path, Preparation(sample_time=apart, columns={"time": "none"}))
    assert (found.step, found.lengths) == (apart, (N,))


def test_single_missing_rows_are_not_taken_for_rounded_times(tmp_path):
    u, y = signals()
    kept = np.delete(np.arange(len(u)), [40, 90, 170])
    found = read_log(log(tmp_path / "log.csv", kept.astype(float), u[kept], y[kept]), Preparation())
    assert (found.step, len(found.lengths)) == (1.0, 4)


@pytest.mark.parametrize("step", [0.98, 1.02, 1.06])
def test_even_times_near_the_sample_time_of_the_spec_are_not_jitter(step, tmp_path):
    """Resampling would delay moves by up to half a sample, and change the dead time by as much."""
    u, y = signals()
    path = log(tmp_path / "log.csv", step * np.arange(N), u, y)
    found = refused(lambda: read_data([path], UNITS, Preparation()))
    assert (found.code, found.details["data_sample_time"]) == ("data-not-uniform", pytest.approx(step))
    jittered = step * np.arange(N) + np.random.default_rng(0).uniform(-0.08, 0.08, N)
    record = read_data([log(tmp_path / "jitter.csv", jittered, u, y)], UNITS, Preparation())
    assert "jitter-evened-out" in codes(record)
    # A clock that is off by less than a sample in the whole record is as good as right.
    assert read_data(
        [log(tmp_path / "clock.csv", (1.0 + 0.5 / N) * np.arange(N), u, y)], UNITS, Preparation()
    )


def test_a_sample_time_that_contradicts_times_or_spec_is_refused(tmp_path):
    u, y = signals()
    path = log(tmp_path / "log.csv", 2.0 * np.arange(N), u, y)
    for read in (
        lambda: read_log(path, Preparation(sample_time=1.0)),
        lambda: read_data([path], UNITS, Preparation()),
        lambda: read_data([path], UNITS, Preparation(sample_time=1.0)),
    ):
        assert refused(read).code == "data-not-uniform"
    assert read_log(path, Preparation(sample_time=1.0, columns={"time": "none"})).step == 1.0
    np.savez(tmp_path / "log.npz", u=u, y=y, Ts=0.25)
    assert read_log(tmp_path / "log.npz", Preparation()).step == 0.25


def test_saturated_and_rounded_sensors_are_reported(tmp_path):
    u, y = signals()
    clipped = read_log(log(tmp_path / "a.csv", np.arange(N), u, np.minimum(y, 0.5)), Preparation())
    assert figures(clipped, "sensor-saturated")["value"] == 0.5
    rounded = read_log(log(tmp_path / "b.csv", np.arange(N), u, np.round(y, 0) * 0.3), Preparation())
    assert figures(rounded, "sensor-rounded")["step"] == pytest.approx(0.3)


def test_several_files_are_one_record_and_copies_are_refused(tmp_path):
    paths = [log(tmp_path / f"{name}.csv", np.arange(N), *signals(seed)) for seed, name in enumerate("ab")]
    record = read_logs(paths, Preparation())
    assert record.files == (("a.csv", N), ("b.csv", N))
    assert record.lengths == (N, N)
    np.testing.assert_array_equal(record.without(np.arange(395, 405)).lengths, (395, 395))
    (tmp_path / "c.csv").write_text(paths[0].read_text())
    assert refused(lambda: read_logs([*paths, tmp_path / "c.csv"], Preparation())).code == "data-repeated"


def torn(read):
    found = refused(read)
    assert found.code == "data-not-a-number"
    return found


@pytest.mark.parametrize("header", ["time,u,y", "step,u,y"])
def test_a_record_without_a_complete_row_is_refused(header, tmp_path):
    """The logger writes inputs and outputs in turn."""
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *(f"{2 * k},{k % 3},\n{2 * k + 1},,{k % 7}" for k in range(20))]))
    for read_one in (lambda: read_data([path], UNITS, Preparation()), lambda: read_log(path, Preparation())):
        assert "join the rows" in torn(read_one).hint


def test_columns_logged_at_different_times_are_joined_on_request(tmp_path):
    """Rows hold u on change, y1 every 5 s, y2 every 10 s: u moves at the nearest y1, y2 is interpolated."""
    path = tmp_path / "log.csv"
    rows = ["time,u,y1,y2", "0,7,0,0"]
    for k in range(1, 60):
        if k % 6 == 0:
            rows.append(f"{5 * k - 1},{k},,")
        rows.append(f"{5 * k},,{k * k},{'' if k % 2 else 3 * k}")
    path.write_text("\n".join([*rows, ""]))
    assert "--resample" in torn(lambda: read_log(path, Preparation())).hint
    log = read_log(path, Preparation(resample=True))
    k = np.arange(59)  # y2 is not known at the last sample
    assert log.step == 5.0
    np.testing.assert_array_equal(log.u[:, 0], np.where(k < 6, 7, k - k % 6))
    (joined,) = (one.figures for one in log.findings if one.code == "columns-joined")
    assert (joined["moved"], joined["kept"], joined["counts"]) == (0, 60, {"u": 10, "y1": 60, "y2": 30})
    np.testing.assert_allclose(log.y, np.column_stack([k**2, 3 * k]))


@pytest.mark.parametrize(("every", "missing"), [(2, 1), (3, 2)])
def test_an_output_logged_less_often_than_the_input_sets_the_sample_time(tmp_path, every, missing):
    """One of two or three rows has y; unless rows are joined, each record would have one sample."""
    path = tmp_path / "log.csv"
    rows = [f"{k},{k // 6},{k * k if k % every == 0 else ''}" for k in range(120)]
    path.write_text("\n".join(["time,u,y", *rows, ""]))
    assert "--resample" in torn(lambda: read_log(path, Preparation())).hint
    log = read_log(path, Preparation(resample=True))
    k = np.arange(0, 120, every)
    assert log.step == missing + 1.0
    np.testing.assert_array_equal(log.u[:, 0], k // 6)
    np.testing.assert_array_equal(log.y[:, 0], k**2)


@pytest.mark.parametrize("channel", ["u", "y"])
def test_a_channel_whose_rows_have_no_times_is_refused(tmp_path, channel):
    path = tmp_path / "log.csv"
    cells = {"u": ("{k},", ",{k}"), "y": (",{k}", "{k},")}[channel]
    rows = [f",{cells[0]}\n{{k}},{cells[1]}".format(k=k) for k in range(60)]
    path.write_text("\n".join(["time,u,y", *rows, ""]))
    assert "log the time" in torn(lambda: read_log(path, Preparation(resample=True))).hint


def test_an_output_missing_in_some_rows_is_interpolated_except_over_gaps(tmp_path):
    path = tmp_path / "log.csv"
    there = [k for k in range(200) if k % 3 != 2 and not 90 <= k < 110]
    rows = [f"{k},{k % 7},{2 * k if k in there else ''}" for k in range(200)]
    path.write_text("\n".join(["time,u,y", *rows, ""]))
    log = read_log(path, Preparation(resample=True))
    assert log.step == 1.0
    assert log.lengths == (89, 89)
    k = np.concatenate([np.arange(89), np.arange(111, 200)])
    np.testing.assert_allclose(log.y[:, 0], 2.0 * k)
    np.testing.assert_array_equal(log.u[:, 0], k % 7)
