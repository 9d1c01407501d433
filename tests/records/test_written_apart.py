"""Logs whose columns were written at different times are refused with the remedy, and joined when asked."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records import Preparation, read_data, read_log

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)


def refused(read):
    with pytest.raises(DataError) as caught:
        read()
    (found,) = caught.value.diagnostics
    assert found.code == "data-not-a-number"
    return found


@pytest.mark.parametrize("header", ["time,u,y", "step,u,y"])
def test_rows_of_which_none_is_whole_are_refused(header, tmp_path):
    """A logger that writes inputs and outputs in turn."""
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *(f"{2 * k},{k % 3},\n{2 * k + 1},,{k % 7}" for k in range(20))]))
    for read_one in (lambda: read_data([path], UNITS, Preparation()), lambda: read_log(path, Preparation())):
        assert "join the rows" in refused(read_one).hint


def test_columns_that_were_written_at_different_times_are_joined_when_asked(tmp_path):
    """u when it changes, y every 5 s and y2 every 10 s: u is its mean, y2 lies between its neighbours."""
    path = tmp_path / "log.csv"
    rows = ["time,u,y1,y2", "0,7,0,0"]
    for k in range(1, 60):
        if k % 6 == 0:
            rows.append(f"{5 * k - 1},{k},,")
        rows.append(f"{5 * k},,{k * k},{'' if k % 2 else 3 * k}")
    path.write_text("\n".join([*rows, ""]))
    assert "--resample" in refused(lambda: read_log(path, Preparation())).hint
    log = read_log(path, Preparation(resample=True))
    k = np.arange(59)  # at the last y2 is no longer known
    assert log.step == 5.0
    held = np.where(k < 6, 7, k - k % 6)
    # A second before every sixth sample it is written anew.
    np.testing.assert_allclose(log.u[:, 0], np.where(k % 6 == 5, 0.8 * held + 0.2 * (k + 1), held))
    (joined,) = (one.figures for one in log.findings if one.code == "columns-joined")
    assert (joined["moved"], joined["kept"], joined["counts"]) == (9, 60, {"u": 10, "y1": 60, "y2": 30})
    np.testing.assert_allclose(log.y, np.column_stack([k**2, 3 * k]))


@pytest.mark.parametrize(("every", "missing"), [(2, 1), (3, 2)])
def test_an_output_that_was_written_more_seldom_than_the_input_sets_the_sample_time(tmp_path, every, missing):
    """y at one of two or three rows: rows as they stand would be records of one sample each."""
    path = tmp_path / "log.csv"
    rows = [f"{k},{k // 6},{k * k if k % every == 0 else ''}" for k in range(120)]
    path.write_text("\n".join(["time,u,y", *rows, ""]))
    assert "--resample" in refused(lambda: read_log(path, Preparation())).hint
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
    assert "log the time" in refused(lambda: read_log(path, Preparation(resample=True))).hint


def test_an_output_that_misses_some_rows_is_interpolated_but_over_gaps(tmp_path):
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
