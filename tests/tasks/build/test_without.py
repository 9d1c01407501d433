"""Rows that are left out on request, or because an output shifts there, cut a record."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.log import read_log, read_logs
from inputdesign_cli.tasks.build.preparation import Preparation

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)


def log_in(path, samples=60, header="time,u,y", bad=None):
    rows = [f"{k},{k // 7 % 2},{k * k % 11}" for k in range(samples)]
    if bad is not None:
        rows[bad] = f"{bad},1e200,1"
    path.write_text("\n".join([header, *rows, ""]))
    return path


def test_rows_are_counted_as_in_notes_and_told(tmp_path):
    """Row 1 is the header: rows 22 to 31 are samples 20 to 29."""
    path = log_in(tmp_path / "log.csv")
    prepared = Preparation(without=(("", 22, 31), ("", 50, 50)))
    kept = [*range(20), *range(30, 48), *range(49, 60)]
    for found in (read_log(path, prepared), read_data([path], UNITS, prepared)):
        np.testing.assert_array_equal(found.time, kept)
        assert found.lengths == (20, 18, 11)
        notes = " ".join(getattr(found, "steps", getattr(found, "notes", ())))
        assert "rows 22 to 31, 50 left out, as --without says" in notes
        assert "missing number" not in notes


def test_what_is_left_out_may_hold_anything(tmp_path):
    path = log_in(tmp_path / "log.csv", bad=30)
    with pytest.raises(DataError) as caught:
        read_log(path, Preparation())
    assert "--without 32 leaves its row out" in caught.value.diagnostics[0].hint
    assert read_log(path, Preparation(without=(("", 32, 32),))).lengths == (30, 29)


def test_only_the_file_that_is_named_loses_rows(tmp_path):
    one, other = log_in(tmp_path / "a.csv"), log_in(tmp_path / "b.csv", samples=70)
    found = read_logs([one, other], Preparation(without=(("b.csv", 22, 31),)))
    assert found.lengths == (60, 20, 40)
    assert found.files == (("a.csv", 60), ("b.csv", 60))


@pytest.mark.parametrize(
    ("run", "code", "words"),
    [
        (("", 90, 99), "data-unreadable", "log.csv has no row from 90 to 99"),
        (("", 1, 1), "data-unreadable", "log.csv has no row 1,"),
        (("", 1, 99), "data-unreadable", "--without leaves no row of log.csv"),
    ],
)
def test_rows_that_are_not_there_and_all_of_them_are_refused(run, code, words, tmp_path):
    with pytest.raises(DataError) as caught:
        read_log(log_in(tmp_path / "log.csv"), Preparation(without=(run,)))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == code
    assert words in diagnostic.message
    assert diagnostic.hint


def test_files_of_one_name_are_told_by_their_folders(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    paths = [log_in(tmp_path / "a" / "log.csv"), log_in(tmp_path / "b" / "log.csv", samples=70)]
    found = read_logs(paths, Preparation(without=((str(paths[1]), 22, 31),)))
    assert found.lengths == (60, 20, 40)
    assert [name for name, _ in found.files] == list(map(str, paths))


def test_a_log_without_some_samples_is_the_same_as_a_file_without_their_rows(tmp_path):
    path = log_in(tmp_path / "log.csv")
    log = read_log(path, Preparation(without=(("", 42, 43),)))
    assert log.lengths == (40, 18)
    for begin, end in ((10, 15), (35, 45), (0, 12), (52, 58)):
        less = log.without(np.arange(begin, end))
        rows = log.recorded.rows[begin:end]
        again = read_log(path, Preparation(without=(("", 42, 43), ("", rows[0], rows[-1]))))
        assert less.lengths == again.lengths
        assert less.files == again.files
        for name in ("u", "y", "time"):
            np.testing.assert_array_equal(getattr(less, name), getattr(again, name))
        np.testing.assert_array_equal(less.recorded.rows, again.recorded.rows)
