"""The same numbers come out of every kind of file; what cannot be read is said with its line."""

import io

import numpy as np
import pytest
import scipy.io

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import read_sheet
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
    assert read_sheet(path, key="").sample_time == 0.5


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
