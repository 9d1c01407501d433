"""Whatever bytes a file holds, it is read or refused in words."""

import contextlib

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings, strategies as st

from inputdesign_cli.errors import DataError, IdesignError
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from tests.support.logs import U, Y


@pytest.mark.parametrize("name", ["log.mat", "log.npz", "log.xlsx", "log.parquet"])
def test_broken_files_are_refused(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04 not at all")
    with pytest.raises(DataError) as caught:
        read_sheet(path, key="")
    assert caught.value.diagnostics[0].code == "data-unreadable"


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


@pytest.mark.parametrize("ending", ["csv", "npz", "xlsx", "parquet"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pieces=st.lists(PIECES, max_size=40))
def test_no_bytes_lead_to_another_error(ending, pieces, tmp_path):
    path = tmp_path / f"log.{ending}"
    path.write_bytes(b"".join(pieces))
    with contextlib.suppress(IdesignError):
        read_log(path, Preparation(columns={"u1": "1", "y1": "2"}))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    cells=st.lists(st.lists(CELLS, min_size=2, max_size=3), min_size=1, max_size=30),
    mark=st.sampled_from(",;\t"),
)
def test_no_table_leads_to_another_error(cells, mark, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(mark.join(row) for row in cells))
    with contextlib.suppress(IdesignError):
        read_log(path, Preparation(columns={"u1": "1", "y1": "2"}))


@pytest.mark.parametrize("kind", ["mat", "npz", "xlsx", "parquet"])
def test_no_damage_to_a_file_leads_to_another_error(kind, tmp_path):
    path = tmp_path / f"log.{kind}"
    if kind == "mat":
        scipy.io.savemat(path, {"u": U, "y": Y, "Ts": 0.5})
    elif kind == "npz":
        np.savez_compressed(path, u=U, y=Y)
    else:
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame({"u": U, "y": Y})
        getattr(frame, "to_parquet" if kind == "parquet" else "to_excel")(path, index=False)
    whole = path.read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(8 if kind == "mat" else 40):
        broken = bytearray(whole[: rng.integers(1, len(whole) + 1)])
        for at in rng.integers(0, len(broken), 4):
            broken[at] = rng.integers(256)
        path.write_bytes(broken)
        with contextlib.suppress(IdesignError):
            read_log(path, Preparation(columns={"u1": "u", "y1": "y"}))


def test_a_file_that_ends_its_reader_is_refused(tmp_path):
    """Sizes of a .mat file that do not fit its bytes lead SciPy's reader beyond its memory."""
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"u": U, "y": Y, "Ts": 0.5})
    broken = bytearray(path.read_bytes())
    broken[176] = 0  # the kind of the numbers of u
    path.write_bytes(broken)
    with pytest.raises(DataError, match=r"no \.mat file that can be read"):
        read_sheet(path, key="")
