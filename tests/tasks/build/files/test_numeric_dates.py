"""Dates that stand as numbers are the moments that pandas writes so, in whatever file; counts stay counts."""

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.tasks.build.data import read_data
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation

pandas = pytest.importorskip("pandas")
scipy_io = pytest.importorskip("scipy.io")

COUNT = 60
U = np.repeat([49.0, 51.5, 48.25, 50.0], COUNT // 4)
Y = 1300.25 + np.round(np.cumsum(U - 49.5), 2)
# Over a midnight, a leap day and the end of a month.
MINUTES = pandas.date_range("2024-02-29 23:10", periods=COUNT, freq="1min")
FORMS = {
    "seconds": ("%Y%m%d%H%M%S", pandas.date_range("2024-02-29 23:30", periods=COUNT, freq="90s"), 90.0),
    "minutes": ("%Y%m%d%H%M", MINUTES, 60.0),
    "days": ("%Y%m%d", pandas.date_range("2024-02-10", periods=COUNT, freq="1D"), 86_400.0),
}
PAIRS = {
    "HHMMSS": ("%H%M%S", FORMS["seconds"][1], 90.0),
    "HHMM": ("%H%M", MINUTES, 60.0),
    "text": ("%H:%M:%S", MINUTES, 60.0),
}


def write(frame, path):
    if path.suffix == ".mat":
        scipy_io.savemat(path, {name: frame[name].to_numpy(dtype=float) for name in frame})
    elif path.suffix == ".npz":
        np.savez(path, **{name: frame[name].to_numpy() for name in frame})
    else:
        {
            ".csv": lambda: frame.to_csv(path, index=False),
            ".txt": lambda: frame.to_csv(path, index=False, sep=";", decimal=",", float_format="%.18e"),
            ".parquet": lambda: frame.to_parquet(path),
            ".xlsx": lambda: frame.to_excel(path, index=False),
        }[path.suffix]()
    return path


def numbers(moments, form):
    return moments.strftime(form).astype(np.int64)


def check(path, step):
    found = read_log(path, Preparation())
    assert (found.step, found.time_unit, found.lengths) == (step, "s", (COUNT,))
    np.testing.assert_array_equal(found.y[:, 0], Y)
    return found.steps


@pytest.mark.parametrize("kind", ["int64", "float64"])
@pytest.mark.parametrize("ending", ["csv", "txt", "npz", "mat", "parquet", "xlsx"])
@pytest.mark.parametrize("form", FORMS)
def test_one_number_is_a_date(form, ending, kind, tmp_path):
    written, moments, step = FORMS[form]
    stamps = numbers(moments, written).astype(kind)
    steps = check(write(pandas.DataFrame({"time": stamps, "u": U, "y": Y}), tmp_path / f"log.{ending}"), step)
    assert any(f"(the first is {moments[0]:%Y-%m-%d}" in told for told in steps)


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet", "xlsx"])
@pytest.mark.parametrize("form", PAIRS)
def test_a_day_and_a_time_of_day_are_one_moment(form, ending, tmp_path):
    written, moments, step = PAIRS[form]
    if form == "text" and ending == "npz":
        pytest.skip("text is no array of numbers")
    clock = moments.strftime(written) if form == "text" else numbers(moments, written)
    frame = pandas.DataFrame({"Date": numbers(moments, "%Y%m%d"), "Time": clock, "u": U, "y": Y})
    steps = check(write(frame, tmp_path / f"log.{ending}"), step)
    assert any("Date and Time were joined" in told and "YYYYMMDD" in told for told in steps)


def test_a_day_and_a_time_of_day_need_no_names(tmp_path):
    _, moments, step = PAIRS["HHMM"]
    frame = pandas.DataFrame([numbers(moments, "%Y%m%d"), numbers(moments, "%H%M"), U, Y]).T
    frame.to_csv(tmp_path / "log.csv", index=False, header=False)
    found = read_log(tmp_path / "log.csv", Preparation(columns={"time": "1", "u1": "3", "y1": "4"}))
    assert found.step == step


@pytest.mark.parametrize("form", ["%Y%m%d%H%M%S.%f", "%Y%m%d%H%M%S%f"])
def test_parts_of_a_second_are_kept(form, tmp_path):
    moments = pandas.date_range("2024-12-31 23:59:59.5", periods=COUNT, freq="10ms")
    stamps = [stamp[:-3] for stamp in moments.strftime(form)]
    check(write(pandas.DataFrame({"time": stamps, "u": U, "y": Y}), tmp_path / "log.csv"), 0.01)


@pytest.mark.parametrize("form", ["HHMMSS", "HHMM"])
def test_a_lone_time_of_day_is_told_by_its_even_steps(form, tmp_path):
    written, moments, step = PAIRS[form]
    stamps = numbers(moments, written)
    steps = check(write(pandas.DataFrame({"time": stamps, "u": U, "y": Y}), tmp_path / "log.csv"), step)
    assert any(f"times of day are written as {form}" in told for told in steps)


@pytest.mark.parametrize(
    ("name", "stamps", "step"),
    [
        ("time", 100_000 + 100 * np.arange(COUNT), 100.0),  # as even as numbers as they are as times of day
        ("time", 7 * np.arange(COUNT), 7.0),
        ("time_s", 20_240_000_000_000 + 40 * np.arange(COUNT), 40.0),
        ("time", 1_710_238_500 + 5 * np.arange(COUNT), 5.0),
        ("time", 946_684_800_000 + 5000 * np.arange(COUNT), 5.0),  # milliseconds, 12 digits in 2000
    ],
)
def test_counts_stay_counts(name, stamps, step, tmp_path):
    frame = pandas.DataFrame({name: stamps, "u": U, "y": Y})
    found = read_log(write(frame, tmp_path / "log.csv"), Preparation())
    assert found.step == pytest.approx(step)
    assert not any("written as" in told for told in found.steps)


def test_seconds_beside_a_day_stay_seconds(tmp_path):
    frame = pandas.DataFrame({"Date": 20240312, "time": 2 * np.arange(COUNT), "level": Y, "u": U, "y": Y})
    found = read_log(write(frame, tmp_path / "log.csv"), Preparation())
    assert (found.step, found.steps) == (2.0, ())


def test_signals_are_no_times_of_day(tmp_path):
    levels = 1000 + np.arange(COUNT) % 60
    frame = pandas.DataFrame({"Date": 20240312, "y": levels, "t_s": 2.0 * np.arange(COUNT), "u": U})
    found = read_log(write(frame, tmp_path / "log.csv"), Preparation())
    np.testing.assert_array_equal(found.y[:, 0], levels)
    assert found.step == 2.0


@pytest.mark.parametrize("ending", ["csv", "npz"])
@pytest.mark.parametrize(("column", "wrong"), [("time", 20240231101500), ("time", 20240229106000)])
def test_a_number_among_dates_that_is_none_is_refused(column, wrong, ending, tmp_path):
    stamps = numbers(FORMS["seconds"][1], FORMS["seconds"][0]).to_numpy().copy()
    stamps[20] = wrong
    path = write(pandas.DataFrame({column: stamps, "u": U, "y": Y}), tmp_path / f"log.{ending}")
    with pytest.raises(DataError, match=f"{wrong}.*no date or time as the other numbers") as caught:
        read_log(path, Preparation())
    assert caught.value.diagnostics[0].location.line == (22 if ending == "csv" else 21)


def test_a_time_of_day_that_is_none_is_refused_beside_a_day(tmp_path):
    clock = numbers(MINUTES, "%H%M").to_numpy().copy()
    clock[20] = 1075
    frame = pandas.DataFrame({"Date": numbers(MINUTES, "%Y%m%d"), "Time": clock, "u": U, "y": Y})
    with pytest.raises(DataError, match=r"1075.*\(HHMM\)"):
        read_log(write(frame, tmp_path / "log.csv"), Preparation())


@pytest.mark.parametrize(("unit", "seconds"), [("s", 1.0), ("min", 60.0)])
def test_a_spec_gets_them_in_its_unit(unit, seconds, tmp_path):
    written, moments, step = FORMS["seconds"]
    frame = pandas.DataFrame({"time": numbers(moments, written), "u": U, "y": Y})
    units = Units(unit, step / seconds, sampled=True, closed_loop=False, inputs=1, outputs=1)
    found = read_data([write(frame, tmp_path / "log.csv")], units, Preparation())
    np.testing.assert_allclose(found.time, step / seconds * np.arange(COUNT), atol=1e-9)
