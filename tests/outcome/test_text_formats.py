"""CSV loses nothing and hides nothing."""

import csv
import io
import struct

import numpy as np
import pytest
from hypothesis import given, strategies as st

from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_line, csv_rows, csv_text, read_csv


def bits(x: float) -> bytes:
    return struct.pack("<d", x)


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=20))
def test_csv_keeps_every_bit(values):
    lines = csv_text(Table({"x": np.array(values), "minus_x": -np.array(values)})).splitlines()
    assert lines[0] == "x,minus_x"
    for line, value in zip(lines[1:], values, strict=True):
        first, second = line.split(",")
        assert bits(float(first)) == bits(value)
        assert bits(float(second)) == bits(-value)


def test_csv_writes_the_fewest_digits_that_give_back_every_bit():
    table = Table({"x_m": np.array([0.1, 1 / 3, 2.0, -1e22])})
    assert csv_text(table) == "x_m\n0.1\n0.3333333333333333\n2\n-1e+22\n"


TEXTS = st.one_of(
    st.text(), st.sampled_from("=+-@\t'\n=1+1").flatmap(lambda c: st.text().map(lambda t: c + t))
)


@given(st.lists(TEXTS, min_size=1, max_size=5))
def test_no_cell_is_a_formula_and_every_text_is_read_back(cells):
    line = csv_line(["", *cells]).encode()
    (raw,) = csv.reader(io.StringIO(line.decode(), newline=""))
    for cell in raw:
        assert cell[:1] not in ("=", "@", "\t", "\r", "\n")
        assert cell[:1] not in ("+", "-") or isinstance(float(cell), float)
    assert csv_rows(line) == [["", *cells]]


@given(st.floats(allow_nan=False) | st.integers())
def test_numbers_stay_numbers(value):
    for text in {repr(value), f"{value:+}"} - {"+inf"}:
        assert csv_line(["x", text]) == f"x,{text}\n"


@pytest.mark.parametrize(
    "text", ["=1+1", "+", "-", "@SUM(A1)", "-[0.1]", "-1_0", "+1 2", "\uff1d1", "'=1", "\t=1"]
)
def test_texts_that_spreadsheets_run_have_an_apostrophe(text):
    table = csv_text(Table({text: np.zeros(1)}))
    assert next(csv.reader(io.StringIO(table, newline=""))) == [f"'{text}"]


@pytest.mark.parametrize("kind", [">f8", "<f4", ">f4", "<f2", ">i4", "<u8"])
def test_csv_of_columns_of_any_width_and_byte_order(kind):
    values = np.array([0, 1, 3, 1000]).astype(kind)
    values = values / values.dtype.type(8) if values.dtype.kind == "f" else values
    lines = csv_text(Table({"u1": values.astype(kind)})).split()[1:]
    assert [float(line) for line in lines] == [float(value) for value in values]


def test_read_csv_returns_the_columns(tmp_path):
    table = Table({"time_s": np.arange(3.0), "u1": np.array([0.1, -1e-300, 5e-324])})
    (tmp_path / "signal.csv").write_text(csv_text(table))
    read = read_csv(tmp_path / "signal.csv")
    assert list(read) == ["time_s", "u1"]
    for name, values in table.columns.items():
        np.testing.assert_array_equal(read[name], values)


def test_read_csv_of_a_table_without_rows(tmp_path):
    (tmp_path / "t.csv").write_text(csv_text(Table({"a": np.zeros(0), "b": np.zeros(0)})))
    assert {name: len(values) for name, values in read_csv(tmp_path / "t.csv").items()} == {"a": 0, "b": 0}


@pytest.mark.parametrize(
    "columns",
    [{"a": np.zeros(2), "b": np.zeros(3)}, {"a": np.zeros((2, 2))}, {"a": np.zeros(2, dtype=complex)}],
)
def test_csv_refuses_what_is_no_table(columns):
    with pytest.raises(ValueError, match="column"):
        csv_text(Table(columns))
