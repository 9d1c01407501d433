"""The reference of a loop in a log: the frequency response without a model is estimated from it."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.questions import explore
from inputdesign_cli.records import Preparation, read_log


@pytest.fixture(scope="module")
def rows():
    """A lag of gain 2 and 6 samples with strong noise, in a loop with u = 0.8 (r - y)."""
    rng = np.random.default_rng(5)
    r = np.repeat(rng.choice([-1.0, 1.0], 200), rng.integers(4, 20, 200))[:900]
    y, u, x, pole = np.zeros(900), np.zeros(900), 0.0, np.exp(-1.0 / 6.0)
    for k in range(900):
        y[k] = x + 0.3 * rng.standard_normal()
        u[k] = 0.8 * (r[k] - y[k])
        x = pole * x + 2.0 * (1.0 - pole) * u[k]
    return np.c_[u, y, r]


def saved(path, rows, header):
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.10g")
    return path


@pytest.mark.slow
def test_what_a_reference_tells_is_not_drawn_towards_the_controller(rows, tmp_path):
    named = saved(tmp_path / "named.csv", rows, "u,y,SP")
    plain = saved(tmp_path / "plain.csv", rows, "u,y,r")
    by_name = explore([named], Preparation(columns={"r1": "SP"})).results
    told = by_name.result["exploration"]["frequency_response"]
    assert told["excitation"] == "r"
    assert "caveat" not in told
    table = by_name.tables["frequency_response"].columns
    w, G = table["frequency_rad_per_s"], table["G_re"] + 1j * table["G_im"]
    z, pole = np.exp(1j * w), np.exp(-1.0 / 6.0)
    inside = np.abs(G - 2.0 * (1.0 - pole) / (z - pole)) <= table["radius"]
    assert np.mean(inside) > 0.85
    np.testing.assert_array_equal(read_log(plain, Preparation()).r, rows[:, 2:])
    assert read_log(named, Preparation()).r is None


def test_a_column_called_r_that_holds_no_reference_is_left_alone(rows, tmp_path):
    text = saved(tmp_path / "log.csv", rows, "u,y,r").read_text().splitlines()
    text[5] = text[5].rpartition(",")[0] + ",good"
    (tmp_path / "log.csv").write_text("\n".join(text))
    log = read_log(tmp_path / "log.csv", Preparation())
    assert log.r is None
    assert log.lengths == (900,)


def test_references_of_some_inputs_only_are_refused(rows, tmp_path):
    path = saved(tmp_path / "log.csv", rows[:, [0, 0, 1, 2]], "u1,u2,y1,SP")
    with pytest.raises(DataError, match="no column for r2") as caught:
        read_log(path, Preparation(columns={"r1": "SP"}))
    assert "--columns r2=NAME" in caught.value.diagnostics[0].hint
