"""The same numbers come out of every kind of file; what cannot be read is said with its line."""

import codecs
import contextlib
import io

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.errors import DataError, IdesignError
from inputdesign_cli.tasks.build.files import isolated, read_sheet
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.tasks.build.tables import columns_of, read_columns

TIME, U, Y = np.arange(4.0), np.array([1.5, -2.0, 3.25, 0.0]), np.array([10.0, 11.5, 12.0, 13.75])
ROWS = list(zip(TIME, U, Y, strict=True))


def table(mark, *, header="time,u,y", comma=False):
    def cell(x):
        return f"{x:g}".replace(".", ",") if comma else f"{x:g}"

    head = [mark.join(header.split(","))] if header else []
    return "\n".join([*head, *(mark.join(map(cell, row)) for row in ROWS)]) + "\n"


TEXTS = {
    "commas": table(","),
    "tabs": table("\t"),
    "semicolons": table(";"),
    "blanks": table("  "),
    "decimal commas": table(";", comma=True),
    "decimal commas between tabs": table("\t", comma=True),
    "comments": "# logged by hand\n\n" + table(",").replace("\n1,", "\n# a pause\n1,"),
    "units in the header": table(",", header="Time (s),U [V],y_degC"),
    "a row of units": table(",").replace("time,u,y\n", "time,u,y\ns,V,degC\n"),
    "a byte order mark": "﻿" + table(","),
    "windows": table(",").replace("\n", "\r\n"),
    "a header in a comment": "# time,u,y\n" + table(",", header=""),
}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_text_is_read_however_it_is_written(text, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode())
    found = read_columns(path, {"time": "time", "u": "u", "y": "y"}, key="")
    for name, expected in (("time", TIME), ("u", U), ("y", Y)):
        np.testing.assert_array_equal(found[name], expected)


def test_columns_without_names_go_by_number(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(",", header=""))
    np.testing.assert_array_equal(read_columns(path, {"u": "2"}, key="")["u"], U)
    with pytest.raises(DataError, match="no header that names y"):
        read_columns(path, {"y": "y"}, key="")


def test_gaps_are_nan_and_text_is_not(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("u,y\n1,2\n,NaN\nn/a,4\n5,6\n")
    found = columns_of(read_sheet(path, key=""), {"u": "u", "y": "y"})
    np.testing.assert_array_equal(found["u"], [1, np.nan, np.nan, 5])
    np.testing.assert_array_equal(found["y"], [2, np.nan, 4, 6])
    path.write_text("u,y\n1,2\n3,broken\n")
    with pytest.raises(DataError, match="'broken' in column y") as caught:
        columns_of(read_sheet(path, key=""), {"y": "y"})
    assert caught.value.diagnostics[0].location.line == 3


def iddata():
    return {"InputData": U[:, None], "OutputData": Y[:, None], "Ts": 0.5, "InputName": "valve"}


@pytest.mark.parametrize(
    "content", [{"u": U, "y": Y, "Ts": 0.5}, {"data": iddata()}], ids=["arrays", "iddata"]
)
def test_mat_files_hold_arrays_or_an_iddata(content, tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, content)
    np.testing.assert_array_equal(read_columns(path, {"u": "u"}, key="")["u"], U)
    np.testing.assert_array_equal(read_columns(path, {"y": "y"}, key="")["y"], Y)
    assert read_sheet(path, key="").pace.sample_time == 0.5


def test_wide_arrays_are_several_channels(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, u=np.column_stack([U, -U]), y=Y)
    found = read_columns(path, {"u2": "u2", "y": "y"}, key="")
    np.testing.assert_array_equal(found["u2"], -U)


def test_objects_of_matlab_get_the_lines_that_convert_them(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"note": "an iddata lives elsewhere"})
    with pytest.raises(DataError) as caught:
        read_sheet(path, key="")
    assert "save('data.mat', '-struct', 's'" in caught.value.diagnostics[0].hint


@pytest.mark.parametrize("name", ["log.mat", "log.npz", "log.xlsx", "log.parquet"])
def test_broken_files_are_refused(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04 not at all")
    with pytest.raises(DataError) as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].code == "data-unreadable"


def test_arrays_of_objects_are_never_unpickled(tmp_path):
    buffer = io.BytesIO()
    np.savez(buffer, u=np.array([{"a": 1}, None], dtype=object))
    (tmp_path / "log.npz").write_bytes(buffer.getvalue())
    with pytest.raises(DataError):
        read_sheet(tmp_path / "log.npz", key="")


@pytest.mark.parametrize(("name", "writer"), [("log.parquet", "to_parquet"), ("log.xlsx", "to_excel")])
def test_parquet_and_excel_are_read_where_pandas_is(name, writer, tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow" if "parquet" in name else "openpyxl")
    frame = pandas.DataFrame({"time": TIME, "u": U, "y": Y, "note": list("abcd")})
    getattr(frame, writer)(tmp_path / name, index=False)
    np.testing.assert_array_equal(read_columns(tmp_path / name, {"u": "u"}, key="")["u"], U)


# What loggers write: a preamble, names, units, dates; one moment after the other.
LOGGERS = {
    "a preamble of keys": "Logger X1\nSerial,42\nOperator,Bob\n\ntime,u,y\n{rows}",
    "a preamble as wide as the table": "a,b,c\nd,e,f\ntime,u,y\n{rows}",
    "a preamble above names and units": "Logger,X1\n\ntime,u,y\ns,V,degC\n{rows}",
    "a preamble without names": "Logger X1\nwritten by hand\n{rows}",
    "a separator at every end": "time,u,y\n{trailing}",
    "quotes": '"time","u","y"\n{rows}',
    "a name of two lines": 'time,"u\n(V)",y\n{rows}',
    "bars": "time|u|y\n{bars}",
    "zeros after the end": "time,u,y\n{rows}\x00\x00",
}


@pytest.mark.parametrize("layout", LOGGERS.values(), ids=LOGGERS)
def test_what_loggers_write_around_the_table(layout, tmp_path):
    rows = table(",", header="")
    trailing, bars = rows.replace("\n", ",\n"), rows.replace(",", "|")
    path = tmp_path / "log.csv"
    path.write_text(layout.format(rows=rows, trailing=trailing, bars=bars))
    unnamed = "without names" in layout or "by hand" in layout
    wanted = {"time": "1", "u": "2", "y": "3"} if unnamed else {"time": "time", "u": "u", "y": "y"}
    found = read_columns(path, wanted, key="")
    for name, expected in (("time", TIME), ("u", U), ("y", Y)):
        np.testing.assert_array_equal(found[name], expected)


ENCODINGS = {
    "utf-8": ("utf-8", b""),
    "windows": ("cp1252", b""),
    "utf-16": ("utf-16-le", codecs.BOM_UTF16_LE),
    "utf-16 the other way": ("utf-16-be", codecs.BOM_UTF16_BE),
    "utf-16 unmarked": ("utf-16-le", b""),
    "utf-16 unmarked the other way": ("utf-16-be", b""),
    "utf-32": ("utf-32-le", codecs.BOM_UTF32_LE),
}


@pytest.mark.parametrize(("encoding", "mark"), ENCODINGS.values(), ids=ENCODINGS)
def test_names_keep_their_letters_in_every_encoding(encoding, mark, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(mark + table(",", header="time,u (°C),y größe").encode(encoding))
    sheet = read_sheet(path, key="")
    assert sheet.names == ("time", "u (°C)", "y größe")
    np.testing.assert_array_equal(columns_of(sheet, {"u": "u"})["u"], U)


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


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('u,y\n1,2\n3,"4\n5,6\n', 3),
        ('u,y\n1,2\n"3,4\n' + "5,6\n" * 60_000, 3),  # beyond the largest field
        ('u,y\n1,"2\n3,4\n5,"6\n', 2),
        ('secret "of a kind\nu,"y\n1,2\n', 2),
    ],
)
def test_quotes_that_nothing_closes_are_told_with_their_line(text, line, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=f"quote that opens in line {line} ") as caught:
        read_sheet(path, key="")
    (told,) = caught.value.diagnostics
    assert (told.code, told.location.line, told.location.text) == ("data-unreadable", line, "")


CELLS = st.sampled_from(
    [*(f"{x:g}" for x in (0.0, 1.5, -2e300, 1e-320)), "1,5", "nan", "", '"', '""', "12.03.2024", "10:15", "u"]
)
PIECES = st.one_of(
    st.binary(max_size=40),
    CELLS.map(str.encode),
    st.sampled_from(
        [b"\n", b"\r\n", b",", b";", b"\t", b"#", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"PK\x03\x04"]
    ),
)


@pytest.mark.parametrize("ending", ["csv", "npz", "xlsx", "parquet"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pieces=st.lists(PIECES, max_size=40))
def test_no_bytes_lead_to_another_error(ending, pieces, tmp_path):
    path = tmp_path / f"log.{ending}"
    path.write_bytes(b"".join(pieces))
    with contextlib.suppress(IdesignError):
        read_log(path, Preparation(columns={"u1": "1", "y1": "2"}))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    cells=st.lists(st.lists(CELLS, min_size=2, max_size=3), min_size=1, max_size=30),
    mark=st.sampled_from(",;\t"),
)
def test_no_table_leads_to_another_error(cells, mark, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(mark.join(row) for row in cells))
    with contextlib.suppress(IdesignError):
        read_log(path, Preparation(columns={"u1": "1", "y1": "2"}))


@pytest.mark.parametrize("kind", ["mat", "npz", "xlsx", "parquet"])
def test_no_damage_to_a_file_leads_to_another_error(kind, tmp_path):
    path = tmp_path / f"log.{kind}"
    if kind == "mat":
        scipy.io.savemat(path, {"u": U, "y": Y, "Ts": 0.5})
    elif kind == "npz":
        np.savez_compressed(path, u=U, y=Y)
    else:
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame({"u": U, "y": Y})
        getattr(frame, "to_parquet" if kind == "parquet" else "to_excel")(path, index=False)
    whole = path.read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(8 if kind == "mat" else 40):
        broken = bytearray(whole[: rng.integers(1, len(whole) + 1)])
        for at in rng.integers(0, len(broken), 4):
            broken[at] = rng.integers(256)
        path.write_bytes(broken)
        with contextlib.suppress(IdesignError):
            read_log(path, Preparation(columns={"u1": "u", "y1": "y"}))


def test_a_file_that_ends_its_reader_is_refused(tmp_path):
    """Sizes of a .mat file that do not fit its bytes lead SciPy's reader beyond its memory."""
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"u": U, "y": Y, "Ts": 0.5})
    broken = bytearray(path.read_bytes())
    broken[176] = 0  # the kind of the numbers of u
    path.write_bytes(broken)
    with pytest.raises(DataError, match=r"no \.mat file that can be read"):
        read_sheet(path, key="")


def cells_of(path, text):
    path.write_text(text)
    sheet = read_sheet(path, key="")
    return np.column_stack([column.numbers for column in sheet.columns])


def test_a_row_of_empty_cells_between_numbers_is_a_sample_that_is_missing(tmp_path):
    found = cells_of(tmp_path / "log.csv", "u1,y1\n,\n1,2\n,\n3,4\n,\n")
    np.testing.assert_array_equal(found, [[1, 2], [np.nan, np.nan], [3, 4]])


def test_it_is_one_beside_a_column_of_words_too(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("u1,y1,state\n1,2,ok\n,,\n3,4,ok\n")
    np.testing.assert_array_equal(read_columns_with_gaps(path), [1, np.nan, 3])


def read_columns_with_gaps(path):
    return columns_of(read_sheet(path, key=""), {"u": "u1"})["u"]


@pytest.mark.parametrize("preamble", ["Serial,42\n\n,\n", "# 1,2\n\n", "\n"])
def test_what_stands_above_the_table_cuts_nothing(preamble, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(preamble + "u1,y1\n\n1,2\n3,4\n\n# the end\n")
    sheet = read_sheet(path, key="")
    assert sheet.passed == ()
    assert len(sheet.lines) == 2


def test_a_field_that_is_too_long_is_no_open_quote(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"u,y\n1,2\n3,{'4' * 200_000}\n")
    with pytest.raises(DataError, match="line 3 has a field of more than 131072 characters") as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].location.line == 3


def test_an_object_beside_other_arrays_is_told_with_the_lines_that_convert_it(monkeypatch, tmp_path):
    """SciPy writes no such objects: what its reader tells of one."""
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0 MAT-file")
    monkeypatch.setattr(isolated, "arrays_of", lambda raw: isolated.Arrays({"v": U}, opaque=True))
    with pytest.raises(DataError) as caught:
        read_log(path, Preparation())
    assert "save('data.mat', '-struct', 's'" in caught.value.diagnostics[0].message


WRONG = {
    "complex numbers": U + 1j,
    "text": np.array(list("abcd")),
    "an array of 3 dimensions": np.ones((4, 2, 2)),
    "nothing": np.zeros(0),
    "a single number": np.array(2.0),
}


@pytest.mark.parametrize("kind", ["npz", "mat"])
@pytest.mark.parametrize("what", WRONG)
def test_arrays_that_are_no_columns_are_told_by_what_they_hold(kind, what, tmp_path):
    path = tmp_path / f"log.{kind}"
    (np.savez if kind == "npz" else lambda path, **arrays: scipy.io.savemat(path, arrays))(
        path, u=WRONG[what], y=Y
    )
    for read in (lambda: read_log(path, Preparation()), lambda: read_columns(path, {"u": "u"}, key="")):
        with pytest.raises(DataError) as caught:
            read()
        assert caught.value.diagnostics[0].message.startswith(f"u in log.{kind} holds {what}: ")


def test_arrays_that_mean_columns_of_numbers_are_columns(tmp_path):
    """Complex numbers without an imaginary part, a third dimension of one, fields, and times."""
    path = tmp_path / "log.npz"
    moments = np.datetime64("2024-03-12T10:15:00") + (1000 * TIME).astype("timedelta64[ms]")
    fields = np.array(list(zip(U, Y, strict=True)), dtype=[("u1", float), ("y1", float)])
    np.savez(path, time=moments, u2=U + 0j, y2=Y[:, None, None], fields=fields)
    names = ("time", "u1", "y1", "u2", "y2")
    found = read_columns(path, {name: name for name in names}, key="")
    for name, expected in zip(names, (TIME, U, Y, U, Y), strict=True):
        np.testing.assert_array_equal(found[name], expected)


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


NO_SAMPLE_TIME = {
    "Ts holds text ('0.5 s')": {"Ts": "0.5 s"},
    "Ts holds complex numbers": {"Ts": 0.5 + 1j},
    "Ts holds a truth value": {"Ts": np.array(True)},
    "dt holds a date or a length of time": {"dt": np.timedelta64(500, "ms")},
    "Ts says 0.5 and dt says 1": {"Ts": 0.5, "dt": 1.0},
}


@pytest.mark.parametrize(("told", "stated"), NO_SAMPLE_TIME.items(), ids=NO_SAMPLE_TIME)
def test_a_sample_time_that_is_none_is_refused_unless_another_is_given(told, stated, tmp_path):
    """`isolated.Arrays` is what both kinds of files come through; only .npz holds all of these."""
    path = tmp_path / "log.npz"
    np.savez(path, u=U, y=Y, **stated)
    with pytest.raises(DataError) as caught:
        read_log(path, Preparation())
    (only,) = caught.value.diagnostics
    assert only.message == f"log.npz states no sample time: {told}"
    assert "--sample-time" in only.hint
    assert read_log(path, Preparation(sample_time=0.5)).step == 0.5


@pytest.mark.parametrize("stated", [{"Ts": "0.5"}, {"Ts": np.float32(0.5)}, {"Ts": 0.5, "dt": [[0.5]]}])
@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_a_sample_time_is_honoured_however_it_is_saved(kind, stated, tmp_path):
    path = tmp_path / f"log.{kind}"
    save(path, u=U, y=Y, **stated)
    assert read_log(path, Preparation()).step == 0.5


def save(path, **arrays):
    (np.savez if path.suffix == ".npz" else lambda path, **arrays: scipy.io.savemat(path, arrays))(
        path, **arrays
    )


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_an_empty_sample_time_says_nothing(kind, tmp_path):
    """As in an iddata whose samples are not evenly spaced."""
    path = tmp_path / f"log.{kind}"
    save(path, u=U, y=Y, time=2.0 * TIME, Ts=np.zeros(0))
    assert read_log(path, Preparation()).step == 2.0


def test_the_unit_of_an_iddata_is_that_of_its_times(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"data": {**iddata(), "TimeUnit": "minutes"}})
    assert read_log(path, Preparation()).time_unit == "min"
    scipy.io.savemat(path, {"data": {**iddata(), "TimeUnit": "weeks"}})
    with pytest.raises(DataError, match="states its times in 'weeks'"):
        read_log(path, Preparation())
    assert read_log(path, Preparation(time_unit="d")).time_unit == "d"


def test_times_that_contradict_the_sample_time_are_told(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, u=U, y=Y, time=2.0 * TIME, Ts=0.5)
    found = read_log(path, Preparation())
    assert found.step == 2.0
    assert "log.npz states the sample time 0.5, and its times advance by 2: they count" in found.steps


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        (b"\x00", r"1 control character \(code 0\)"),
        (b"\x00" * 4096, r"4096 control characters \(code 0\)"),
        (b"\x07", r"1 control character \(code 7\)"),
        (b"\x81", "bytes that are no letters in UTF-8 or Windows-1252"),
    ],
    ids=["NUL", "many", "bell", "undecodable"],
)
def test_characters_that_no_text_has_are_told_with_their_line(fault, told, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(table(",").encode().replace(b"\n2,", b"\n" + fault + b"2,"))
    with pytest.raises(DataError, match=f"line 4 has {told}") as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].location.line == 4


def test_bytes_of_any_kind_are_no_text(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    with pytest.raises(DataError, match="is no text") as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].location is None


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
