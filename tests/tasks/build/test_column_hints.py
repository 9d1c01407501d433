"""What the errors about columns propose can be pasted, and names the times by what the file holds."""

import re

import numpy as np
import pytest

from inputdesign_cli.cli.data import named
from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation

N = 40
U, Y = np.random.default_rng(0).standard_normal((2, N))
TIMES = 0.5 * np.arange(N) + 0.01 * np.cos(np.arange(N))  # they jitter
COLUMNS = {"time": TIMES, "in": U, "out": Y}


def written(path, names, order, *, header=True):
    rows = np.column_stack([COLUMNS[role] for role in order])
    head = [",".join(names)] if header else []
    path.write_text("\n".join([*head, *(",".join(map(repr, row)) for row in rows.tolist())]))
    return path


def proposed(path, **columns):
    with pytest.raises(DataError) as raised:
        read_log(path, Preparation(columns=columns))
    (text,) = re.findall('--columns "(.*)"', raised.value.diagnostics[0].hint)
    return text


@pytest.mark.parametrize(
    ("names", "order", "text"),
    [
        (("valve", "temp", "t"), ("in", "out", "time"), "time=t,u1=valve,y1=temp"),
        (("Time (s)", "valve", "temp"), ("time", "in", "out"), "time=Time (s),u1=valve,y1=temp"),
        (("valve", "Sekunden", "temp"), ("in", "time", "out"), "time=Sekunden,u1=valve,y1=temp"),
        (("valve", "temp"), ("in", "out"), "u1=valve,y1=temp"),
        (("valve", "valve", "t"), ("in", "out", "time"), "time=t,u1=1,y1=2"),
        (("valve=", "temp", "t"), ("in", "out", "time"), "time=t,u1=1,y1=temp"),
    ],
)
def test_a_hint_is_made_of_the_header_and_can_be_pasted(names, order, text, tmp_path):
    path = written(tmp_path / "log.csv", names, order)
    assert proposed(path) == text
    found = read_log(path, Preparation(columns=named(text, "", "")))
    np.testing.assert_allclose(found.u[:, 0], U)
    assert found.step == pytest.approx(0.5 if "time" in order else 1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("order", "text"),
    [(("time", "in", "out"), "time=1,u1=2,y1=3"), (("in", "out", "time"), "time=3,u1=1,y1=2")],
)
def test_without_a_header_the_times_are_those_that_rise(order, text, tmp_path):
    assert proposed(written(tmp_path / "log.csv", (), order, header=False)) == text


def test_what_is_named_stays_and_what_is_missing_is_added(tmp_path):
    path = written(tmp_path / "log.csv", ("valve", "temp", "t"), ("in", "out", "time"))
    assert proposed(path, u1="valve") == "time=t,u1=valve,y1=temp"
    assert proposed(path, y1="valve", time="3") == "time=3,u1=temp,y1=valve"
    assert proposed(path, u2="valve", y1="temp") == "time=t,u1=valve,y1=temp"


def test_times_that_do_not_rise_name_the_column_that_does(tmp_path):
    path = written(tmp_path / "log.csv", ("valve", "temp", "t"), ("in", "out", "time"))
    with pytest.raises(DataError, match="do not increase") as raised:
        read_log(path, Preparation(columns={"time": "1", "u1": "2", "y1": "3"}))
    assert "--columns time=t" in raised.value.diagnostics[0].hint
