"""Dates and times of day as seconds; those that cannot be read are said with their line."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.questions.building.tables import columns_of, read_columns
from tests.support.logs import TIME, U, Y

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)

DATES = {
    "points": ["12.03.2024 10:15:00", "12.03.2024 10:15:30", "13.03.2024 10:15:00"],
    "two digits of the year": ["12.03.24 10:15", "12.03.24 10:15:30", "13.03.24 10:15"],
    "a day that is no month": ["12/03/2024 10:15:00", "12/03/2024 10:15:30", "13/03/2024 10:15:00"],
    "a month before the day": ["03/12/2024 10:15:00 AM", "03/12/2024 10:15:30 AM", "03/13/2024 10:15:00 AM"],
    "ISO": ["2024-03-12T10:15:00", "2024-03-12T10:15:30", "2024-03-13T10:15:00"],
    "slashes, the year first": ["2024/03/12 10:15:00", "2024/03/12 10:15:30.000", "2024/03/13 10:15:00"],
}


@pytest.mark.parametrize("dates", DATES.values(), ids=DATES)
def test_dates_are_seconds_since_the_first(dates, tmp_path):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{date};{k},5;{k},25" for k, date in enumerate(dates))
    path.write_text(f"Time;u;y\n{rows}\n")
    sheet = read_sheet(path, key="")
    np.testing.assert_array_equal(columns_of(sheet, {"time": "time"})["time"], [0.0, 30.0, 86400.0])
    assert sheet.columns[0].dated
    np.testing.assert_array_equal(columns_of(sheet, {"u": "u"})["u"], [0.5, 1.5, 2.5])


def test_times_of_a_day_between_blanks(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("Date Time u y\n12.03.2024 10:15:00 1 2\n12.03.2024 10:16:00.5 3 4\n")
    found = columns_of(read_sheet(path, key=""), {"time": "time", "y": "y"})
    np.testing.assert_array_equal(found["time"], [0.0, 60.5])
    np.testing.assert_array_equal(found["y"], [2.0, 4.0])


def test_dates_of_two_meanings_are_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,u\n03/04/2024 10:00,1\n04/04/2024 10:00,2\n05/04/2024 10:00,3\n")
    with pytest.raises(DataError, match="day or the month first"):
        read_columns(path, {"time": "time"}, key="")


def test_dates_of_workbooks_are_times(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    path = tmp_path / "log.parquet"
    pandas.DataFrame(
        {"time": pandas.to_datetime(1e9 * TIME), "u": U, "y": Y, "state": list("abcd")}
    ).to_parquet(path)
    sheet = read_sheet(path, key="")
    np.testing.assert_array_equal(columns_of(sheet, {"time": "time"})["time"], TIME)
    assert sheet.columns[0].dated
    assert sheet.left_out == {"state": "text"}


CLOCK = [f"12.03.2024 10:15:0{k}" for k in range(6)]

NO_DATES = {
    "no such day": ([*CLOCK[:4], "31.02.2024 10:15:04", CLOCK[5]], 6, "as those above are"),
    "another kind": ([*CLOCK[:2], "2024-03-12 10:15:02", *CLOCK[3:]], 4, "as those above are"),
    "a number": ([*CLOCK[:2], "45363.5", *CLOCK[3:]], 4, "as those above are"),
    "more than a date": ([f"{date} CET" for date in CLOCK], 2, "that can be read"),
    "month in words": ([f"Tue Mar 12 2024 10:15:0{k}" for k in range(6)], 2, "that can be read"),
}


@pytest.mark.parametrize(("dates", "line", "told"), NO_DATES.values(), ids=NO_DATES)
def test_the_date_that_cannot_be_read_is_told_with_its_line(dates, line, told, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,u,y\n" + "\n".join(f"{date},{k},1.5" for k, date in enumerate(dates)) + "\n")
    with pytest.raises(DataError) as caught:
        columns_of(read_sheet(path, key=""), {"time": "time"})
    (found,) = caught.value.diagnostics
    assert found.location.line == line
    assert found.message == f"{dates[line - 2]!r} in column time is no date or time {told}"
    assert "2024-03-12 10:15:00" in found.hint


def test_a_date_that_is_missing_is_missing(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,u\n" + "\n".join(f"{date},1" for date in [*CLOCK[:2], "", *CLOCK[3:]]) + "\n")
    found = columns_of(read_sheet(path, key=""), {"time": "time"})["time"]
    np.testing.assert_array_equal(found, [0, 1, np.nan, 3, 4, 5])


FOREIGN = {
    "a month in words": [f"{k + 1:02d}. Jan 2024" for k in range(20)] + ["01. Mai 2024"],
    "German": [f"{k + 1}. M\u00e4rz 2024 10:15" for k in range(21)],
    "French": [f"lun. {k + 1} f\u00e9vr. 2024" for k in range(21)],
    "Spanish": [f"{k + 1} de enero de 2024" for k in range(21)],
    "English": [f"{month} {k + 1}, 2024" for k in range(10) for month in ("January", "March")],
    "Greek": [f"{k + 1:02d}-\u039c\u03b1\u0390-24" for k in range(21)],
    "numbers apart": [f"2024 01 {k + 1:02d}" for k in range(21)],
    "a time of a day": [f"10:15:{k:02d} Uhr" for k in range(21)],
}


def _stamped(path, stamps, name="Stempel"):
    path.write_text(f"{name};u;y\n" + "".join(f"{t};{k % 3};{k % 7}.5\n" for k, t in enumerate(stamps)))
    return path


@pytest.mark.parametrize("name", ["Datum", "Stempel"])
@pytest.mark.parametrize("stamps", FOREIGN.values(), ids=FOREIGN)
def test_dates_in_other_words_are_refused_whatever_their_column_is_called(stamps, name, tmp_path):
    """To do without them would be to guess the sample time; the remedy says that they do not count."""
    path = _stamped(tmp_path / "log.csv", stamps, name)
    for read in (lambda said: read_log(path, said), lambda said: read_data([path], UNITS, said)):
        with pytest.raises(DataError, match="is no date or time that can be read") as caught:
            read(Preparation())
        (found,) = caught.value.diagnostics
        assert found.location.line == 2
        assert "add time=none to --columns" in found.hint
        assert len(read(Preparation(columns={"time": "none"})).y) == len(stamps)


NO_TIMES = {
    "a switch": ["ON", "OFF"],
    "turns": [f"turn {k}" for k in range(21)],
    "sizes": [f"{k} of 21" for k in range(21)],
    "one remark": ["", "valve changed at 10:15 on 12 March 2024", *[""] * 19],
}


@pytest.mark.parametrize("texts", NO_TIMES.values(), ids=NO_TIMES)
def test_texts_that_are_no_dates_hold_no_times_and_are_told(texts, tmp_path):
    path = _stamped(tmp_path / "log.csv", (texts * 11)[:21], "state")
    assert read_data([path], UNITS, Preparation()).lengths == (21,)
    assert "state is not used: it holds text" in read_log(path, Preparation()).steps


def test_two_columns_of_dates_that_cannot_be_read_are_a_question(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"{k + 1}. Mai 2024;{k + 2}. Mai 2024;{k % 3};{k % 7}.5\n" for k in range(21))
    path.write_text(f"begun;ended;u;y\n{rows}")
    for read in (lambda: read_log(path, Preparation()), lambda: read_data([path], UNITS, Preparation())):
        with pytest.raises(DataError, match="several columns of times: begun, ended"):
            read()


def test_dates_in_other_words_are_refused_in_parquet_too(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    stamps = FOREIGN["a month in words"]
    path = tmp_path / "log.parquet"
    pandas.DataFrame({"stamp": stamps, "u": np.arange(21) % 3, "y": np.arange(21) % 7}).to_parquet(path)
    with pytest.raises(DataError, match="is no date or time that can be read"):
        read_log(path, Preparation())
