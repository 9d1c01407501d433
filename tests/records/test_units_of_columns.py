"""How the columns of a record are found, and what is said of files that cannot be read."""

import re
from datetime import datetime, timedelta

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import identify, parse_spec
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.records import Preparation, read_log

STRUCTURE = "sample_time: 2\ntime_unit: min\nplant: {B: [0, 1], F: [1, -0.7]}\n"
U = np.random.default_rng(1).standard_normal(200)
Y = scipy.signal.lfilter([0, 1], [1, -0.7], U) + 0.1 * np.random.default_rng(2).standard_normal(200)


@pytest.fixture
def estimated(tmp_path):
    """The estimate from a file with this header and first column."""

    def made(header, first):
        path = tmp_path / "d.csv"
        rows = "\n".join(f"{t},{u!r},{y!r}" for t, u, y in zip(first, U.tolist(), Y.tolist(), strict=True))
        path.write_text(f"{header},u,y\n{rows}\n")
        return identify(parse_spec(STRUCTURE, design=False), path).result

    return made


@pytest.mark.first(3)
@pytest.mark.parametrize("name", ["time", "time_min", "t", "t_min", "timestamp", "Time (min)", "t [min]"])
def test_times_go_by_several_names(name, estimated):
    assert estimated(name, 2 * np.arange(200))["identification"]["theta"]["b1"] == pytest.approx(1.0, abs=0.1)
    with pytest.raises(DataError, match="sampled every 3"):
        estimated(name, 3 * np.arange(200))


def test_times_may_be_dates(estimated):
    moments = [datetime(2024, 2, 28, 23) + timedelta(minutes=2 * k) for k in range(200)]
    assert estimated("timestamp", [m.isoformat(" ") for m in moments])["identification"]["theta"][
        "b1"
    ] == pytest.approx(1.0, abs=0.1)
    late = [m + timedelta(minutes=5 * (k > 100)) for k, m in enumerate(moments)]
    cut = estimated("timestamp", [m.isoformat() for m in late])
    assert "record-cut" in [one["code"] for one in cut["findings"]]
    assert cut["identification"]["theta"]["b1"] == pytest.approx(1.0, abs=0.1)
    with pytest.raises(DataError, match="no date or time as those above are"):
        estimated("timestamp", ["2024-01-01", *["yesterday"] * 199])


def test_another_unit_is_told(estimated):
    with pytest.raises(DataError, match="the times are in ms"):
        estimated("t_ms", 2 * np.arange(200))


def test_a_unit_that_the_user_states_is_converted(tmp_path):
    path = tmp_path / "s.csv"
    path.write_text(
        "t_s,u,y\n"
        + "".join(
            f"{120 * k},{u!r},{y!r}\n" for k, (u, y) in enumerate(zip(U.tolist(), Y.tolist(), strict=True))
        )
    )
    spec = parse_spec(STRUCTURE, design=False)
    with pytest.raises(DataError, match="the times are in s") as raised:
        identify(spec, path)
    assert "--time-unit s" in raised.value.diagnostics[0].hint
    found = identify(spec, path, preparation=Preparation(time_unit="s")).result
    assert found["identification"]["theta"]["b1"] == pytest.approx(1.0, abs=0.1)


CHANNELS = "channels: {u1: {name: Valve, unit: '%'}, y1: {name: Level, unit: mm}}\n"


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ("Valve,Level", []),
        ("valve [%],Level (MM)", []),
        ("Valve (mA),Level [cm]", ["mA", "cm"]),
        ("u (mA),y", ["mA"]),
        ("u1 Valve (%),y1 Level (m)", ["m"]),
    ],
)
def test_columns_go_by_the_names_of_channels_and_other_units_are_told(header, told, tmp_path):
    path = tmp_path / "d.csv"
    rows = "".join(f"{u!r},{y!r}\n" for u, y in zip(U.tolist(), Y.tolist(), strict=True))
    path.write_text(f"{header}\n{rows}")
    found = identify(parse_spec(STRUCTURE + CHANNELS, design=False), path).result
    assert found["identification"]["theta"]["b1"] == pytest.approx(1.0, abs=0.1)
    noted = [one for one in found.get("findings", []) if one["code"] == "unit-not-converted"]
    assert [one["figures"]["found"] for one in noted] == told


@pytest.mark.parametrize(
    ("header", "u", "y"),
    [
        ("time,Heater 1,Temp 1", "Heater 1", "Temp 1"),
        ("time,TIC.OP,TIC.PV", "TIC.OP", "TIC.PV"),
        ("time,steam.PV,temp.OP (%)", "temp.OP (%)", "steam.PV"),
    ],
)
def test_the_hint_about_missing_columns_can_be_pasted(header, u, y, tmp_path):
    """The words of control systems decide: OP is the input, PV the output."""
    path = tmp_path / "d.csv"
    rows = "".join(
        f"{2 * k},{u!r},{y!r}\n" for k, (u, y) in enumerate(zip(U.tolist(), Y.tolist(), strict=True))
    )
    path.write_text(f"{header}\n{rows}")
    spec = parse_spec(STRUCTURE, design=False)
    with pytest.raises(DataError, match=re.escape(header.replace(",", ", "))) as raised:
        identify(spec, path)
    (named,) = re.findall('--columns "(.*)"', raised.value.diagnostics[0].hint)
    assert named == f"time=time,u1={u},y1={y}"
    columns = dict(part.split("=") for part in named.split(","))
    assert identify(spec, path, preparation=Preparation(columns=columns)).result["identification"]


def test_a_column_that_only_begins_like_a_time_is_none(estimated):
    assert estimated("temperature", 7 * np.arange(200))["identification"]["theta"]["b1"] == pytest.approx(
        1.0, abs=0.1
    )


def test_the_variance_of_noise_that_is_estimated_need_not_be_stated(estimated):
    for noise in ("", "noise: {C: [1, 0.1]}\n"):
        parse_spec(STRUCTURE + noise, design=False)
        with pytest.raises(SpecError, match="noise"):
            parse_spec(STRUCTURE + noise)
    with pytest.raises(SpecError, match="noise"):
        parse_spec(STRUCTURE + "noise: 3\n", design=False)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("plant.B=3.6", r"one input and one output write a list"),
        ("plant.B=[[0, 1, 2]]", r"one input and one output write a list"),
        ("plant.F=[1, -0,7]", r"write 0\.7: a comma begins the next coefficient"),
    ],
)
def test_hints_name_the_likely_mistake_first(setting, said):
    with pytest.raises(SpecError) as caught:
        parse_spec(STRUCTURE, overrides=[setting], design=False)
    assert re.search(said, caught.value.diagnostics[0].hint)


@pytest.mark.parametrize("column", ["1", "Time", "TIME [s]", "time [s]"])
def test_the_unit_of_a_column_counts_however_it_is_named(column, tmp_path):
    path = tmp_path / "d.csv"
    rows = "\n".join(
        f"{2 * k},{u!r},{y!r}" for k, (u, y) in enumerate(zip(U.tolist(), Y.tolist(), strict=True))
    )
    path.write_text(f"Time [s],Valve (mA),level\n{rows}\n")
    named = Preparation(columns={"time": column, "u1": "2", "y1": "3"})
    spec = parse_spec(f"{STRUCTURE}channels: {{u1: {{name: valve, unit: '%'}}}}\n", design=False)
    with pytest.raises(DataError, match="the times are in s, but the spec counts in min"):
        identify(spec, path, preparation=named)
    seconds = identify(spec.with_(time_unit="s"), path, preparation=named)
    assert [one["code"] for one in seconds.result["findings"]] == ["unit-not-converted"]


@pytest.mark.first(4)
@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("degC", "\u00b0C", True),
        ("\u2103", "deg C", True),
        ("degrees C", "Celsius", True),
        ("%", "percent", True),
        ("s", "sec", True),
        ("degC", "degF", False),
        ("%", "mA", False),
        ("deg", "degC", False),
    ],
)
def test_spellings_of_one_unit_are_no_difference(one, other, same, tmp_path):
    path = tmp_path / "d.csv"
    rows = "\n".join(f"{u!r},{y!r}" for u, y in zip(U.tolist(), Y.tolist(), strict=True))
    path.write_text(f"u,y ({other})\n{rows}\n", encoding="utf-8")
    spec = parse_spec(f"{STRUCTURE}channels: {{y1: {{name: level, unit: '{one}'}}}}\n", design=False)
    codes = [one["code"] for one in identify(spec, path).result.get("findings", [])]
    assert ("unit-not-converted" in codes) is not same


@pytest.mark.parametrize(("unit", "agrees"), [("s", True), ("min", False), ("h", False)])
@pytest.mark.parametrize("times", ["seconds", "dates"])
def test_a_unit_that_contradicts_the_file_is_refused_by_every_command(unit, agrees, times, tmp_path):
    """Else a plant sixty times too fast would look like any other."""
    path = tmp_path / "d.csv"
    stamps = [datetime(2024, 2, 28) + timedelta(minutes=2 * k) for k in range(len(U))]
    told = [s.isoformat() for s in stamps] if times == "dates" else [120 * k for k in range(len(U))]
    rows = "".join(f"{t},{u!r},{y!r}\n" for t, u, y in zip(told, U.tolist(), Y.tolist(), strict=True))
    path.write_text(f"{'timestamp' if times == 'dates' else 'Time (s)'},u,y\n{rows}")
    spec = parse_spec(STRUCTURE, design=False)
    for read in (lambda said: read_log(path, said), lambda said: identify(spec, path, preparation=said)):
        if agrees:
            assert read(Preparation(time_unit=unit))
            continue
        with pytest.raises(DataError, match=f"--time-unit says {unit}") as raised:
            read(Preparation(time_unit=unit))
        assert raised.value.diagnostics[0].code == "data-wrong-unit"
