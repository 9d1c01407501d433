"""Plants at which r_adm is that of `uncertainty.floor`: what is asked there no experiment can promise."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.report.facts import facts
from tests.support.robust_specs import LOOP

PEAK_DB = 6.0
W = np.linspace(1e-4, np.pi, 40001)
Z = np.exp(1j * W)


def peak(b, f, K, p):
    """Of |S| of the plant b q^-1 / (1 + f q^-1) under K / (1 - p q^-1), by the textbook."""
    loop = K / (1.0 - p / Z) * b / Z / (1.0 + f / Z)
    return float(np.max(1.0 / np.abs(1.0 + loop)))


def radius(b, f, K, p):
    """Of the poles of that loop."""
    return np.max(np.abs(np.roots([1.0, f - p + b * K, -f * p])))


def asked(seed):
    """Random plants around a nominal one, and a controller that keeps the margin with that one."""
    rng = np.random.default_rng(seed)
    wished = 10 ** (PEAK_DB / 20.0)
    while True:
        b, f, p = rng.uniform(0.2, 2.0), rng.uniform(-0.95, -0.3), rng.uniform(0.5, 0.99)
        K = rng.uniform(0.05, 1.5) / b
        if peak(b, f, K, p) < 0.9 * wished and radius(b, f, K, p) < 0.97:
            break
    plants = [(b * rng.uniform(0.5, 4.0), f + rng.uniform(-0.04, 0.04)) for _ in range(12)]
    stable = [(b, f) for b, f in plants if radius(b, f, K, p) < 0.98]
    listed = ", ".join(f"{{b1: {b!r}, f1: {f!r}}}" for b, f in stable)
    text = f"""
plant: {{B: [0, {b!r}], F: [1, {f!r}]}}
noise: {{variance: 0.01}}
experiment: {{samples: 500}}
limits: {{input_power: 1}}
objective: best_accuracy
accuracy:
  loop:
    controller: {{numerator: [{K!r}], denominator: [1, {-p!r}]}}
    max_sensitivity_db: {PEAK_DB}
spectrum: {{type: fir, order: 4}}
signal: {{candidates: 1}}
solver: {{any_spectrum: false}}
uncertainty: {{scenarios: [{listed}]}}
"""
    return text, [peak(b, f, K, p) for b, f in stable], wished


@pytest.mark.first(2)
@pytest.mark.parametrize("seed", range(4))
def test_every_plant_whose_sensitivity_exceeds_what_is_asked_is_told_and_no_other(seed):
    text, peaks, wished = asked(seed)
    found = solve(parse_spec(text)).result
    told = found["robust"].get("floor", {"lost": [], "raised": []})
    beyond = [number for number, one in enumerate(peaks, 1) if one > wished]
    assert told["lost"] == beyond
    assert set(beyond) <= set(told["raised"])
    for one in told.get("worst", []):
        assert one["peak"] == pytest.approx(peaks[one["scenario"] - 1], rel=1e-3)
    said = [one for one in found.get("findings", []) if one["code"] == "plants-lost"]
    assert len(said) == bool(beyond)


def test_a_plant_that_the_controller_does_not_fit_is_told_by_all_that_tells_of_it():
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 7.5}")
    found = solve(parse_spec(text, overrides=["uncertainty={scenarios: [{f1: -0.85, b1: 0.9}]}"])).outcome
    assert found.robust.floor.lost == (1,)
    lines = {name: value for name, value, _ in facts(found, "s")}
    assert lines["floor"].endswith("at 1 of them no model keeps what is asked")


REGION = "uncertainty={intervals: {b1: [0.3, 0.9]}, scenarios: 2, fresh: %s}"


def test_plants_that_are_drawn_afresh_are_counted_where_no_model_will_do():
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 7.5}")
    robust = solve(parse_spec(text, overrides=[REGION % 30, "solver.any_spectrum=false"])).result["robust"]
    beyond = np.mean([peak(b, -0.8, 0.4, 0.95) > 10 ** (7.5 / 20) for b in np.linspace(0.3, 0.9, 50)])
    assert robust["fresh"]["lost"] == pytest.approx(30 * beyond, abs=8)  # three deviations


@pytest.mark.slow
def test_a_plant_that_was_searched_is_told_where_no_model_will_do():
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 7.5}")
    region = (REGION % 1).replace("fresh", "worst_case: 0.9, fresh")
    found = solve(parse_spec(text, overrides=[region, "solver.any_spectrum=false"])).result["robust"][
        "searched"
    ]
    assert found["lost"]
    assert found["peak"] == pytest.approx(peak(found["parameters"]["b1"], -0.8, 0.4, 0.95), rel=1e-3)


def test_nothing_is_told_where_every_plant_has_an_r_adm_of_its_own():
    found = solve(parse_spec(LOOP, overrides=["uncertainty={scenarios: [{f1: -0.75}]}"])).result
    assert "floor" not in found["robust"]
    assert "lost" not in found["robust"].get("fresh", {})
