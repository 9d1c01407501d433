"""The columns of .mat, .npz, parquet and Excel files; what holds none is told."""

import io

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import isolated, read_sheet
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.questions.building.tables import columns_of, read_columns
from tests.support.logs import ROWS, TIME, U, Y, iddata, save


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


def test_an_object_beside_other_arrays_is_told_with_the_lines_that_convert_it(monkeypatch, tmp_path):
    """SciPy writes no such objects: what its reader tells of one."""
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0 MAT-file")
    monkeypatch.setattr(isolated, "arrays_of", lambda raw, named: isolated.Arrays({"v": U}, opaque=True))
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
    save(path, u=WRONG[what], y=Y)
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


WORKBOOKS = {
    "names": [["time", "u", "y"], *ROWS],
    "no names": ROWS,
    "a row of units": [["time", "u", "y"], ["s", "V", "degC"], *ROWS],
    "a preamble": [["Logger X1", None, None], ["Serial", 42, None], [None] * 3, ["time", "u", "y"], *ROWS],
    "a preamble, names and units": [["Logger X1", None, None], ["time", "u", "y"], ["s", "V", "degC"], *ROWS],
}


@pytest.mark.parametrize("rows", WORKBOOKS.values(), ids=WORKBOOKS)
def test_the_table_of_a_workbook_is_found_as_in_text(rows, tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    path = tmp_path / "log.xlsx"
    pandas.DataFrame(rows).to_excel(path, index=False, header=False)
    sheet = read_sheet(path, key="")
    wanted = {name: name if sheet.names else str(k + 1) for k, name in enumerate(("time", "u", "y"))}
    for name, numbers in columns_of(sheet, wanted).items():
        np.testing.assert_array_equal(numbers, {"time": TIME, "u": U, "y": Y}[name])
    begins = len(rows) - len(ROWS) + 1
    assert sheet.lines.tolist() == list(range(begins, begins + len(ROWS)))


def test_a_cell_of_a_workbook_that_is_no_number_is_told_with_its_row(tmp_path):
    """1.125 beside 808 has three decimals, and no mark between thousands: cells of a workbook are typed."""
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    path = tmp_path / "log.xlsx"
    cells = {"u": [1.125, 808, "n/a", None], "y": [1.0, 2.0, "broken", 4.0]}
    pandas.DataFrame(cells).to_excel(path, index=False)
    sheet = read_sheet(path, key="")
    np.testing.assert_array_equal(columns_of(sheet, {"u": "u"})["u"], [1.125, 808.0, np.nan, np.nan])
    with pytest.raises(DataError, match="'broken' in column y is not a finite number") as caught:
        columns_of(sheet, {"y": "y"})
    assert caught.value.diagnostics[0].location.line == 4


def test_a_sparse_column_is_what_it_says(tmp_path):
    path = tmp_path / "log.mat"
    u = np.array([0.0, 3.0, 0.0, -1.5])
    for kept in (u[:, None], np.column_stack([u, 2 * u])):
        scipy.io.savemat(path, {"u": scipy.sparse.csc_matrix(kept), "y": Y})
        name = "u" if kept.shape[1] == 1 else "u1"
        np.testing.assert_array_equal(read_columns(path, {"u": name}, key="")["u"], u)


def test_a_sparse_matrix_that_is_too_large_is_told_as_such(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"u": scipy.sparse.csc_matrix(([1.0], ([0], [0])), shape=(10**6, 100)), "y": Y})
    with pytest.raises(DataError, match=r"u in log\.mat holds a sparse matrix too large") as caught:
        read_columns(path, {"u": "u"}, key="")
    assert "full(u)" in caught.value.diagnostics[0].message


def test_a_sparse_matrix_of_scipy_has_no_name(tmp_path):
    path = tmp_path / "log.npz"
    scipy.sparse.save_npz(path, scipy.sparse.csc_matrix(U[:, None]))
    with pytest.raises(DataError, match="holds a sparse matrix") as caught:
        read_sheet(path, key="")
    assert "u=A.toarray()" in caught.value.diagnostics[0].hint


@pytest.mark.parametrize("columns", [("y",), ("u", "y"), ("time", "u", "y")])
def test_formulas_without_values_are_told_as_such(columns, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    path = tmp_path / "log.xlsx"
    book = openpyxl.Workbook()
    book.active.append(["time", "u", "y"])
    for k, row in enumerate(ROWS):
        book.active.append(
            [
                f"=A{k + 9}*2" if name in columns else x
                for name, x in zip(("time", "u", "y"), row, strict=True)
            ]
        )
    book.save(path)
    with pytest.raises(DataError, match="is a formula, of which the file holds no value") as caught:
        columns_of(read_sheet(path, key=""), {"y": "y"})
    (told,) = caught.value.diagnostics
    assert told.location.line == 2
    assert "open the file in a spreadsheet program and save it" in told.hint


STRUCT = {"u": U, "y": Y, "Ts": 0.5}


def _log(path, preparation=None):
    return read_log(path, preparation or Preparation())


def test_one_of_two_structs_with_signals_of_one_name_is_to_be_named(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"ze": STRUCT, "zv": {"InputData": 2.0 * U, "OutputData": Y, "Ts": 0.25}})
    with pytest.raises(DataError, match="holds ze and zv, each with a u of its own") as caught:
        _log(path)
    assert "'log.mat#ze', or 'log.mat#zv'" in caught.value.diagnostics[0].hint
    first, second = (_log(path.with_name(f"log.mat#{name}")) for name in ("ze", "zv"))
    np.testing.assert_array_equal(second.u, 2.0 * first.u)
    np.testing.assert_array_equal(first.u[:, 0], np.ravel(U))
    assert (first.step, second.step) == (0.5, 0.25)


def test_a_variable_that_is_not_there_is_told_with_those_that_are(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"ze": STRUCT, "zv": STRUCT})
    with pytest.raises(DataError, match="no such variable") as caught:
        _log(path.with_name("log.mat#data"))
    assert caught.value.diagnostics[0].hint == "it holds ze, zv"


@pytest.mark.parametrize("other", [{"s": STRUCT, "u": 3.0 * U}, {"s": STRUCT, "Ts": 0.25}])
def test_a_struct_and_an_array_of_its_own_are_not_mixed(other, tmp_path):
    scipy.io.savemat(tmp_path / "log.mat", other)
    with pytest.raises(DataError, match="of its own"):
        _log(tmp_path / "log.mat")


def test_what_structs_have_in_common_is_no_matter(tmp_path):
    scipy.io.savemat(tmp_path / "log.mat", {"ze": STRUCT, "Ts": 0.5, "info": {"Ts": 0.5, "by": "me"}})
    assert _log(tmp_path / "log.mat").step == 0.5


def test_structured_arrays_are_named_as_structs_are(tmp_path):
    pairs = np.zeros(len(np.ravel(U)), dtype=[("u", float), ("y", float)])
    pairs["u"], pairs["y"] = np.ravel(U), np.ravel(Y)
    twice = pairs.copy()
    twice["u"] *= 2.0
    np.savez(tmp_path / "log.npz", a=pairs, b=twice)
    with pytest.raises(DataError, match="holds a and b, each with a u"):
        _log(tmp_path / "log.npz")
    np.testing.assert_array_equal(_log(tmp_path / "log.npz#b").u[:, 0], 2.0 * np.ravel(U))


def test_a_single_array_is_read_by_numbers_of_its_columns(tmp_path):
    path = tmp_path / "log.npy"
    np.save(path, np.column_stack([0.5 * np.arange(np.size(U)), np.ravel(U), np.ravel(Y)]))
    found = _log(path, Preparation(columns={"time": "1", "u1": "2", "y1": "3"}))
    assert found.step == 0.5
    np.testing.assert_array_equal(found.u[:, 0], np.ravel(U))
    with pytest.raises(DataError) as caught:
        _log(path)
    assert '--columns "time=1,u1=2,y1=3"' in caught.value.diagnostics[0].hint


@pytest.mark.parametrize("array", [np.array(["a", "b"]), np.array([None, 1]), np.array(1.0), np.zeros(0)])
def test_a_single_array_of_no_columns_names_the_kind_of_file_to_write(array, tmp_path):
    np.save(tmp_path / "log.npy", array)
    with pytest.raises(DataError, match=r"log\.npy") as caught:
        _log(tmp_path / "log.npy")
    assert "numpy.savez" in caught.value.diagnostics[0].hint


def test_an_array_under_another_ending_is_told(tmp_path):
    np.save(tmp_path / "log.npy", np.zeros((9, 3)))
    (tmp_path / "log.npy").rename(tmp_path / "log.csv")
    with pytest.raises(DataError, match="an array of NumPy"):
        _log(tmp_path / "log.csv")


def test_columns_of_parquet_that_have_one_name_are_told(tmp_path):
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    table = arrow.table([np.ravel(U), np.ravel(U), np.ravel(Y)], names=["u", "u", "y"])
    parquet.write_table(table, tmp_path / "log.parquet")
    with pytest.raises(DataError, match="several columns of one name: u"):
        _log(tmp_path / "log.parquet")
