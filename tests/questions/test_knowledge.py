"""Of several minima of the likelihood the one counts that agrees with what the spec says of the plant."""

from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli import analyse, assess, identify, load_spec
from inputdesign_cli.identification import Rival
from inputdesign_cli.questions.common.foresight import that_agrees
from tests.questions.test_foresight import HEATER, VARIANCE, H, plainly
from tests.support.heater import said

PERIOD = 60
# The same every 60 samples: a dead time of a period more differs in the first of 25 periods only.
ONCE = np.repeat(np.random.default_rng(8).choice([-1.0, 1.0], PERIOD // 2), 2)
INTERVALS = "uncertainty={intervals: {K: [1.5, 2.7], T: [120, 240], L: [15, 35]}, scenarios: 3, fresh: 0}"
COVARIANCE = (
    "uncertainty={covariance: [[0.04, 0, 0], [0, 400, 0], [0, 0, 25]], parameters: [K, T, L], scenarios: 3, "
    "fresh: 0}"
)


def heater(*overrides):
    asked = "accuracy={standard_deviation: {K: 2, T: 200, L: 50}}"
    return load_spec("specs/heater.yaml", [asked, *overrides])


def record(seed, folder):
    """A record of the true heater that begins at rest, and its expected excess in -2 log likelihood."""
    u = np.tile(0.17 * ONCE, 25)
    y, late = (HEATER[0] * plainly(HEATER[1], L, u) for L in (HEATER[2], HEATER[2] + PERIOD * H))
    noise = np.sqrt(VARIANCE) * np.random.default_rng(seed).standard_normal(u.size)
    path = folder / "record.csv"
    rows = np.column_stack([H * np.arange(u.size), u, y + noise])
    np.savetxt(path, rows, delimiter=",", header="time_s,u,y", comments="")
    return path, float(np.sum((y - late) ** 2)) / VARIANCE


@pytest.mark.parametrize(
    ("admitted", "home", "rivals", "ruled_out"),
    [
        ("abc", "a", None, {}),  # as it was
        ("ac", "a", {"c": 9.0}, {"b": 5.0}),
        ("bc", "b", {"c": 4.0}, {"a": -5.0}),
        ("c", "c", {}, {"a": -9.0, "b": -4.0}),
        ("", "a", None, {}),  # the data refute it
    ],
)
def test_the_likeliest_that_is_admitted_is_taken(admitted, home, rivals, ruled_out):
    """Of three minima; excesses count from the one that is taken."""

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
@pytest.mark.parametrize("known", [INTERVALS, pytest.param(COVARIANCE, marks=pytest.mark.slow)])
def test_a_rival_that_the_plant_cannot_be_leaves_nothing_open(known, tmp_path):
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
def test_the_likeliest_of_all_is_not_taken_where_the_plant_cannot_be_that(tmp_path):
    astray = 0
    for seed in range(3):
        path, _ = record(seed, tmp_path)
        free, known = (
            identify(spec, path).result["identification"] for spec in (heater(), heater(INTERVALS))
        )
        away = abs(free["theta"]["L"] - HEATER[2]) > 60.0
        assert abs(known["theta"]["L"] - HEATER[2]) < 4.0 * known["standard_deviation"]["L"]
        assert away == any(one["excess"] < 0.0 for one in known.get("ruled_out", []))
        astray += away
    assert astray


@pytest.mark.slow
def test_knowledge_that_the_data_refute_rules_nothing_out(tmp_path):
    wrong = ["plant.parameters.L=100", "uncertainty={intervals: {L: [95, 105]}, scenarios: 3, fresh: 0}"]
    path, _ = record(6, tmp_path)
    identification = identify(heater(*wrong), path).result["identification"]
    assert "ruled_out" not in identification
    assert identification["rivals"]
    assert identification["theta"]["L"] == pytest.approx(HEATER[2], abs=10.0)


@pytest.mark.slow
def test_what_is_foreseen_heeds_it_too(tmp_path):
    u = np.tile(0.17 * ONCE, 25)
    path = tmp_path / "u.csv"
    np.savetxt(path, np.column_stack([H * np.arange(u.size), u]), delimiter=",", header="t,u", comments="")
    given = (f"spectrum={{given: {{signal: {path}}}}}", "signal={}", f"experiment.samples={u.size}")
    free, known = (analyse(heater(*given, *more)).result["foreseen"] for more in ((), (INTERVALS,)))
    assert free["rivals"][0]["theta"]["L"] == pytest.approx(HEATER[2] + PERIOD * H, abs=20.0)
    assert known["rivals"] == []
