"""Data files are plain files of numbers: nothing is waited for, misread or shown that is something else."""

import os
import socket
import time

import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.columns import time_unit_of
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.questions.building.tables import read_columns, read_header, read_samples, time_columns


def refused(path, wanted=None):
    started = time.monotonic()
    with pytest.raises(DataError) as caught:
        read_columns(path, wanted or {"u": "u"}, key="spectrum.given.signal")
    assert time.monotonic() - started < 1.0
    return caught.value.diagnostics[0]


@pytest.fixture
def special(tmp_path):
    """Paths of what is no plain file."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    (tmp_path / "loop").symlink_to("loop")
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(str(tmp_path / "socket"))
    reading, writing = os.pipe()
    yield [*tmp_path.iterdir(), tmp_path, f"/dev/fd/{reading}", "/dev/zero", "/dev/stdin", "a\0b", "x" * 300]
    listening.close()
    os.close(reading)
    os.close(writing)


def test_what_is_no_plain_file_is_refused_at_once(special, tmp_path):
    for path in special:
        assert refused(tmp_path / path).code == "data-unreadable", path


@pytest.mark.parametrize("text", ["u\n1,5\n2\n", "time,u\n0,0\n1,1,5\n", "u\n1\n2,\n"])
def test_a_row_has_no_more_fields_than_the_header(tmp_path, text):
    path = tmp_path / "u.csv"
    path.write_text(text)
    found = refused(path)
    assert found.code == "data-extra-field"
    assert "," in text.splitlines()[found.location.line - 1]
    assert "decimal point" in found.hint


@pytest.mark.parametrize("cell", ['"1,500"', "1;5", "abc", "nan", "1e999", "", "1 2", "0x10"])
def test_what_is_no_number_is_refused_with_its_line(tmp_path, cell):
    path = tmp_path / "u.csv"
    path.write_text(f'note,u\n1,2\n\n"3",{cell}\n4,5\n')
    found = refused(path)
    assert (found.code, found.location.line) == ("data-not-a-number", 4)


SECRETS = [
    "root:x:0:0:root:/root:/bin/bash\nbin:x:1:1:bin:/bin:/sbin/nologin\n",
    "user,password\nann,hunter2\nbob,swordfish\n",
    "u,password\nann,hunter2\nbob,swordfish\n",
    "u\nhunter2\nswordfish,hunter2\n",
    "frequency,r_adm\nhunter2,swordfish\n1,hunter2\n",
]


@pytest.mark.parametrize("text", SECRETS)
def test_nothing_is_shown_of_a_file_that_holds_no_numbers(tmp_path, text):
    path = tmp_path / "secret"
    path.write_text(text)
    for wanted in ({"u": "u"}, {"frequency": "frequency", "r_adm": "r_adm"}, {"y1": "y1"}):
        told = repr(refused(path, wanted)).replace(str(path), "")
        for word in ("root", "bash", "hunter2", "swordfish", "ann", "bob", "password"):
            assert word not in told


def test_the_header_of_a_table_is_shown(tmp_path):
    path = tmp_path / "u.csv"
    path.write_text("day,valve,level\n2026-01-01,1,2\n2026-01-02,3,4\n")
    assert "day, valve, level" in refused(path).message
    assert read_header(path, key="") == ["day", "valve", "level"]


@pytest.mark.parametrize("line", ["", "# 3"])
def test_a_signal_lacks_no_sample_between_its_rows(line, tmp_path):
    path = tmp_path / "u.csv"
    path.write_text(f"u,r\n1,0\n2,0\n{line and line + ',0'}\n4,0\n")
    with pytest.raises(DataError, match=r"line 4 of u\.csv is .*: is a sample missing"):
        read_samples(path, {"u": "u"}, key="spectrum.given.signal")


TIMES = {
    "time": None,
    "Time (sec)": "s",
    "time_ms": "ms",
    "Timestamp": None,
    "elapsed time [h]": "h",
    "Time (minutes)": "min",
    "Zeit": None,
    "DateTime": None,
    "t": None,
    "t [s]": "s",
    "t_ms": "ms",
    "T (hours)": "h",
}
OTHERS = ["t\u00e9", "temp", "tank", "t\u00b0", "T_in", "T (\u00b0C)", "t-cold", "t (spare)", "timer"]


@pytest.mark.parametrize("name", [*TIMES, *OTHERS])
def test_times_are_known_by_their_names(name, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"{name},u,y\n" + "".join(f"{0.5 * k},{k % 3},{k % 5}\n" for k in range(9)))
    assert time_columns(read_sheet(path, key="")) == ([name.lower()] if name in TIMES else [])
    if name in TIMES:
        assert time_unit_of(name) == TIMES[name]


def test_a_temperature_is_no_time(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("T,u,y\n" + "".join(f"{20 + k % 4},{k % 3},{k % 5}\n" for k in range(9)))
    assert time_columns(read_sheet(path, key="")) == []


def test_a_column_of_dates_holds_the_times_where_none_is_called_so(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"2024-03-12 10:15:0{k},{k % 3},{k % 5}\n" for k in range(9))
    path.write_text(f"Date,u,y\n{rows}")
    assert time_columns(read_sheet(path, key="")) == ["date"]


@pytest.mark.parametrize("value", [9e99, -1e308, 1e30, 1e12])
def test_a_signal_has_no_value_beside_which_the_others_are_lost(value, tmp_path):
    path = tmp_path / "u.csv"
    path.write_text("u\n" + "".join(f"{value if k == 30 else k % 7}\n" for k in range(60)))
    with pytest.raises(DataError, match="column u") as caught:
        read_samples(path, {"u": "u"}, key="spectrum.given.signal")
    (told,) = caught.value.diagnostics
    assert (told.code, told.key, told.location.line) == ("beyond-precision", "spectrum.given.signal", 32)
