"""The columns of a record are found by name and unit; unclear ones are refused."""

import re
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records import Preparation, read_data, read_log
from tests.support.refusals import code_of, refused

UNITS = Units("min", 2.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
NAMED = replace(UNITS, channels={"u1": ("Valve", "%"), "y1": ("Level", "mm")})
U, Y = np.random.default_rng(1).standard_normal((2, 200))
EVEN = [2 * k for k in range(200)]


@pytest.fixture
def log(tmp_path):
    """A function that writes a record with this header, times first if there are any."""

    def written(header, times=None):
        columns = [U.tolist(), Y.tolist()] if times is None else [times, U.tolist(), Y.tolist()]
        rows = "\n".join(",".join(map(str, row)) for row in zip(*columns, strict=True))
        (tmp_path / "d.csv").write_text(f"{header}\n{rows}\n", encoding="utf-8")
        return tmp_path / "d.csv"

    return written


def read(path, units=UNITS, **prepared):
    """The record, after a check that its samples are those that were written."""
    record = read_data([path], units, Preparation(**prepared))
    np.testing.assert_array_equal(record.u[:, 0], U)
    np.testing.assert_array_equal(record.y[:, 0], Y)
    return record


def codes(record):
    return [one.code for one in record.findings]


@pytest.mark.parametrize("name", ["time", "time_min", "t", "t_min", "timestamp", "Time (min)", "t [min]"])
def test_a_column_of_times_may_have_several_names(name, log):
    np.testing.assert_array_equal(read(log(f"{name},u,y", EVEN)).time, EVEN)
    assert (
        code_of(read, log(f"{name},u,y", [3 * k for k in range(200)]), kind=DataError) == "data-not-uniform"
    )


def test_another_unit_of_time_is_refused_until_the_user_states_it(log):
    assert code_of(read, log("t_ms,u,y", EVEN), kind=DataError) == "data-wrong-unit"
    path = log("t_s,u,y", [120 * k for k in range(200)])
    (told,) = refused(read, path, kind=DataError)
    assert (told.code, "--time-unit s" in told.hint) == ("data-wrong-unit", True)
    np.testing.assert_array_equal(read(path, time_unit="s").time, EVEN)


@pytest.mark.parametrize(
    ("header", "units"),
    [
        ("Valve,Level", []),
        ("valve [%],Level (MM)", []),
        ("Valve (mA),Level [cm]", ["mA", "cm"]),
        ("u (mA),y", ["mA"]),
        ("u1 Valve (%),y1 Level (m)", ["m"]),
    ],
)
def test_columns_are_found_by_channel_names_and_other_units_are_reported(header, units, log):
    record = read(log(header), NAMED)
    noted = [one.figures["found"] for one in record.findings if one.code == "unit-not-converted"]
    assert noted == units


@pytest.mark.parametrize(
    ("header", "u", "y"),
    [("time,Heater 1,Temp 1", 2, 3), ("time,TIC.OP,TIC.PV", 2, 3), ("time,steam.PV,temp.OP (%)", 3, 2)],
)
def test_the_hint_about_missing_columns_can_be_pasted(header, u, y, log):
    """Channels are recognised by words: OP is the input, PV the output."""
    path = log(header, EVEN)
    with pytest.raises(DataError, match=re.escape(header.replace(",", ", "))) as raised:
        read(path)
    (named,) = re.findall('--columns "(.*)"', raised.value.diagnostics[0].hint)
    assert named == f"time=time,u1={u},y1={y}"
    columns = dict(part.split("=") for part in named.split(","))
    assert read_data([path], UNITS, Preparation(columns=columns)).lengths == (200,)


@pytest.mark.parametrize(
    ("header", "channels"),
    [
        ("voltage [V],speed [rad/s]", {"u1": ("", "V"), "y1": ("", "rad/s")}),
        ("radiator valve [%],room (°C)", {"u1": ("valve", "%"), "y1": ("", "degC")}),
        ("valve [%],level [cm]", {"u1": ("inlet valve", "%"), "y1": ("tank level", "cm")}),
    ],
)
def test_a_column_is_found_by_its_unit_where_no_other_has_it(header, channels, log):
    record = read(log(f"time,{header}", EVEN), replace(UNITS, channels=channels))
    assert "column-by-unit" in codes(record)
    again = record.columns_option.removeprefix("--columns ").strip("' ")
    assert again == ",".join(f"{c}={h}" for c, h in zip(("u1", "y1"), header.split(","), strict=True))


@pytest.mark.parametrize(
    "header", ["outside (°C),room (°C)", "a [V],b [V]", "valve [%],room [K]", "humidity [%],room (°C)"]
)
def test_columns_with_neither_name_nor_unit_of_a_channel_are_refused(header, log):
    units = replace(UNITS, channels={"u1": ("valve", "%"), "y1": ("", "degC")})
    assert code_of(read, log(f"time,{header}", EVEN), units, kind=DataError) == "data-missing-column"


def test_the_reference_of_a_loop_is_found_by_its_name(tmp_path):
    rows = "\n".join(f"{2 * k},{u},{y},{u + y}" for k, (u, y) in enumerate(zip(U, Y, strict=True)))
    (tmp_path / "d.csv").write_text(f"time,valve [%],level [cm],r\n{rows}\n")
    channels = {"u1": ("inlet valve", "%"), "y1": ("level", "cm")}
    loop = replace(UNITS, closed_loop=True, channels=channels)
    np.testing.assert_allclose(read(tmp_path / "d.csv", loop).r[:, 0], U + Y)
    # The set point of a controller has the unit of the output; the reference r is added to the input.
    (tmp_path / "d.csv").write_text(f"time,valve [%],level [cm],setpoint [cm]\n{rows}\n")
    assert read(tmp_path / "d.csv", loop).r is None


def test_a_column_whose_name_only_begins_like_time_is_no_time(log):
    assert read(log("temperature,u,y", [7 * k for k in range(200)])).lengths == (200,)


@pytest.mark.parametrize("header", ["u,u1,y", "u a,u b,y"])
def test_an_input_that_may_be_in_two_columns_is_refused(header, log):
    (told,) = refused(read, log(header, EVEN), kind=DataError)
    assert (told.code, "--columns u1=u" in told.hint) == ("data-missing-column", True)


def test_with_several_inputs_the_first_one_is_u1_and_not_u(tmp_path):
    (tmp_path / "d.csv").write_text(
        "u,u1,u2,y\n" + "".join(f"{k},{k % 3},{k % 5},{k % 7}\n" for k in range(20))
    )
    record = read_data([tmp_path / "d.csv"], replace(UNITS, inputs=2), Preparation())
    np.testing.assert_array_equal(record.u.T, [np.arange(20) % 3, np.arange(20) % 5])


@pytest.mark.parametrize("column", ["1", "Time", "TIME [s]", "time [s]"])
def test_the_unit_of_a_column_counts_however_the_option_names_it(column, log):
    path, columns = log("Time [s],Valve (mA),level", EVEN), {"time": column, "u1": "2", "y1": "3"}
    assert code_of(read, path, NAMED, columns=columns, kind=DataError) == "data-wrong-unit"
    seconds = read(path, replace(NAMED, time_unit="s"), columns=columns)
    assert codes(seconds) == ["unit-not-converted"]


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
        ("volt", "V", True),
        ("V", "mV", False),
        ("%", "mA", False),
        ("deg", "degC", False),
    ],
)
def test_spellings_of_one_unit_count_as_the_same_unit(one, other, same, log):
    record = read(log(f"u,y ({other})"), replace(UNITS, channels={"y1": ("level", one)}))
    assert ("unit-not-converted" in codes(record)) is not same


@pytest.mark.parametrize(("unit", "agrees"), [("s", True), ("min", False), ("h", False)])
@pytest.mark.parametrize("times", ["seconds", "dates"])
def test_a_unit_that_contradicts_the_file_is_refused_by_every_command(unit, agrees, times, log):
    """Otherwise the plant would be sixty times too fast without a warning."""
    stamps = [datetime(2024, 2, 28) + timedelta(minutes=2 * k) for k in range(200)]
    seconds = [120 * k for k in range(200)]
    path = log(*(("timestamp,u,y", stamps) if times == "dates" else ("Time (s),u,y", seconds)))
    for reading in (read_log, lambda path, said: read_data([path], UNITS, said)):
        if agrees:
            assert reading(path, Preparation(time_unit=unit)).lengths == (200,)
            continue
        assert code_of(reading, path, Preparation(time_unit=unit), kind=DataError) == "data-wrong-unit"
