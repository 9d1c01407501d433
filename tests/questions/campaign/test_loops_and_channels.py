"""Campaigns in a closed loop and with two channels, in stages; the true plant differs from the spec."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.support.campaigns import found
from tests.support.commands import caller

TWO = """
plant:
  A: [[1, -0.7], [1, 0.4]]
  B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.3}}
spectrum: {type: fir, order: 4}
signal: {candidates: 2}
campaign: {stages: [60, 120, 120], last: nominal}
"""
LOOP = """
plant: {B: [0, 0.5], F: [1, -0.8]}
noise: {variance: 1.0}
cost: {input_power: 1, output_power: 1}
experiment: {samples: 300, controller: {numerator: [0.4], denominator: [1, -0.95]}}
accuracy: {model_error: {relative: 0.2}}
spectrum: {type: fir, order: 4}
signal: {candidates: 2}
campaign: {stages: [60, 120, 120], last: nominal}
"""
# True parameters, several standard deviations of the finished experiment away from the specs.
TRUE_TWO = {"a1[1]": -0.75, "a1[2]": 0.35, "b1[1,1]": 0.9, "b1[1,2]": -0.6, "b1[2,1]": 0.7, "b1[2,2]": 1.1}
TRUE_LOOP = {"b1": 0.4, "f1": -0.85}


def two(u, e):
    """(n, 2): y of two ARX equations, sample by sample."""
    at = TRUE_TWO
    A = np.diag([at["a1[1]"], at["a1[2]"]])
    B = np.array([[at["b1[1,1]"], at["b1[1,2]"]], [at["b1[2,1]"], at["b1[2,2]"]]])
    y = np.zeros_like(u)
    for t in range(len(u)):
        y[t] = e[t] @ np.linalg.cholesky([[1.0, 0.4], [0.4, 0.5]]).T
        if t:
            y[t] += -A @ y[t - 1] + B @ u[t - 1]
    return y


def loop(r, e):
    """u and y (n, 1) of u = r - 0.4 / (1 - 0.95 q^-1) y."""
    u, y, x, v = np.zeros_like(r), np.zeros_like(r), 0.0, 0.0
    for t in range(len(r)):
        if t:
            x = -TRUE_LOOP["f1"] * x + TRUE_LOOP["b1"] * u[t - 1, 0]
        y[t] = x + e[t]
        v = 0.95 * v + 0.4 * y[t, 0]
        u[t] = r[t] - v
    return u, y


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A folder with the campaigns `two` and `loop`, each with its first plan."""
    folder = tmp_path_factory.mktemp("begun")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name, text in (("two", TWO), ("loop", LOOP)):
            Path(f"{name}.yaml").write_text(text)
            assert caller(patch)("campaign", f"{name}.yaml", "-o", name, "--no-figures", "--quiet")[0] == 0
    return folder


@pytest.fixture
def begin(begun, tmp_path):
    """Copies one of these campaigns to the folder `c`."""
    return lambda name: shutil.copytree(begun / name, tmp_path / "c")


def recorded(directory, name):
    """Header and rows of the record of the next part, simulated with the true plant."""
    plans = [np.loadtxt(path, delimiter=",", skiprows=1) for path in sorted(directory.glob("plan_*.csv"))]
    times, x = np.concatenate(plans)[:, 0], np.concatenate(plans)[:, 1:]
    e = np.random.default_rng(4).standard_normal((1000, x.shape[1]))[: len(x)]
    if name == "two":
        table, header = np.column_stack([times, x, two(x, e)]), "time_s,u1,u2,y1,y2"
    else:
        table, header = np.column_stack([times, *loop(x, e), x]), "time_s,u,y,r"
    return header, table[-len(plans[-1]) :]


def saved(path, header, table):
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    return path


@pytest.mark.parametrize(
    ("name", "true"), [pytest.param("two", TRUE_TWO, marks=pytest.mark.slow), ("loop", TRUE_LOOP)]
)
def test_a_campaign_ends_within_four_deviations_of_the_true_parameters(run, begin, tmp_path, name, true):
    begin(name)
    for number in range(1, 8):
        record = saved(tmp_path / f"r{number}.csv", *recorded(tmp_path / "c", name))
        code, out, _ = run("next", "c", record, "--json", "--no-figures")
        result = json.loads(out)
        assert code == 0
        if result["status"] != "running":
            break
        plan = result["campaign"]["rounds"][-1]["plan"]
        if name == "two":  # the cost is the input power
            assert plan["part_cost"] == pytest.approx(plan["part_power"])
        assert plan["part_cost"] <= 10.0 * result["campaign"]["first_cost"] * (1 + 1e-9)
    assert result["status"] == "stopped"
    last = result["campaign"]["rounds"][-1]
    for parameter, value in true.items():
        assert abs(last["estimate"][parameter] - value) < 4 * last["standard_deviation"][parameter]
    for record in result["campaign"]["records"]:
        assert record["likeness"] == pytest.approx(1.0)
    assert [record["samples"] for record in result["campaign"]["records"]][:2] == [60, 120]


def test_a_wrong_reference_is_refused_and_a_missing_one_is_reported(run, begin, tmp_path):
    begin("loop")
    header, table = recorded(tmp_path / "c", "loop")
    wrong = table.copy()
    wrong[:, 3] += 0.8 * np.std(table[:, 3]) * np.random.default_rng(1).standard_normal(len(table))
    code, _, err = run("next", "c", saved(tmp_path / "w.csv", header, wrong))
    assert (code, "record-unlike" in err, "r1 has a correlation" in err) == (2, True, True)
    code, out, _ = run(
        "next", "c", saved(tmp_path / "n.csv", "time_s,u,y", table[:, :3]), "--json", "--no-figures"
    )
    assert code == 0
    (silent,) = found(json.loads(out), "record-without-excitation")
    assert (silent["where"], silent["figures"]) == ("n.csv", {"plan": "plan_01.csv"})


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("name", "order", "told", "right"),
    [
        ("two", [0, 2, 1, 3, 4], "u2 follows plan_01.csv as u1 should", "u1=u2,u2=u1,y1=y1,y2=y2"),
        ("two", [0, 1, 4, 3, 2], "y2 follows plan_01.csv as u2 should", "u1=u1,u2=y2,y1=y1,y2=u2"),
        ("loop", [0, 1, 3, 2], "y1 follows plan_01.csv as r1 should", "time_s,u,r,y"),
        ("loop", [0, 3, 2, 1], "u1 follows plan_01.csv as r1 should", "time_s,r,y,u"),
    ],
)
def test_swapped_columns_are_named_and_accepted_once_renamed(run, begin, tmp_path, name, order, told, right):
    begin(name)
    header, table = recorded(tmp_path / "c", name)
    record = saved(tmp_path / "s.csv", header, table[:, order])
    code, _, err = run("next", "c", record)
    assert (code, "record-unlike" in err, "the columns of s.csv look swapped" in err) == (2, True, True)
    assert told in err
    if name == "loop":  # the header names a reference
        assert "first line" in err
        record, options = saved(record, right, table[:, order]), ()
    else:
        options = ("--columns", right)
    assert run("next", "c", record, *options, "--no-figures")[0] == 0


@pytest.mark.parametrize(("name", "into", "other"), [("two", 4, "y2"), ("loop", 2, "y1")])
def test_an_output_that_is_a_copy_of_the_excitation_is_refused(run, begin, tmp_path, name, into, other):
    begin(name)
    header, table = recorded(tmp_path / "c", name)
    copied = 3 if name == "loop" else 1
    table[:, into] = np.round(2.0 * table[:, copied] + 5.0, 6)
    code, _, err = run("next", "c", saved(tmp_path / "w.csv", header, table), "--as-applied")
    assert (code, "record-copied" in err) == (2, True)
    assert f"{other} of w.csv is a copy of {'r1' if name == 'loop' else 'u1'}" in err


@pytest.mark.slow
def test_a_record_shorter_than_its_plan_is_reported(run, begin, tmp_path):
    begin("two")
    header, table = recorded(tmp_path / "c", "two")
    code, out, _ = run("next", "c", saved(tmp_path / "s.csv", header, table[:45]), "--json", "--no-figures")
    assert code == 0
    (shorter,) = found(json.loads(out), "record-shorter")
    assert shorter["figures"] == {"plan": "plan_01.csv", "samples": 45, "planned": 60}


def test_refusals_of_a_record_name_the_file_as_it_was_given(run, begin, tmp_path):
    begin("loop")
    header, table = recorded(tmp_path / "c", "loop")
    assert run("next", "c", saved(tmp_path / "n.csv", "time_s,u,y", table[:, :3]), "--no-figures")[0] == 0
    code, _, err = run("next", "c", saved(tmp_path / "again.csv", header, table), "--as-applied")
    assert (code, "data-repeated" in err, "again.csv and record_01.csv" in err) == (2, True, True)
    assert "record_02.csv" not in err
