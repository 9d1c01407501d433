"""JSON, CSV, numbers in text and curves in files: nothing is lost or hidden."""

import csv
import io
import math
import struct
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass
from fractions import Fraction
from typing import Literal, get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome import Outcome, OutcomeError, plain, read_plain
from inputdesign_cli.outcome.codec import NULL, json_text, others
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.run_directory import curves_json, read_curves
from inputdesign_cli.outcome.run_files import FIGURES
from inputdesign_cli.outcome.shares import rounded_down, rounded_up
from inputdesign_cli.outcome.text_formats import csv_columns, csv_line, csv_rows, csv_text
from tests.support.commands import caller
from tests.support.curves import CURVES
from tests.support.refusals import refused


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
    names = list(dict.fromkeys(["time", *filter(None, cells)]))
    table = csv_text(Table({name: np.array([i, 0.5]) for i, name in enumerate(names)}))
    found = csv_columns(table.encode())
    assert [(name, values[0]) for name, values in found.items()] == [
        (name, i) for i, name in enumerate(names)
    ]


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


def test_columns_have_the_fewest_digits_and_are_read_back():
    table = Table({"x_m": np.array([0.1, 1 / 3, 2.0, -1e22])})
    assert csv_text(table) == "x_m\n0.1\n0.3333333333333333\n2\n-1e+22\n"
    table = Table({"time_s": np.arange(3.0), "u1": np.array([0.1, -1e-300, 5e-324])})
    for rows in (slice(None), slice(0)):
        columns = {name: values[rows] for name, values in table.columns.items()}
        read = csv_columns(csv_text(Table(columns)).encode())
        assert list(read) == ["time_s", "u1"]
        for name, values in columns.items():
            np.testing.assert_array_equal(read[name], values)


@pytest.mark.parametrize(
    "columns",
    [{"a": np.zeros(2), "b": np.zeros(3)}, {"a": np.zeros((2, 2))}, {"a": np.zeros(2, dtype=complex)}],
)
def test_csv_refuses_columns_that_form_no_table(columns):
    with pytest.raises(ValueError, match="column"):
        csv_text(Table(columns))


SIZES = st.floats(1e-30, 1e30) | st.floats(-1e30, -1e-30) | st.just(0.0)


@given(value=SIZES, digits=st.integers(2, 9))
def test_rounding_down_and_up_encloses_the_value_closely(value, digits):
    down, up = (Fraction(rounded(value, digits)) for rounded in (rounded_down, rounded_up))
    slack = abs(Fraction(value)) / 10**11
    assert down - slack <= Fraction(value) <= up + slack
    assert up - down <= abs(Fraction(value)) / 10 ** (digits - 1) + slack


@pytest.mark.parametrize(("value", "down", "up"), [(3.14159265, "3.141", "3.142"), (0.5, "0.5", "0.5")])
def test_rounding_to_four_digits_keeps_shorter_numbers(value, down, up):
    assert (rounded_down(value, 4), rounded_up(value, 4)) == (down, up)


ROBUST = """
plant:
  A: [[1, -0.7], [1, 0.4]]
  B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 120}
accuracy: {model_error: {relative: 0.3}}
spectrum: {type: fir, order: 2}
signal: {candidates: 2}
solver: {any_spectrum: false}
uncertainty: {scenarios: 2, fresh: 2, intervals: {"a1[1]": [-0.72, -0.68], "b1[2,2]": [1.1, 1.3]}}
"""
ENTRIES = {"a1[1]", "a1[2]", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]"}


def test_rows_have_as_many_fields_as_the_header_where_names_have_commas(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(ROBUST)
    assert caller(monkeypatch, capsys)("solve", "s.yaml", "-o", "out", "--no-figures")[0] == 0
    for path in (tmp_path / "out").glob("*.csv"):
        with path.open(newline="") as file:
            header, *rows = csv.reader(file)
        assert {len(row) for row in rows} == {len(header)}, path
        assert len(set(header)) == len(header), path
        assert path.name != "scenarios.csv" or set(header) >= ENTRIES


BAD = [math.nan, math.inf, np.array([1.0, np.nan]), complex(0, -math.inf)]


@pytest.mark.parametrize(
    ("bad", "kind", "place"),
    [
        *(({"deep": [one]}, ValueError, r"result\.deep\[0\]") for one in BAD),
        *((one, TypeError, "result") for one in ({1: 2}, {"a": object()}, {"a": {1, 2}})),
    ],
)
def test_json_has_no_nan_and_no_foreign_types(bad, kind, place):
    with pytest.raises(kind, match=place):
        plain(bad)


@dataclass(frozen=True)
class Part:
    name: Literal["a", "b"]
    value: float


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    pair: tuple[int, float]
    matrix: Array
    response: ComplexArray
    by_name: Mapping[str, Part]
    empty: float | None = None
    unstable: float | None = field(default=None, metadata=NULL)
    several: float | tuple[float | None, ...] | None = None
    rest: Mapping[str, object] = others()


PLAIN = {
    "parts": [{"name": "a", "value": 1.0}],
    "pair": [3, 0.5],
    "matrix": [[1.0, 2.0], [3.0, 4.0]],
    "response": [{"re": 1.0, "im": -2.0}],
    "by_name": {"x": {"name": "b", "value": 2.0}},
    "unstable": None,
    "several": [1.0, None],
    "unknown_key": {"kept": [1, "2"]},
}


def test_plain_data_come_back_as_they_were_with_the_types_of_their_fields():
    whole = read_plain(Whole, PLAIN)
    assert plain(whole) == PLAIN
    assert whole.parts == (Part("a", 1.0),)
    assert whole.response[0] == 1.0 - 2.0j
    assert whole.matrix.shape == (2, 2)
    assert whole.empty is None
    assert whole.rest == {"unknown_key": {"kept": [1, "2"]}}
    assert type(read_plain(Part, {"name": "a", "value": np.float64(2.0)}).value) is float


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("parts", [{"name": "c", "value": 1.0}]),
        ("parts", [{"name": "a"}]),
        ("parts", {"name": "a"}),
        ("pair", [1]),
        ("pair", [True, 1.0]),
        ("matrix", [["x"]]),
        ("by_name", [1]),
        ("several", "text"),
    ],
)
def test_data_of_another_form_raise_an_error_that_names_the_key(key, value):
    with pytest.raises(OutcomeError, match=f'"{key}'):
        read_plain(Whole, {**PLAIN, key: value})


@pytest.mark.slow
@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from(list(PLAIN)), st.recursive(st.none() | st.floats() | st.text(), st.lists))
)
def test_reading_arbitrary_data_raises_no_other_error(changes):
    with suppress(OutcomeError):
        read_plain(Whole, {**PLAIN, **changes})


def sections(kind, seen):
    """Every dataclass that a result is made of."""
    for hint in get_type_hints(kind).values():
        todo = [hint]
        while todo:
            one = todo.pop()
            todo += get_args(one)
            if is_dataclass(one) and one not in seen:
                seen.add(one)
                sections(one, seen)
    return seen


def test_a_section_has_one_field_at_most_for_keys_of_other_names():
    for section in sections(Outcome, {Outcome}):
        assert sum("others" in entry.metadata for entry in fields(section)) <= 1, section


def test_json_keeps_the_order_of_keys_and_letters_of_all_scripts():
    assert json_text({"z": np.bool_(True), "a": "µ"}) == '{\n "z": true,\n "a": "µ"\n}\n'


def same(one, other):
    """Return whether two values have one type, and are equal to the digits that a figure shows."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
        )
    if isinstance(one, np.ndarray):
        alike = np.iscomplexobj(one) == np.iscomplexobj(other) and one.shape == other.shape
        return alike and np.allclose(one, other, rtol=2e-7, atol=0.0, equal_nan=True)
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


def test_curves_of_figures_are_read_back_as_they_were_written(tmp_path):
    (tmp_path / FIGURES).write_bytes(curves_json(CURVES))
    found = read_curves(tmp_path)
    assert list(found) == list(CURVES)
    assert [name for name, made in CURVES.items() if not same(made, found[name])] == []
    assert read_curves(tmp_path / "of an older version") == {}


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b'{"a": 1}', b'{"a": {}}', b'{"a": {"kind": "Path"}}', b'{"a": {"kind": "RunCurves"}}',
     b'{"a": {"kind": "ErrorCurves", "energy": "x"}}', b'{"a": {"kind": "BoundCurves", "panels": [3]}}'],
)  # fmt: skip
def test_a_broken_file_of_curves_is_refused_by_its_name(content, tmp_path):
    (tmp_path / FIGURES).write_bytes(content)
    (told,) = refused(read_curves, tmp_path, kind=DataError)
    assert (told.code, "figures.json" in told.message) == ("run-unreadable", True)
