"""A table is read as it was written, in every format, encoding, separator, decimal mark and form of date."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pandas
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.errors import DataError
from inputdesign_cli.records import Preparation, read_log, read_sheet
from tests.support.refusals import refused

N = 30
RNG = np.random.default_rng(1)
U, Y = RNG.standard_normal(N).round(6), (1e3 * RNG.standard_normal(N)).round(6)
BEGAN = datetime(2024, 3, 12, 23, 59, 50)
TIMES = [BEGAN + timedelta(seconds=2.5 * k) for k in range(N)]
COLUMNS = {"u1": "valve", "y1": "level", "time": "Zeit"}

DATES = {
    "iso": lambda t: t.isoformat(timespec="milliseconds"),
    "iso with blank": lambda t: t.isoformat(" ", "milliseconds"),
    "zone": lambda t: t.replace(tzinfo=UTC).isoformat(timespec="milliseconds"),
    "german": lambda t: f"{t:%d.%m.%Y %H:%M:%S},{t.microsecond // 1000:03d}",
    "short german": lambda t: f"{t:%d.%m.%y %H:%M:%S}.{t.microsecond // 1000}",
    "fractions left out": lambda t: (
        f"{t:%d.%m.%Y %H:%M:%S}" + (f".{t.microsecond // 1000}" * bool(t.microsecond))
    ),
    "american": lambda t: f"{t:%m/%d/%Y %H:%M:%S}.{t.microsecond // 1000}",
    "month in letters": lambda t: f"{t:%d-%b-%Y %H:%M:%S}.{t.microsecond // 1000}",
    "time of day": lambda t: f"{t:%H:%M:%S}.{t.microsecond // 1000}",
    "seconds": lambda t: repr((t - BEGAN).total_seconds()),
}
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "cp1252", "latin-1"]


def text(mark, decimal, moment, names=("Zeit", "valve °C", "level %")):
    rows = [[moment(t), repr(float(u)), repr(float(y))] for t, u, y in zip(TIMES, U, Y, strict=True)]
    quoted = {",": '"{}"'}.get(mark if decimal == "," else "", "{}")
    numbers = [[row[0], *(quoted.format(cell.replace(".", decimal)) for cell in row[1:])] for row in rows]
    if mark == ",":
        numbers = [[f'"{row[0]}"', *row[1:]] for row in numbers]
    return "\n".join(mark.join(row) for row in [names, *numbers]) + "\n"


def check(path, prepared=None):
    """The signals are bit by bit those that were written, at times 2.5 s apart."""
    record = read_log(path, prepared or Preparation(columns=COLUMNS))
    np.testing.assert_array_equal(record.u[:, 0], U)
    np.testing.assert_array_equal(record.y[:, 0], Y)
    np.testing.assert_allclose(np.diff(record.time), 2.5, atol=1e-6)
    assert (record.step, record.time_unit, record.lengths) == (2.5, "s", (N,))


@pytest.mark.first(27)
@pytest.mark.parametrize("mark", [",", ";", "\t", "|"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("moment", DATES.values(), ids=DATES)
def test_text_is_read_in_every_separator_decimal_mark_and_form_of_date(mark, decimal, moment, tmp_path):
    if moment is DATES["seconds"]:
        plain = moment
        moment = lambda t: plain(t).replace(".", decimal)  # noqa: E731
    (tmp_path / "log.csv").write_text(text(mark, decimal, moment), encoding="utf-8")
    check(tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("encoding", "names"),
    [*((one, ("valve °C", "level %")) for one in ENCODINGS), ("cp932", ("入力バルブ開度", "出力レベル"))],
)
def test_text_is_read_in_every_encoding(encoding, names, tmp_path):
    """Letters of other scripts are read, too."""
    path = tmp_path / "log.csv"
    path.write_bytes(text(";", ",", DATES["german"], ("Zeit", *names)).encode(encoding))
    assert read_sheet(path).names == ("Zeit", *names)
    check(path, Preparation(columns={"u1": "2", "y1": "3"}))


def test_blanks_separate_columns_of_numbers(tmp_path):
    rows = "\n".join(
        f"{2.5 * k!r}   {u!r} {y!r}" for k, (u, y) in enumerate(zip(U.tolist(), Y.tolist(), strict=True))
    )
    (tmp_path / "log.dat").write_text(f"# Zeit valve level\n{rows}\n")
    check(tmp_path / "log.dat", Preparation(columns={"time": "1", "u1": "2", "y1": "3"}))


@pytest.mark.parametrize(
    "layout", ["preamble", "units", "comments", "no header", "short rows", "trailing separator", "quotes"]
)
def test_text_is_read_in_every_layout(layout, tmp_path):
    lines = text(";", ".", DATES["iso"]).splitlines()
    columns = COLUMNS
    if layout == "preamble":
        lines = ["Logger 7;serial 42", "exported by hand", "", *lines]
    elif layout == "units":
        lines = ["Zeit;valve;level", ";%;degC", *lines[1:]]
    elif layout == "comments":
        lines = ["# a comment", *lines[:9], "# another", *lines[9:], "// the end"]
    elif layout == "no header":
        lines, columns = lines[1:], {"time": "1", "u1": "2", "y1": "3"}
    elif layout == "short rows":
        lines = [lines[0], "2000-01-01 00:00:00;1", *lines[1:]]
    elif layout == "trailing separator":
        lines = [lines[0], *(f"{line};" for line in lines[1:])]
    else:
        lines = [";".join(f'"{cell}"' for cell in line.split(";")) for line in lines]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    check(path, Preparation(columns=columns))
    if layout == "units":
        assert read_sheet(path).names == ("Zeit", "valve (%)", "level (degC)")


@pytest.mark.parametrize("kind", ["npz", "mat", "parquet", "parquet index", "xlsx", "iddata", "struct"])
def test_every_kind_of_file_is_read(kind, tmp_path):
    path = tmp_path / f"log.{ {'iddata': 'mat', 'struct': 'mat'}.get(kind, kind.split()[0]) }"
    arrays = {"Zeit": 2.5 * np.arange(N), "valve": U, "level": Y[:, None]}
    frame = pandas.DataFrame({"Zeit": TIMES, "valve": U, "level": Y})
    columns = COLUMNS
    if kind == "npz":
        np.savez(path, **arrays)
    elif kind == "mat":
        scipy.io.savemat(path, arrays)
    elif kind == "struct":
        scipy.io.savemat(path, {"s": arrays})
    elif kind == "iddata":
        fields = {"InputData": U, "OutputData": Y, "Ts": 2.5, "TimeUnit": "seconds", "InputName": "valve"}
        scipy.io.savemat(path, {"data": fields})
        columns = {}
    elif kind == "parquet":
        frame.to_parquet(path)
    elif kind == "parquet index":
        frame.set_index("Zeit").tz_localize("Europe/Berlin").to_parquet(path)
    else:
        with pandas.ExcelWriter(path) as book:
            frame.to_excel(book, sheet_name="Log", index=False)
            pandas.DataFrame({"a": [1]}).to_excel(book, sheet_name="Notes")
        check(tmp_path / "log.xlsx#Log")
    check(path, Preparation(columns=columns))


@pytest.mark.parametrize(
    ("form", "columns"),
    [
        ("%Y%m%d%H%M%S.%f", COLUMNS),
        ("%Y%m%d%H%M%S.%f", {"u1": "2", "y1": "3"}),
        ("%d/%m/%Y %H-%M-%S.%f", COLUMNS),
    ],
)
def test_times_are_read_in_a_form_that_the_user_states(form, columns, tmp_path):
    (tmp_path / "log.csv").write_text(text(";", ".", lambda t: t.strftime(form)))
    check(tmp_path / "log.csv", Preparation(columns=columns, time_format=form))


@pytest.mark.parametrize(("mark", "said"), [("^", "^"), ("\t", "tab"), (" ", "blank")])
def test_a_separator_that_the_user_states_is_used(mark, said, tmp_path):
    (tmp_path / "log.csv").write_text(text(mark, ".", DATES["seconds"], ("Zeit", "valve", "level")))
    check(tmp_path / "log.csv", Preparation(columns=COLUMNS, separator=said))


def test_columns_of_dates_and_times_of_day_are_joined(tmp_path):
    moment = lambda t: f"{t:%d.%m.%Y};{t:%H:%M:%S}.{t.microsecond // 1000}"  # noqa: E731
    names = ("Datum;Uhrzeit", "valve", "level")
    (tmp_path / "log.csv").write_text(text(";", ".", moment, names))
    check(tmp_path / "log.csv", Preparation(columns={"u1": "valve", "y1": "level"}))
    lines = (tmp_path / "log.csv").read_text().splitlines()
    lines[16] = f"-;{lines[16].partition(';')[2]}"  # a date is missing
    (tmp_path / "log.csv").write_text("\n".join(lines))
    assert read_log(tmp_path / "log.csv", Preparation(columns=COLUMNS | {"time": "Datum"})).lengths == (
        15,
        14,
    )


@pytest.mark.parametrize(("unit", "scale"), [("ms", 1e3), ("us", 1e6)])
def test_milliseconds_since_1970_need_a_stated_unit_and_seconds_do_not(unit, scale, tmp_path):
    np.savez(tmp_path / "log.npz", time=[round(scale * t.timestamp()) for t in TIMES], u=U, y=Y)
    (found,) = refused(read_log, tmp_path / "log.npz", Preparation(), kind=DataError)
    assert (found.code, "--time-unit ms" in found.hint) == ("data-not-a-number", True)
    assert read_log(tmp_path / "log.npz", Preparation(time_unit=unit)).step == pytest.approx(2.5 * scale)
    np.savez(tmp_path / "log.npz", time=[t.timestamp() for t in TIMES], u=U, y=Y)
    check(tmp_path / "log.npz", Preparation())


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.lists(st.floats(-1e17, 1e17, allow_subnormal=False), min_size=2, max_size=20),
    mark=st.sampled_from(";\t|"),
    decimal=st.sampled_from(".,"),
    form=st.sampled_from(["r", ".17e"]),
)
def test_numbers_are_read_exactly(values, mark, decimal, form, tmp_path):
    """The decimal mark is stated, and every finite number keeps its value."""
    cells = [repr(x) if form == "r" else f"{x:{form}}" for x in values]
    body = "\n".join(f"{cell.replace('.', decimal)}{mark}1" for cell in cells)
    (tmp_path / "log.csv").write_text(f"u{mark}y\n{body}\n")
    prepared = Preparation(separator={"\t": "tab"}.get(mark, mark), decimal=decimal)
    found = read_sheet(tmp_path / "log.csv", preparation=prepared)
    np.testing.assert_array_equal(found.columns[0].numbers, values)
