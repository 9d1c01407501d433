"""The sample time that a file of arrays states beside its columns."""

import numpy as np
import pytest
import scipy.io

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from tests.support.logs import TIME, U, Y, iddata, save

NO_SAMPLE_TIME = {
    "Ts holds text ('0.5 s')": {"Ts": "0.5 s"},
    "Ts holds complex numbers": {"Ts": 0.5 + 1j},
    "Ts holds a truth value": {"Ts": np.array(True)},
    "dt holds a date or a length of time": {"dt": np.timedelta64(500, "ms")},
    "Ts says 0.5 and dt says 1": {"Ts": 0.5, "dt": 1.0},
}


@pytest.mark.parametrize(("told", "stated"), NO_SAMPLE_TIME.items(), ids=NO_SAMPLE_TIME)
def test_a_sample_time_that_is_none_is_refused_unless_another_is_given(told, stated, tmp_path):
    """`isolated.Arrays` is what both kinds of files come through; only .npz holds all of these."""
    path = tmp_path / "log.npz"
    np.savez(path, u=U, y=Y, **stated)
    with pytest.raises(DataError) as caught:
        read_log(path, Preparation())
    (only,) = caught.value.diagnostics
    assert only.message == f"log.npz states no sample time: {told}"
    assert "--sample-time" in only.hint
    assert read_log(path, Preparation(sample_time=0.5)).step == 0.5


@pytest.mark.parametrize("stated", [{"Ts": "0.5"}, {"Ts": np.float32(0.5)}, {"Ts": 0.5, "dt": [[0.5]]}])
@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_a_sample_time_is_honoured_however_it_is_saved(kind, stated, tmp_path):
    path = tmp_path / f"log.{kind}"
    save(path, u=U, y=Y, **stated)
    assert read_log(path, Preparation()).step == 0.5


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_an_empty_sample_time_says_nothing(kind, tmp_path):
    """As in an iddata whose samples are not evenly spaced."""
    path = tmp_path / f"log.{kind}"
    save(path, u=U, y=Y, time=2.0 * TIME, Ts=np.zeros(0))
    assert read_log(path, Preparation()).step == 2.0


def test_the_unit_of_an_iddata_is_that_of_its_times(tmp_path):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"data": {**iddata(), "TimeUnit": "minutes"}})
    assert read_log(path, Preparation()).time_unit == "min"
    scipy.io.savemat(path, {"data": {**iddata(), "TimeUnit": "weeks"}})
    with pytest.raises(DataError, match="states its times in 'weeks'"):
        read_log(path, Preparation())
    assert read_log(path, Preparation(time_unit="d")).time_unit == "d"


def test_times_that_contradict_the_sample_time_are_told(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, u=U, y=Y, time=2.0 * TIME, Ts=0.5)
    found = read_log(path, Preparation())
    assert found.step == 2.0
    assert "log.npz states the sample time 0.5, and its times advance by 2: they count" in found.steps
