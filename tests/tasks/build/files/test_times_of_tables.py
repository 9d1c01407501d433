"""One table has the same times in whatever file and however they are written; what is not used is named."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.questions.building.tables import columns_of

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")
pytest.importorskip("openpyxl")

STEP, COUNT = 90.0, 60
U = np.repeat([49.0, 51.5, 48.25, 50.0], COUNT // 4)
Y = 1300.0 + np.round(np.cumsum(U - 49.5), 2)
# From half an hour before midnight to an hour after it.
MOMENTS = pandas.date_range("2024-03-12 23:30", periods=COUNT, freq="90s")
TABLE = pandas.DataFrame({"u": U, "y": Y})
DAYS, CLOCK = MOMENTS.strftime("%d.%m.%Y"), MOMENTS.strftime("%H:%M:%S")


def timed(**columns):
    return pandas.concat([pandas.DataFrame(columns), TABLE], axis=1)


def parquet(frame):
    return "log.parquet", frame.to_parquet


def csv(frame, **options):
    return "log.csv", lambda path: frame.to_csv(path, **options)


def workbook(frame, **options):
    return "log.xlsx", lambda path: frame.to_excel(path, **options)


GERMAN = {"sep": ";", "decimal": ",", "index": False}
FILES = {
    "csv": csv(timed(time=MOMENTS), index=False),
    "csv, index": csv(TABLE.set_index(MOMENTS)),
    "csv, date and time of day": csv(timed(Datum=DAYS, Uhrzeit=CLOCK), **GERMAN),
    "csv, the time of day first": csv(timed(Time=CLOCK, Date=DAYS), index=False),
    "csv, time of day": csv(timed(Uhrzeit=CLOCK), **GERMAN),
    "csv, time of day before noon and after": csv(timed(start=MOMENTS.strftime("%I:%M:%S %p")), index=False),
    "csv, no word for time": csv(timed(stempel=DAYS + " " + CLOCK), **GERMAN),
    "csv, seconds by the clock": csv(timed(Hora=STEP * np.arange(COUNT)), index=False),
    "parquet": parquet(timed(timestamp=MOMENTS)),
    "parquet, zone": parquet(timed(timestamp=MOMENTS.tz_localize("UTC"))),
    "parquet, zone that changes": parquet(timed(timestamp=MOMENTS.tz_localize("America/New_York"))),
    "parquet, index": parquet(timed(timestamp=MOMENTS).set_index("timestamp")),
    "parquet, zone in the index": parquet(TABLE.set_index(MOMENTS.tz_localize("UTC"))),
    "parquet, seconds in the index": parquet(timed(time=STEP * np.arange(COUNT)).set_index("time")),
    "parquet, text": parquet(timed(timestamp=MOMENTS.strftime("%Y-%m-%dT%H:%M:%S"))),
    "parquet, text and zone": parquet(timed(timestamp=MOMENTS.strftime("%Y-%m-%d %H:%M:%S+01:00"))),
    "parquet, date and time of day": parquet(timed(Datum=MOMENTS.date, Uhrzeit=MOMENTS.time)),
    "parquet, lengths of time": parquet(timed(time=MOMENTS - MOMENTS[0])),
    "parquet, numbers that may be missing": parquet(timed(time=MOMENTS).convert_dtypes()),
    "workbook": workbook(timed(Zeit=MOMENTS), index=False),
    "workbook, index": workbook(TABLE.set_index(MOMENTS)),
    "workbook, date and time of day": workbook(timed(Datum=MOMENTS.date, Uhrzeit=MOMENTS.time), index=False),
    "workbook, dates as text": workbook(timed(Datum=DAYS, Uhrzeit=CLOCK), index=False),
}


@pytest.mark.parametrize(("name", "write"), FILES.values(), ids=FILES)
def test_the_same_table_tells_the_same_sample_time_and_signals(name, write, tmp_path):
    write(tmp_path / name)
    log = read_log(tmp_path / name, Preparation())
    assert log.step == STEP
    assert log.lengths == (COUNT,)
    np.testing.assert_array_equal(log.u[:, 0], U)
    np.testing.assert_array_equal(log.y[:, 0], Y)
    assert not any("no times" in step for step in log.steps)


@pytest.mark.parametrize("asked", ["Datum", "Uhrzeit", "1", "2"])
def test_either_of_two_columns_holds_the_times_that_both_say(asked, tmp_path):
    frame = timed(Datum=DAYS, Uhrzeit=CLOCK)
    late = frame.assign(Datum=frame.Datum.where(frame.index < 30, "15.03.2024"))
    late.to_csv(tmp_path / "log.csv", **GERMAN)
    found = columns_of(read_sheet(tmp_path / "log.csv", key=""), {"time": asked})["time"]
    expected = STEP * np.arange(COUNT) + np.where(np.arange(COUNT) < 30, 0.0, 2 * 86_400.0)
    np.testing.assert_allclose(found, expected)


def test_what_makes_times_of_columns_is_told(tmp_path):
    timed(Datum=DAYS, Uhrzeit=CLOCK).to_csv(tmp_path / "both.csv", **GERMAN)
    timed(Uhrzeit=CLOCK).to_csv(tmp_path / "clock.csv", **GERMAN)
    assert "Datum and Uhrzeit were joined: dates and times of day" in _steps(tmp_path / "both.csv")
    # 20 steps of 90 s until midnight, and the header.
    assert "Uhrzeit passes midnight (before row 22): a day was added" in _steps(tmp_path / "clock.csv")


def test_times_that_go_back_within_a_day_are_no_midnight(tmp_path):
    timed(Uhrzeit=CLOCK[::-1]).to_csv(tmp_path / "log.csv", **GERMAN)
    with pytest.raises(DataError, match="do not increase"):
        read_log(tmp_path / "log.csv", Preparation())


def test_columns_that_may_hold_the_times_and_are_not_used_are_named(tmp_path):
    frame = timed(begun=MOMENTS, ended=MOMENTS, pulse=STEP * np.arange(COUNT), state="on")
    frame.to_parquet(tmp_path / "log.parquet")
    told = "\n".join(_steps(tmp_path / "log.parquet"))
    assert "the file has no times" in told
    assert "begun holds dates or times of day: if it holds the times, add time=begun to --columns" in told
    assert "ended holds dates" in told
    assert "pulse rises by even steps" in told
    assert "state is not used: it holds text" in told


def test_a_column_of_times_that_cannot_be_read_is_told_as_such(tmp_path):
    timed(stamp=[f"turn {k}" for k in range(COUNT)]).to_parquet(tmp_path / "log.parquet")
    with pytest.raises(DataError, match=r"stamp in log.parquet holds text: times are numbers or dates"):
        read_log(tmp_path / "log.parquet", Preparation(columns={"time": "stamp"}))


@pytest.mark.parametrize(
    ("cell", "plain"), [("1.299,49", "1299,49"), ("1.299.499", "1299499"), ("12.299,4", "12299,4")]
)
def test_a_mark_between_thousands_is_told_as_it_stands_in_the_file(cell, plain, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"Zeit;u;y\n0;49,5;{cell}\n1;49,0;299,0\n2;48,5;300,5\n")
    with pytest.raises(DataError) as caught:
        read_log(path, Preparation())
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.message.startswith(f"'{cell}' in column y")
    assert f"mark between thousands (without: {plain})" in diagnostic.message
    assert diagnostic.location.text == f"0;49,5;{cell}"


def test_names_with_commas_keep_them(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Zeit;Valve, left;y\n0;49,5;1,0\n1;49,0;2,0\n2;48,5;3,5\n")
    assert read_sheet(path, key="").names == ("Zeit", "Valve, left", "y")


@pytest.fixture
def book(tmp_path):
    path = tmp_path / "log.xlsx"
    with pandas.ExcelWriter(path) as writer:
        pandas.DataFrame([["Report"], ["Plant 2"]]).to_excel(writer, sheet_name="Info", index=False)
        timed(Zeit=MOMENTS).to_excel(writer, sheet_name="Data", index=False)
    return path


def test_a_table_in_another_sheet_is_pointed_at_and_read_by_its_name(book):
    with pytest.raises(DataError) as caught:
        read_log(book, Preparation())
    assert "name one as 'log.xlsx#Data'" in caught.value.diagnostics[0].hint
    log = read_log(book.with_name("log.xlsx#Data"), Preparation())
    assert log.step == STEP
    np.testing.assert_array_equal(log.y[:, 0], Y)


def test_a_sheet_that_is_not_there_is_told_with_those_that_are(book):
    with pytest.raises(DataError) as caught:
        read_sheet(book.with_name("log.xlsx#data"), key="")
    assert caught.value.diagnostics[0].hint == "the sheets are Info, Data"


def _steps(path):
    return read_log(path, Preparation()).steps
