"""Numbers in text are read as what they say, or refused: digits of other scripts, marks between thousands."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.questions.building.tables import columns_of, read_columns

SCRIPTS = ["\u0660", "\u06f0", "\u0966", "\uff10", "\U0001d7ce"]  # zeros; their digits follow them


def of_script(zero):
    return str.maketrans({str(n): chr(ord(zero) + n) for n in range(10)})


WRITERS = {
    "plain": lambda x: f"{x:.2f}",
    "thousands, point": lambda x: f"{x:,.2f}",
    "whole thousands": lambda x: f"{x:,.0f}",
    "apostrophes": lambda x: f"{x:,.2f}".replace(",", "'"),
    "blanks": lambda x: f"{x:,.2f}".replace(",", "\u202f").replace(".", ","),
    "points, comma": lambda x: f"{x:,.2f}".translate(str.maketrans(",.", ".,")),
    "whole points": lambda x: f"{x:,.0f}".replace(",", "."),
    "underscores": lambda x: f"{x:_.2f}",
    "minus": lambda x: f"{x:.2f}".replace("-", "\u2212"),
    **{
        f"script {n}": lambda x, zero=zero: f"{x:.2f}".translate(of_script(zero))
        for n, zero in enumerate(SCRIPTS)
    },
}


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    large=st.lists(st.integers(1000, 9_999_999), min_size=1, max_size=5),
    small=st.lists(st.integers(-999, -100), min_size=1, max_size=5),
    kind=st.sampled_from(sorted(WRITERS)),
    mark=st.sampled_from([",", ";", "\t", "|"]),
    quoted=st.booleans(),
    only=st.booleans(),
)
def test_a_number_is_what_it_says_or_refused(tmp_path, large, small, kind, mark, quoted, only):
    """Thousands beside hundreds; in the second column too, or plain numbers there."""
    values = np.array([*large, *small], dtype=float)
    cells = [WRITERS[kind](x) for x in values]
    quote = '"' if quoted else ""
    rows = [f"{quote}{cell}{quote}{mark}{7 if only else cell}" for cell in cells]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([f"u{mark}y", *rows]) + "\n", encoding="utf-8")
    try:
        found = read_columns(path, {"u": "u"}, key="")["u"]
    except DataError:
        found = None
    if found is None:
        assert kind != "plain"
    else:
        np.testing.assert_array_equal(found, values)


@pytest.mark.parametrize("cell", ["1_0", "\u0661", "\uff11.5", "1,250.5", "1\u202f250", "3\u22121"])
def test_the_hint_says_how_to_write_it(cell, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f'u,y\n0.5,1\n"{cell}",2\n', encoding="utf-8")
    with pytest.raises(DataError, match="is not a finite number") as caught:
        read_columns(path, {"u": "u"}, key="")
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.location.line == 3
    assert "digits 0 to 9" in diagnostic.hint


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_the_minus_of_unicode_is_one(mark, tmp_path):
    path = tmp_path / "log.txt"
    rows = [["u\u22121", "y"], ["\u22121.5", "2"], ["3", "\u2212.5e\u22123"], ["\u22124E2", "0"]]
    path.write_text("\n".join(mark.join(row) for row in rows), encoding="utf-8")
    sheet = read_sheet(path, key="")
    assert sheet.names[0] == "u\u22121"
    np.testing.assert_array_equal(sheet.columns[0].numbers, [-1.5, 3.0, -400.0])
    np.testing.assert_array_equal(sheet.columns[1].numbers, [2.0, -5e-4, 0.0])


@pytest.mark.parametrize(
    "cells", [("0.125", "100", "7"), ("1.125", "0", "-1.125"), ("1.250", "100.5", "3"), ("100", "2", "3")]
)
def test_decimals_stay_decimals(cells, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("u;y\n" + "".join(f"{cell};1\n" for cell in cells))
    np.testing.assert_array_equal(
        read_columns(path, {"u": "u"}, key="")["u"], [float(cell) for cell in cells]
    )


def test_a_point_that_may_stand_between_thousands_is_asked_about(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("u;y\n808;1\n1.250;2\n")
    with pytest.raises(DataError, match=r"'1\.250' in column u may have a mark between thousands") as caught:
        read_columns(path, {"u": "u"}, key="")
    assert caught.value.diagnostics[0].location.line == 3


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_lone_comma_among_decimal_points_is_told_as_such(separator, tmp_path):
    """It may be a decimal mark or stand between thousands: nobody guesses."""
    path = tmp_path / "log.csv"
    rows = [[f"{k}.0", f"{k % 5}.25"] for k in range(60)]
    rows[40][1] = '"13,899"'
    path.write_text("\n".join(separator.join(row) for row in [["time", "u"], *rows]))
    with pytest.raises(DataError, match="has a comma, and other cells have decimal points") as caught:
        read_columns(path, {"u": "u"}, key="")
    (one,) = caught.value.diagnostics
    assert one.location.line == 42
    assert "13.899" in one.hint


NUMBERS = [0.5, -1.25, 12.0, 1234.5, -0.036]


@pytest.mark.parametrize("time", ["{k}", "{k}.5", "2024-03-12 10:15:0{k}"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_decimal_commas_in_quotes_are_read_whatever_separates(separator, time, tmp_path):
    path = tmp_path / "log.csv"
    cells = [time.format(k=k).replace(".", ",") for k in range(5)]
    rows = [f'"{t}"{separator}"{x}"'.replace(".", ",") for t, x in zip(cells, NUMBERS, strict=True)]
    path.write_text("\n".join([f"time{separator}u", *rows]))
    np.testing.assert_array_equal(read_columns(path, {"u": "u"}, key="")["u"], NUMBERS)


@pytest.mark.parametrize("cells", [("1,234", "2,500"), ("1,234", "7"), ("-12,345", "999,000")])
def test_commas_in_quotes_that_may_stand_between_thousands_are_asked_about(cells, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("n,u\n" + "".join(f'{k},"{cell}"\n' for k, cell in enumerate(cells)))
    with pytest.raises(DataError, match="may be a decimal mark or stand between thousands") as caught:
        read_columns(path, {"u": "u"}, key="")
    first = cells[0]
    assert (
        f"write {first.replace(',', '.')}, else {first.replace(',', '')}:" in caught.value.diagnostics[0].hint
    )


def written_in(form, separator, path):
    """A table of NUMBERS and their negatives, each cell in a form; its columns as they are read."""
    rows = [separator.join(map(form, (x, -x))) for x in NUMBERS]
    path.write_text("\n".join([separator.join(("u", "y")), *rows]))
    return columns_of(read_sheet(path, key=""), {"u": "u", "y": "y"})


FORTRAN = {
    "D+": lambda x: f"{x:.6E}".replace("E", "D"),
    "d": lambda x: f"{x:.6e}".replace("e", "d"),
    "no plus": lambda x: f"{x:.6e}".replace("e+", "D"),
}


@pytest.mark.parametrize("separator", [",", ";", "\t", "  "])
@pytest.mark.parametrize("form", FORTRAN.values(), ids=FORTRAN)
def test_exponents_of_fortran_are_exponents(form, separator, tmp_path):
    found = written_in(form, separator, tmp_path / "log.csv")
    np.testing.assert_array_equal(found["u"], NUMBERS)
    np.testing.assert_array_equal(found["y"], np.negative(NUMBERS))


def test_exponents_of_fortran_behind_decimal_commas(tmp_path):
    found = written_in(lambda x: f"{x:.6E}".replace("E", "D").replace(".", ","), ";", tmp_path / "log.csv")
    np.testing.assert_array_equal(found["u"], NUMBERS)


@pytest.mark.parametrize("mark", ["%", " %"])
@pytest.mark.parametrize(("separator", "point"), [(",", "."), (";", "."), (";", ","), ("\t", ",")])
def test_numbers_in_per_cent_stay_as_they_are_written(separator, point, mark, tmp_path):
    found = written_in(lambda x: f"{x}{mark}".replace(".", point), separator, tmp_path / "log.csv")
    np.testing.assert_array_equal(found["u"], NUMBERS)


def test_a_column_of_which_some_numbers_are_in_per_cent_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("n,u\n0,1.0%\n1,2.0\n2,\n")
    with pytest.raises(DataError, match=r"'1\.0%' in column u has a unit beside its number") as caught:
        read_columns(path, {"u": "u"}, key="")
    assert "write 1.0 alone" in caught.value.diagnostics[0].hint


@pytest.mark.parametrize("separator", [";", ",", "\t", "|"])
@pytest.mark.parametrize("unit", ["V", "degC", "\u00b0C", "m/s", "mbar"])
def test_units_beside_numbers_belong_into_the_header(unit, separator, tmp_path):
    path = tmp_path / "log.csv"
    with pytest.raises(DataError) as caught:
        written_in(lambda x: f"{x} {unit}", separator, path)
    (told,) = caught.value.diagnostics
    assert (told.code, told.location.line) == ("data-not-a-number", 2)
    assert told.message == "'0.5 " + f"{unit}' in column u has a unit beside its number"
    assert f"write 0.5 alone, and the unit into the header, as in 'name ({unit})'" in told.hint


@pytest.mark.parametrize("cell", ["1.0X", "1.0e", "3.5abc", "7.25kohm?"])
def test_what_only_begins_like_a_number_is_no_date(cell, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"n,u\n0,{cell}\n1,2\n")
    with pytest.raises(DataError, match="is not a finite number"):
        read_columns(path, {"u": "u"}, key="")


def test_a_column_of_words_gets_a_hint_about_words(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("n,u\n0,1\n1,Bad\n2,3\n")
    with pytest.raises(DataError, match="'Bad' in column u") as caught:
        read_columns(path, {"u": "u"}, key="")
    hint = caught.value.diagnostics[0].hint
    assert "leave a cell empty where there is no value, and write 1 and 0 for ON and OFF" in hint
