"""Tables of text, however they are written; what is no table is said with its line."""

import codecs

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.questions.building.tables import columns_of, read_columns
from tests.support.logs import TIME, U, Y, table

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


# What loggers write: a preamble, names, units, dates; one moment after the other.
LOGGERS = {
    "a preamble of keys": "Logger X1\nSerial,42\nOperator,Bob\n\ntime,u,y\n{rows}",
    "a preamble as wide as the table": "a,b,c\nd,e,f\ntime,u,y\n{rows}",
    "a preamble as wide as the table, of empty cells": "Logger X1,,\nSerial,42,\n,,\ntime,u,y\n{rows}",
    "the same above names and units": "Logger X1,,\ntime,u,y\ns,V,degC\n{rows}",
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


@pytest.mark.parametrize("mark", [",", ";", "\t", " ", "|"])
def test_a_line_of_more_fields_than_a_table_has_is_refused_with_its_line(mark, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"u{mark}y\n1{mark}2\n{mark.join('1' * 16_385)}\n")
    with pytest.raises(DataError, match=r"16385 fields \(line 3\), and at most 16384") as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].location.line == 3


def test_as_many_columns_as_a_workbook_has_are_read(tmp_path):
    path = tmp_path / "log.csv"
    numbers = np.arange(3.0 * 16_384).reshape(3, -1)
    path.write_text("".join(",".join(f"{x:.1f}" for x in row) + "\n" for row in numbers))
    found = read_sheet(path, key="")
    np.testing.assert_array_equal(np.column_stack([column.numbers for column in found.columns]), numbers)
