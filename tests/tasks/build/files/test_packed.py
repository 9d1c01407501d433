"""Files that are compressed are told as such, with the command that unpacks them; workbooks are none."""

import bz2
import gzip
import io
import lzma
import shutil
import subprocess
import zipfile

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import read_sheet

TABLE = b"time,u,y\n0,1,2\n1,3,4\n"


def zipped(**content):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, raw in content.items():
            archive.writestr(name, raw)
    return buffer.getvalue()


def refused(path):
    with pytest.raises(DataError) as caught:
        read_sheet(path, key="")
    (told,) = caught.value.diagnostics
    assert told.code == "data-unreadable"
    return told


PACKED = {
    "log.csv.gz": gzip.compress(TABLE),
    "log.csv.bz2": bz2.compress(TABLE),
    "log.csv.xz": lzma.compress(TABLE),
    "packed.csv": gzip.compress(TABLE),
    "packed.dat": bz2.compress(TABLE),
    "my log.zip": zipped(**{"log.csv": TABLE}),
}


@pytest.mark.parametrize(("name", "raw"), PACKED.items(), ids=PACKED)
def test_what_the_hint_says_gives_the_table(name, raw, tmp_path):
    path = tmp_path / name
    path.write_bytes(raw)
    told = refused(path)
    assert "is compressed (" in told.message
    command = told.hint.partition(": ")[2]
    if shutil.which(command.split()[0]) is None:
        pytest.skip(f"{command.split()[0]} is not installed")
    subprocess.run(command, shell=True, check=True, cwd=tmp_path, capture_output=True)
    found = read_sheet(next(p for p in tmp_path.iterdir() if p.name in ("log.csv", "unpacked.csv")), key="")
    assert found.names == ("time", "u", "y")


@pytest.mark.parametrize("name", ["log.zip", "log.csv", "log.xlsx", "log.mat"])
def test_an_archive_is_one_whatever_its_name(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(PACKED["my log.zip"])
    assert "is compressed (zip)" in refused(path).message


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"[Content_Types].xml": b"", "xl/workbook.xml": b""}, "is a spreadsheet, no CSV file"),
        ({"mimetype": b"application/vnd.oasis.opendocument.spreadsheet", "content.xml": b""}, "spreadsheet"),
    ],
)
def test_a_workbook_that_is_called_otherwise_is_a_spreadsheet(content, said, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(zipped(**content))
    assert said in refused(path).message


def test_arrays_of_numpy_that_are_called_otherwise_need_their_ending(tmp_path):
    np.savez(tmp_path / "log.npz", u=np.arange(4.0))
    path = (tmp_path / "log.npz").rename(tmp_path / "log.csv")
    assert refused(path).hint == "give it the ending .npz"


def test_a_name_that_only_begins_like_a_mark_is_text(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("BZhigh,u\n0,1\n1,3\n")
    assert read_sheet(path, key="").names == ("BZhigh", "u")
