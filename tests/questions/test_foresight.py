"""Other minima of the likelihood are predicted, and ruled out by the uncertainty stated in the spec."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli import analyse, assess, identify, load_spec, parse_spec, simulate, solve
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.identification import Rival
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.questions.building.uncertainty import build_foreseen
from inputdesign_cli.questions.common import foresight, simulation
from inputdesign_cli.questions.common.foresight import that_agrees
from inputdesign_cli.questions.least_cost.build import build_convex
from tests.support.heater import said

H, SAMPLES, VARIANCE = 4.76, 720, 0.04
HEATER = (2.1, 180.0, 25.0)
RICHER = "{type: fir, order: 12}"
LIMIT = 2.0 * np.log(1000.0)


def held_response(T, L, u):
    """The response of e^(-Ls) / (T s + 1) to a held input u (n,)."""
    whole, part = divmod(L, H)
    a, first = np.exp(-H / T), 1.0 - np.exp(-(H - part) / T)
    taps = np.concatenate([np.zeros(int(whole) + 1), [first, 1.0 - a - first]])
    return scipy.signal.lfilter(taps, [1.0, -a], u)


def excess(L, u):
    """Expected excess in -2 log likelihood of the dead time L with the best K and T."""
    y = HEATER[0] * held_response(*HEATER[1:], u)

    def left(T):
        shape = held_response(T, L, u)
        return float(y @ y - (y @ shape) ** 2 / (shape @ shape))

    return scipy.optimize.minimize_scalar(left, bounds=(40.0, 600.0), method="bounded").fun / VARIANCE


def minima_by_scan(u):
    """Dead times of the minima with an excess below LIMIT, by a scan, without the true one."""
    grid = np.arange(0.5, 100.0, 1.0)
    found = np.array([excess(L, u) for L in grid])
    inner = np.flatnonzero((found[1:-1] < found[:-2]) & (found[1:-1] < found[2:])) + 1
    return [grid[i] for i in inner if found[i] < LIMIT and abs(grid[i] - HEATER[2]) > 2.0]


def solved(*overrides):
    found = solve(load_spec("specs/heater.yaml", overrides))
    columns = found.tables["signal"].columns
    return found.result, next(values for name, values in columns.items() if name[0] in "ur")


def test_predicted_minima_are_those_of_a_scan_over_the_dead_time():
    result, u = solved()
    scan, rivals = minima_by_scan(u), result["foreseen"]["rivals"]
    assert scan
    assert rivals
    for rival in rivals:
        assert min(abs(rival["theta"]["L"] - L) for L in scan) < 3.0
        assert rival["ratio"] > 1.0
    assert "other-minimum-foreseen" in {one["code"] for one in result["findings"]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spectrum", "undecided"), [("{type: multisine, lines: 120}", True), (RICHER, False)]
)
def test_assess_is_undecided_for_a_lines_spectrum_and_decides_for_a_richer_one(spectrum, undecided, tmp_path):
    _, u = solved(f"spectrum={spectrum}")
    y = HEATER[0] * held_response(*HEATER[1:], u)
    y += np.sqrt(VARIANCE) * np.random.default_rng(5).standard_normal(u.size)
    path = tmp_path / "record.csv"
    columns = np.column_stack([H * np.arange(u.size), u, y])
    np.savetxt(path, columns, delimiter=",", header="time_s,u,y", comments="")
    found = assess(load_spec("specs/heater.yaml"), path)
    assessment = found.results.result["assessment"]
    assert (found.verdict == "undecided") == undecided
    assert assessment["verdict"] == found.verdict
    assert assessment.get("causes", []) == (["undetermined"] if undecided else [])


@pytest.mark.slow
@pytest.mark.parametrize("spectrum", [RICHER, "{type: multisine, lines: 40}"])
def test_no_minima_are_predicted_where_a_scan_finds_none(spectrum):
    result, u = solved(f"spectrum={spectrum}")
    assert minima_by_scan(u) == []
    assert result["foreseen"] == {"rivals": []}
    assert "other-minimum-foreseen" not in {one["code"] for one in result.get("findings", [])}


def test_no_other_minima_are_sought_with_a_known_dead_time():
    result, _ = solved("plant.known=[L]", "accuracy={standard_deviation: {K: 0.05, T: 6}}")
    assert "foreseen" not in result


@pytest.mark.parametrize(
    ("override", "longest", "reason"),
    [("solver.any_spectrum=false", 20.0, "--fast"), ("title=a", 0.01, "the record is long")],
)
def test_a_skipped_search_for_other_minima_is_reported_with_a_reason(override, longest, reason, monkeypatch):
    monkeypatch.setattr(foresight, "_LONGEST", longest)
    result, _ = solved(override)
    assert "foreseen" not in result
    (found,) = [one for one in result["findings"] if one["code"] == "other-minima-not-looked-at"]
    assert reason in found["message"]


def test_the_search_for_other_minima_is_skipped_without_time_left():
    asked = build_convex(load_spec("specs/heater.yaml"))
    with time_limit(0.01):
        entry, (found,) = asked.foresight.foreseen(np.ones((SAMPLES, 1)), ())
    assert entry is None
    assert found.code == "other-minima-not-looked-at"
    assert "solver.time_limit left no time" in found.message


@pytest.mark.slow
def test_simulated_runs_state_how_many_full_searches_end_in_another_minimum(monkeypatch):
    monkeypatch.setattr(simulation, "_SEARCHED", 5)
    spec = load_spec(
        "specs/heater.yaml", ["simulation.runs=3", "experiment.samples=240", "signal.samples=240"]
    )
    result = simulate(spec).result
    searched = result["simulation"]["inputs"]["design"]["searched"]
    # Other minima are nearly as likely: almost all records have several, and some searches end there.
    assert searched["runs"] == 5
    assert searched["rivals"] >= 4
    assert 1 <= searched["elsewhere"] <= 4
    assert any(f"{searched['elsewhere']} of 5 records end" in note for note in result["notes"])


OTHERS = {
    "loop": "experiment={samples: 720, controller: {pid: {Kp: 0.5, Ti: 180}}}",
    "duration": "experiment={duration: 1800}",
    "held": "signal={type: binary, hold: 3, samples: 720, seed: 1}",
    "shortest": "limits={input_power: 2}",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", OTHERS)
def test_other_minima_are_sought_for_all_kinds_of_experiments(kind):
    assert "rivals" in solved(OTHERS[kind])[0]["foreseen"]


UNCERTAIN = """
sample_time: 5
plant: {continuous: {gain: 2, time_constant: 180, dead_time: 25}, sample: zoh}
noise: {variance: 0.04}
experiment: {samples: 720}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: white}
"""
INTERVALS = "uncertainty: {intervals: {gain: [1.4, 2.6], time_constant: [126, 234]}, scenarios: 3}\n"
COVARIANCE = (
    "uncertainty: {covariance: [[0.04, 0, 0], [0, 400, 0], [0, 0, 4]], "
    "parameters: [gain, time_constant, dead_time], scenarios: 3}\n"
)


@pytest.mark.parametrize(
    ("stated", "theta", "missed"),
    [
        (INTERVALS, {"gain": 2.4, "time_constant": 143.0}, None),
        (INTERVALS, {"gain": 2.62}, None),  # beyond 2.6 by two standard deviations of 0.01
        (INTERVALS, {"gain": 2.7}, ["gain"]),
        (INTERVALS, {"dead_time": 30.0}, ["dead_time"]),  # has no interval
        (COVARIANCE, {"gain": 2.4, "time_constant": 200.0}, None),
        (COVARIANCE, {"gain": 3.2}, ["gain", "time_constant", "dead_time"]),
        (COVARIANCE, {"gain": -2.0}, ["gain", "time_constant", "dead_time"]),
    ],
)
def test_parameters_outside_the_stated_uncertainty_are_listed(stated, theta, missed):
    spec = parse_spec(UNCERTAIN + stated)
    nominal = build_model(spec)
    values = dict(zip(nominal.names, nominal.theta.tolist(), strict=True)) | theta
    foreseen = build_foreseen(spec, nominal)
    assert foreseen is not None
    theta = np.array([values[name] for name in nominal.names])
    found = foreseen.missed(theta, 1e-4 * np.eye(len(values)))
    assert (found if found is None else [nominal.names[k] for k in found]) == missed


PERIOD = 60
# The input has a period of 60: a dead time longer by a period differs in the first of 25 periods only.
ONCE = np.repeat(np.random.default_rng(8).choice([-1.0, 1.0], PERIOD // 2), 2)
WITHIN = "uncertainty={intervals: {K: [1.5, 2.7], T: [120, 240], L: [15, 35]}, scenarios: 3, fresh: 0}"
SPREAD = (
    "uncertainty={covariance: [[0.04, 0, 0], [0, 400, 0], [0, 0, 25]], parameters: [K, T, L], scenarios: 3, "
    "fresh: 0}"
)


def heater(*overrides):
    asked = "accuracy={standard_deviation: {K: 2, T: 200, L: 50}}"
    return load_spec("specs/heater.yaml", [asked, *overrides])


def record(seed, folder):
    """A record of the heater from rest, and the expected excess of the later dead time."""
    u = np.tile(0.17 * ONCE, 25)
    y, late = (HEATER[0] * held_response(HEATER[1], L, u) for L in (HEATER[2], HEATER[2] + PERIOD * H))
    noise = np.sqrt(VARIANCE) * np.random.default_rng(seed).standard_normal(u.size)
    path = folder / "record.csv"
    rows = np.column_stack([H * np.arange(u.size), u, y + noise])
    np.savetxt(path, rows, delimiter=",", header="time_s,u,y", comments="")
    return path, float(np.sum((y - late) ** 2)) / VARIANCE


@pytest.mark.parametrize(
    ("admitted", "home", "rivals", "ruled_out"),
    [
        ("abc", "a", None, {}),  # all are admitted
        ("ac", "a", {"c": 9.0}, {"b": 5.0}),
        ("bc", "b", {"c": 4.0}, {"a": -5.0}),
        ("c", "c", {}, {"a": -9.0, "b": -4.0}),
        ("", "a", None, {}),  # none is admitted
    ],
)
def test_the_most_likely_admitted_minimum_is_taken(admitted, home, rivals, ruled_out):
    """There are three minima; excesses are relative to the one that is taken."""

    def estimate(theta, others=()):
        def with_rivals(rivals):
            return SimpleNamespace(theta=theta, rivals={one.theta: one.excess for one in rivals})

        found = SimpleNamespace(theta=theta, search=SimpleNamespace(rivals=others), rivals=None)
        found.with_rivals = with_rivals
        return found

    knowledge = SimpleNamespace(admits=lambda theta: theta in admitted)
    found, out = that_agrees(knowledge, estimate("a", (Rival("b", 5.0), Rival("c", 9.0))), estimate)
    assert (found.theta, found.rivals) == (home, rivals)
    assert {one.theta: one.excess for one in out} == ruled_out


@pytest.mark.slow
@pytest.mark.parametrize("known", [WITHIN, pytest.param(SPREAD, marks=pytest.mark.slow)])
def test_a_minimum_outside_the_stated_uncertainty_does_not_affect_the_verdict(known, tmp_path):
    path, excess = record(5, tmp_path)
    assert excess < 2.0 * np.log(1000.0)
    assert assess(heater(), path).verdict == "undecided"
    found = assess(heater(known), path)
    identification = found.results.result["identification"]
    assert found.verdict == "met"
    assert "rivals" not in identification
    assert identification["ruled_out"][0]["theta"]["L"] == pytest.approx(HEATER[2] + PERIOD * H, abs=20.0)
    assert "The uncertainty excludes another minimum" in said(found.results)


@pytest.mark.slow
def test_the_most_likely_minimum_is_not_taken_outside_the_stated_uncertainty(tmp_path):
    astray = 0
    for seed in range(3):
        path, _ = record(seed, tmp_path)
        free, known = (identify(spec, path).result["identification"] for spec in (heater(), heater(WITHIN)))
        away = abs(free["theta"]["L"] - HEATER[2]) > 60.0
        assert abs(known["theta"]["L"] - HEATER[2]) < 4.0 * known["standard_deviation"]["L"]
        assert away == any(one["excess"] < 0.0 for one in known.get("ruled_out", []))
        astray += away
    assert astray


@pytest.mark.slow
def test_a_stated_uncertainty_that_the_data_refute_rules_nothing_out(tmp_path):
    wrong = ["plant.parameters.L=100", "uncertainty={intervals: {L: [95, 105]}, scenarios: 3, fresh: 0}"]
    path, _ = record(6, tmp_path)
    identification = identify(heater(*wrong), path).result["identification"]
    assert "ruled_out" not in identification
    assert identification["rivals"]
    assert identification["theta"]["L"] == pytest.approx(HEATER[2], abs=10.0)


@pytest.mark.slow
def test_minima_outside_the_stated_uncertainty_are_not_predicted(tmp_path):
    u = np.tile(0.17 * ONCE, 25)
    path = tmp_path / "u.csv"
    np.savetxt(path, np.column_stack([H * np.arange(u.size), u]), delimiter=",", header="t,u", comments="")
    given = (f"spectrum={{given: {{signal: {path}}}}}", "signal={}", f"experiment.samples={u.size}")
    free, known = (analyse(heater(*given, *more)).result["foreseen"] for more in ((), (WITHIN,)))
    assert free["rivals"][0]["theta"]["L"] == pytest.approx(HEATER[2] + PERIOD * H, abs=20.0)
    assert known["rivals"] == []
