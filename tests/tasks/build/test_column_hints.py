"""What the errors about columns propose can be pasted, and names the times by what the file holds."""

import itertools
import re

import numpy as np
import pytest

from inputdesign_cli.cli.rows import named
from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.tasks.build.tables import read_columns

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


@pytest.mark.parametrize(
    ("asked", "text"),
    [
        ({"u1": "u", "y1": "u"}, "time=t,u1=u,y1=y"),
        ({"u1": "y", "y1": "y"}, "time=t,u1=u,y1=y"),
        ({"u1": "2", "y1": "u"}, "time=t,u1=u,y1=y"),
        ({"time": "u", "u1": "u", "y1": "y"}, "time=t,u1=u,y1=y"),
        ({"time": "t", "u1": "t", "y1": "y"}, "time=t,u1=u,y1=y"),
        ({"u1": "u", "u2": "u", "y1": "y"}, "time=t,u1=u,u2=NAME,y1=y"),
        ({"time": "none", "u1": "u", "y1": "u"}, "time=none,u1=u,y1=y"),
    ],
)
def test_a_column_for_two_channels_stays_with_one(asked, text, tmp_path):
    path = written(tmp_path / "log.csv", ("t", "u", "y"), ("time", "in", "out"))
    with pytest.raises(DataError, match="are the same column") as raised:
        read_log(path, Preparation(columns=asked))
    assert raised.value.diagnostics[0].hint.endswith(f': --columns "{text}"')


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (("SP", "PV", "OP"), "u1=OP,y1=PV"),
        (("FIC101.PV", "FIC101.SP", "FIC101.OP (%)"), "u1=3,y1=FIC101.PV"),
        (("Setpoint", "MV", "CV"), "u1=MV,y1=CV"),
        (("PV (degC)", "CO", "REF"), "u1=CO,y1=PV (degC)"),
        (("W", "PV", "OUT"), "u1=OUT,y1=PV"),
        (("SP", "PV"), "u1=SP,y1=PV"),
        (("CO", "CO2"), "u1=CO,y1=CO2"),
        (("Temp", "PV"), "u1=Temp,y1=PV"),
        (("signal mV", "valve"), "u1=valve,y1=signal mV"),
        (("Heater 1", "Heater 2", "Temperature 1", "Temperature 2"), "u1=Heater 1,y1=Temperature 1"),
        (("level_1 (m)", "level setpoint", "pump_2 (V)"), "u1=pump_2 (V),y1=level_1 (m)"),
    ],
)
def test_names_of_process_control_say_which_is_which(names, text, tmp_path):
    path = tmp_path / "log.csv"
    rows = np.random.default_rng(1).standard_normal((N, len(names))).tolist()
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]))
    told = proposed(path)
    assert told == text.replace("u1=3", "u1=FIC101.OP (%)")
    assert read_log(path, Preparation(columns=named(told, "", ""))).u.shape == (N, 1)


def long_table(path, mark):
    rows = [
        f"{t}{mark}{tag}{mark}{x}"
        for t, u, y in zip(TIMES, U, Y, strict=True)
        for tag, x in (("u", u), ("y", y))
    ]
    path.write_text("\n".join([mark.join(("time", "tag", "value")), *rows]))


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_table_of_one_signal_a_row_is_to_be_spread_as_the_hint_says(mark, tmp_path, monkeypatch):
    pandas = pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    long_table(tmp_path / "log.csv", mark)
    with pytest.raises(DataError) as raised:
        read_log(tmp_path / "log.csv", Preparation())
    hint = raised.value.diagnostics[0].hint
    assert hint.endswith('--columns "time=time,u1=NAME,y1=NAME"')
    (code,) = re.findall(r"read_csv.*to_csv\([^)]*\)", hint)
    eval(f"pandas.{code}", {"pandas": pandas})
    found = read_columns(tmp_path / "wide.csv", {"time": "time", "u": "u", "y": "y"}, key="")
    np.testing.assert_allclose(np.array([found["time"], found["u"], found["y"]]), [TIMES, U, Y])


def test_a_column_of_two_words_becomes_zeros_and_ones_first(tmp_path):
    path = tmp_path / "log.csv"
    switched = np.where(U > 0.0, "ON", "OFF")
    table = [f"{t},{w},{y}" for t, w, y in zip(TIMES, switched, Y, strict=True)]
    path.write_text("\n".join(["time,Heater,Temp", *table]))
    with pytest.raises(DataError) as raised:
        read_log(path, Preparation())
    hint = raised.value.diagnostics[0].hint
    assert hint.startswith("write 0 and 1 for OFF and ON in column Heater, then")
    path.write_text(path.read_text().replace("OFF", "0").replace("ON", "1"))
    (text,) = re.findall('--columns "(.*)"', hint)
    found = read_log(path, Preparation(columns=named(text, "", "")))
    np.testing.assert_array_equal(found.u[:, 0], U > 0.0)


def stamped(path, repeats, name="timestamp", form="2024-03-12 10:{0:02d}"):
    stamps = [form.format(k) for k in range(N // 3) for _ in range(next(repeats))][:N]
    rows = [f"{t},{u!r},{y!r}" for t, u, y in zip(stamps, U.tolist(), Y.tolist(), strict=False)]
    path.write_text("\n".join([f"{name},u,y", *rows]))
    return len(rows)


@pytest.mark.parametrize(
    ("counts", "name", "form", "option"),
    [
        ([3], "timestamp", "2024-03-12 10:{0:02d}", "--sample-time 20 --time-unit s"),
        ([4], "timestamp", "2024-03-12 {0:02d}:00", "--sample-time 900 --time-unit s"),
        ([2, 3], "time_min", "{0}", "--time-unit min"),
        ([3], "time", "{0}", "--sample-time 0.333333"),
    ],
)
def test_stamps_that_are_too_coarse_can_be_done_without(counts, name, form, option, tmp_path):
    path = tmp_path / "log.csv"
    count = stamped(path, itertools.cycle(counts), name, form)
    with pytest.raises(DataError, match="do not increase") as raised:
        read_log(path, Preparation())
    hint = raised.value.diagnostics[0].hint
    assert hint.endswith(option)
    assert "keep one of those" not in hint
    (text,) = re.findall('--columns "(.*)"', hint)
    (step,) = re.findall(r"--sample-time (\S+)", hint)
    found = read_log(path, Preparation(columns=named(text, "", ""), sample_time=float(step)))
    assert (found.step, len(found.y)) == (float(step), count)
    assert "time" not in found.names


def test_times_that_stand_twice_now_and_then_are_not_called_coarse(tmp_path):
    path = tmp_path / "log.csv"
    stamped(path, itertools.cycle([1, 1, 1, 2]))
    with pytest.raises(DataError, match="do not increase") as raised:
        read_log(path, Preparation())
    assert "keep one of those" in raised.value.diagnostics[0].hint


@pytest.mark.parametrize("said", ["none", "None", "NONE"])
def test_no_column_holds_the_times_if_one_says_so(said, tmp_path):
    path = written(tmp_path / "log.csv", ("time", "u", "y"), ("time", "in", "out"))
    found = read_log(path, Preparation(columns={"time": said}, sample_time=7.0))
    assert found.step == 7.0
    np.testing.assert_allclose(found.y[:, 0], Y)
    untold = read_log(path, Preparation(columns={"time": said}))
    assert untold.step == 1.0
    assert not any("add time=" in step for step in untold.steps)


def test_a_column_that_is_called_none_is_one(tmp_path):
    path = written(tmp_path / "log.csv", ("None", "u", "y"), ("time", "in", "out"))
    assert read_log(path, Preparation(columns={"time": "none"})).step == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("names", "known"), [(("heater", "temp"), True), (("x", "temp"), False), (("one", "other"), False)]
)
def test_pairs_that_no_names_tell_are_called_an_example(names, known, tmp_path):
    path = written(tmp_path / "log.csv", names, ("in", "out"))
    with pytest.raises(DataError) as raised:
        read_log(path, Preparation())
    assert ("an example" in raised.value.diagnostics[0].hint) != known
