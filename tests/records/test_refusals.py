"""Files that cannot be read with certainty are refused with a code, a line and an option that helps."""

import contextlib
import gzip
import io
import os
import socket
import time
import zipfile
from datetime import datetime, timedelta

import numpy as np
import pandas
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.errors import DataError, IdesignError
from inputdesign_cli.questions.building.tables import read_columns, read_samples
from inputdesign_cli.records import Preparation, read_log, read_logs, read_sheet
from tests.support.refusals import refused

U, Y = np.arange(20.0) % 7, np.arange(20.0) % 5


def refused_log(path, prepared=None):
    return refused(read_log, path, prepared or Preparation(), kind=DataError)[0]


def log(path, stamps, names="time,u,y"):
    rows = [f"{stamp},{u},{y}" for stamp, u, y in zip(stamps, U, Y, strict=False)]
    path.write_text("\n".join([names, *rows]))
    return path


BEGAN = datetime(2024, 3, 4, 10, 58)
MOMENTS = [BEGAN + timedelta(seconds=30 * k) for k in range(20)]


@pytest.mark.parametrize(
    ("text", "code", "line", "option"),
    [
        ("u;y\n1.5;2\n3,5;4\n", "data-not-a-number", 3, "--decimal"),
        ("u;y\n808;1\n1,250;2\n", "data-not-a-number", 3, "--decimal"),
        ("u;y\n808;1\n1.250;2\n", "data-not-a-number", 3, "--decimal"),
        ('u,y\n"1,234",2\n"5,678",4\n', "data-not-a-number", 2, "--decimal"),
        ("u;y\n1.234,5;2\n2,5;4\n", "data-not-a-number", 2, "decimal point"),
        ("u,y\n1,5,2\n2,5,4\n", "data-extra-field", 2, "--sep"),
        ("u,y\n1,2\nabc,4\n", "data-not-a-number", 3, "plain numbers"),
        ("u,y\n1,2\n1e999,4\n", "data-not-a-number", 3, "plain numbers"),
        ("u,y\n1,2\n3 V,4\n", "data-not-a-number", 3, "plain numbers"),
        ('u,y\n1,2\n3,"4\n5,6\n', "data-unreadable", 3, "close it"),
        ("u,y\n1,2\n" + ",".join("1" * 16_385), "data-extra-field", 3, "--sep"),
        (",".join("1" * 16_385), "data-unreadable", None, "one sample a line"),
        ("u,y\n1,2\n3,\x004\n", "data-unreadable", 3, "take the line out"),
        ("u,y\n", "data-unreadable", None, "rows below it"),
        ("v,u,y\n1,2\n3,4\n", "data-not-a-number", 2, "another column"),
        ("a,b\n3,2\n1,4\n2,3\n", "data-missing-column", 1, '--columns "u1=1,y1=2"'),
        ("u,y,time\n1,2,0\n3,4,0\n5,6,1\n", "data-not-uniform", 3, "--sample-time"),
        ("u,y,time\n1,2,0\n3,4,1\n5,6,9\n", "data-not-uniform", 2, "--sample-time"),
        ("u,y,time\n1,2,0\n", "too-few-samples", 2, "more samples"),
    ],
)
def test_unclear_text_is_refused_with_a_code_a_line_and_an_option(text, code, line, option, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text)
    found = refused_log(path)
    assert (found.code, found.location and found.location.line) == (code, line)
    assert option in found.hint


@pytest.mark.parametrize("form", ["%Y%m%d", "%Y%m%d%H%M", "%Y%m%d%H%M%S"])
@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_dates_in_digits_are_refused_until_their_form_is_stated(form, kind, tmp_path):
    step = {"%Y%m%d": timedelta(days=1), "%Y%m%d%H%M": timedelta(minutes=1)}.get(form, timedelta(seconds=30))
    stamps = [int((BEGAN + k * step).strftime(form)) for k in range(20)]
    path = tmp_path / f"log.{kind}"
    if kind == "csv":
        log(path, stamps)
    else:
        np.savez(path, time=stamps, u=U, y=Y)
    found = refused_log(path)
    assert found.code == "data-not-a-number"
    assert "--time-format" in found.hint
    np.testing.assert_allclose(
        np.diff(read_log(path, Preparation(time_format=form)).time), step.total_seconds()
    )


def test_dates_of_unclear_order_are_refused_until_their_form_is_stated(tmp_path):
    path = log(
        tmp_path / "log.csv",
        [f"{t:%d/%m/%Y %H:%M:%S}" for t in (BEGAN + timedelta(days=k) for k in range(5))],
    )
    found = refused_log(path)
    assert (found.code, found.location.line) == ("data-not-a-number", 2)
    assert "--time-format" in found.hint
    read = read_log(path, Preparation(time_format="%d/%m/%Y %H:%M:%S"))
    np.testing.assert_allclose(np.diff(read.time), 86_400.0)


@pytest.mark.parametrize("wrong", ["yesterday", "2024-13-01 00:00:00", "12.03.2024 10:15:00"])
def test_a_cell_among_dates_that_is_no_date_is_refused_with_its_line(wrong, tmp_path):
    stamps = [t.isoformat(" ") for t in MOMENTS]
    stamps[7] = wrong
    found = refused_log(log(tmp_path / "log.csv", stamps))
    assert (found.code, found.location.line) == ("data-not-a-number", 9)
    assert "--time-format" in found.hint


def test_a_stated_form_or_decimal_mark_that_does_not_fit_is_refused(tmp_path):
    path = log(tmp_path / "log.csv", [t.isoformat(" ") for t in MOMENTS])
    assert "--time-format" in refused_log(path, Preparation(time_format="%d.%m.%Y")).hint
    path.write_text("u;y\n1.234;1,5\n2;2,5\n")
    assert refused_log(path, Preparation(decimal=",")).code == "data-not-a-number"


def archive(name, content):
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, content)
    return held.getvalue()


TEXT = b"time,u,y\n0,1,2\n1,2,3\n"


@pytest.mark.parametrize(
    ("name", "raw"),
    [
        ("log.csv", gzip.compress(TEXT)),
        ("log.csv", archive("log.csv", TEXT)),
        ("log.csv", archive("xl/workbook.xml", b"")),
        ("log.csv", b"PK\x03\x04\x00\x00\xff"),
        ("log.csv", b"\xd0\xcf\x11\xe0\xff"),
        ("log.csv", b"\x93NUMPY\x01"),
        ("log.csv", np.random.default_rng(1).bytes(5000)),
        ("log.csv", b""),
        ("log.mat", b"not at all"),
        ("log.npz", b"PK\x03\x04 not at all"),
        ("log.npz", archive("u.npy", b"\x00" * 1000)),
        ("log.xlsx", b"PK\x03\x04 not at all"),
        ("log.parquet", b"PAR1 not at all"),
    ],
    ids=range(13),
)
def test_files_that_are_no_tables_are_unreadable(name, raw, tmp_path):
    (tmp_path / name).write_bytes(raw)
    assert refused_log(tmp_path / name).code == "data-unreadable"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["log.npz", "log.xlsx"])
def test_an_archive_that_unpacks_to_more_than_the_limit_is_refused_at_once(name, tmp_path):
    with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as file:
        for k in range(1, 12):
            file.writestr(
                "[Content_Types].xml" if name == "log.xlsx" and k == 1 else f"a{k}.npy", bytes(100 * 2**20)
            )
    started = time.monotonic()
    assert "1 GiB" in refused_log(tmp_path / name).message
    assert time.monotonic() - started < 5.0


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"u": U, "y": Y[:-1]}, "different lengths"),
        ({"u": np.array(["a", "b"])}, "text"),
        ({"s": {"u": U, "y": Y}, "z": {"u": 2 * U, "y": Y}}, "log.mat#s"),
        ({"u": U, "y": Y, "Ts": "soon"}, "sample time"),
        ({"u": U + 1j, "y": Y}, "u"),
        ({"u": {"time": U, "a": U}, "y": {"time": Y, "a": Y}}, "same times"),
    ],
)
def test_arrays_that_are_no_columns_are_refused(arrays, said, tmp_path):
    scipy.io.savemat(tmp_path / "log.mat", arrays)
    found = refused_log(tmp_path / "log.mat")
    assert said in f"{found.message} {found.hint}"
    if "z" in arrays:
        np.testing.assert_array_equal(read_log(tmp_path / "log.mat#z", Preparation()).u[:, 0], 2 * U)


def test_structs_of_one_signal_each_are_read_as_columns(tmp_path):
    """Simulink logs each signal like this, with its own times."""
    structs = {x: {"time": np.arange(0.0, 10.0, 0.5), "a": {"b": s}} for x, s in (("u", U), ("y", Y))}
    scipy.io.savemat(tmp_path / "log.mat", structs)
    read = read_log(tmp_path / "log.mat", Preparation(detrend="none"))
    assert (read.step, read.u[:, 0].tolist(), read.y[:, 0].tolist()) == (0.5, U.tolist(), Y.tolist())


DIFFERENT = [
    ((0.5, 1.0), ("time,u,y", "time,u,y"), 3, {"sample_time": 1.0, "resample": True}),
    ((1.0, 0.5), ("time,u,y", "time,u,y"), 3, {"sample_time": 1.0, "resample": True}),
    ((1.0, 1.0), ("time,u,y1", "time,u,y1,y2"), 1, {"columns": {"u1": "u", "y1": "y1"}}),
    ((1.0, 1.0), ("time_s,u,y", "time_ms,u,y"), 3, None),
    ((0.5, 0.5), ("time,u,y", "no,u,y"), 3, {"sample_time": 0.5}),
]


@pytest.mark.parametrize(("steps", "names", "line", "mended"), DIFFERENT)
def test_files_that_differ_are_refused_until_options_reconcile_them(steps, names, line, mended, tmp_path):
    rng, paths = np.random.default_rng(1), [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path, step, header in zip(paths, steps, names, strict=True):
        table = np.column_stack([step * np.arange(40), rng.standard_normal((40, header.count(",")))])
        np.savetxt(path, table, delimiter=",", header=header, comments="")
    (found,) = refused(read_logs, paths, Preparation(), kind=DataError)
    assert (found.code, found.location.file, found.location.line) == ("data-not-uniform", str(paths[1]), line)
    assert not mended or read_logs(paths, Preparation(**mended)).step == mended.get("sample_time", 1.0)


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


READ = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize("ending", ["csv", "npz", "mat", "xlsx", "parquet"])
@READ
@given(pieces=st.lists(PIECES, max_size=40), form=st.sampled_from([None, "%d.%m.%Y", "%Y"]))
def test_no_bytes_lead_to_an_error_of_another_kind(ending, pieces, form, tmp_path):
    (tmp_path / f"log.{ending}").write_bytes(b"".join(pieces))
    with contextlib.suppress(IdesignError):
        read_log(tmp_path / f"log.{ending}", Preparation(columns={"u1": "1", "y1": "2"}, time_format=form))


@READ
@given(
    cells=st.lists(st.lists(CELLS, min_size=2, max_size=3), min_size=1, max_size=30),
    mark=st.sampled_from(",;\t"),
)
def test_no_table_leads_to_an_error_of_another_kind(cells, mark, tmp_path):
    (tmp_path / "log.csv").write_text("\n".join(mark.join(row) for row in cells))
    with contextlib.suppress(IdesignError):
        read_log(tmp_path / "log.csv", Preparation(columns={"u1": "1", "y1": "2"}))


@pytest.mark.parametrize("kind", ["mat", "mat5", "npz", "xlsx", "parquet"])
def test_no_damage_to_a_file_leads_to_an_error_of_another_kind(kind, tmp_path):
    """Some of these files would end the program in the reader of SciPy."""
    path = tmp_path / f"log.{kind[:3] if kind == 'mat5' else kind}"
    if kind.startswith("mat"):
        scipy.io.savemat(path, {"u": U, "y": Y, "Ts": 0.5, "s": {"a": U}}, do_compression=kind == "mat5")
    elif kind == "npz":
        np.savez_compressed(path, u=U, y=Y)
    else:
        frame = pandas.DataFrame({"u": U, "y": Y})
        getattr(frame, "to_parquet" if kind == "parquet" else "to_excel")(path, index=False)
    whole = path.read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(200 if kind.startswith("mat") else 40):
        broken = bytearray(whole[: rng.integers(len(whole) // 2, len(whole) + 1)])
        for at in rng.integers(0, len(broken), 4):
            broken[at] = rng.integers(256)
        path.write_bytes(broken)
        with contextlib.suppress(IdesignError):
            read_log(path, Preparation(columns={"u1": "u", "y1": "y"}))


def named(path, wanted=None):
    started = time.monotonic()
    found = refused(read_columns, path, wanted or {"u": "u"}, kind=DataError, key="spectrum.given.signal")
    assert time.monotonic() - started < 5.0
    return found[0]


def no_samples(path):
    (found,) = refused(read_samples, path, {"u": "u"}, kind=DataError, key="spectrum.given.signal")
    return found


def test_paths_that_are_no_plain_files_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    (tmp_path / "loop").symlink_to("loop")
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as listening:
        listening.bind(str(tmp_path / "socket"))
        for path in [*tmp_path.iterdir(), tmp_path, "/dev/zero", "/dev/stdin", "a\0b", "x" * 300]:
            assert named(tmp_path / path).code == "data-unreadable", path


@pytest.mark.parametrize(
    "text",
    [
        "root:x:0:0:root:/root:/bin/bash\nbin:x:1:1:bin:/bin:/sbin/nologin\n",
        "user,password\nann,hunter2\nbob,swordfish\n",
        "u,password\nann,hunter2\nbob,swordfish\n",
        "u\nhunter2\nswordfish,hunter2\n",
        "frequency,r_adm\nhunter2,swordfish\n1,hunter2\n",
    ],
)
def test_the_contents_of_a_file_without_numbers_are_not_shown(text, tmp_path):
    (tmp_path / "secret").write_text(text)
    for wanted in ({"u": "u"}, {"frequency": "frequency", "r_adm": "r_adm"}, {"y1": "y1"}):
        said = repr(named(tmp_path / "secret", wanted)).replace(str(tmp_path), "")
        for word in ("root", "bash", "hunter2", "swordfish", "ann", "bob", "password"):
            assert word not in said


def test_the_header_of_a_table_is_shown(tmp_path):
    (tmp_path / "u.csv").write_text("day,valve,level\n2026-01-01,1,2\n2026-01-02,3,4\n")
    assert "day, valve, level" in named(tmp_path / "u.csv").message
    assert read_sheet(tmp_path / "u.csv", key="").header == ["day", "valve", "level"]


@pytest.mark.parametrize("line", ["", "# 3,0"])
def test_a_signal_with_a_blank_or_commented_row_is_refused(line, tmp_path):
    (tmp_path / "u.csv").write_text(f"u,r\n1,0\n2,0\n{line}\n4,0\n")
    assert no_samples(tmp_path / "u.csv").code == "data-not-a-number"


@pytest.mark.parametrize("value", [9e99, -1e308, 1e30, 1e12])
def test_a_value_that_drowns_all_others_in_rounding_is_refused_with_its_line(value, tmp_path):
    (tmp_path / "u.csv").write_text("u\n" + "".join(f"{value if k == 30 else k % 7}\n" for k in range(60)))
    found = no_samples(tmp_path / "u.csv")
    assert (found.code, found.location.line) == ("beyond-precision", 32)
