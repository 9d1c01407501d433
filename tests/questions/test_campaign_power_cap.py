"""What a campaign may spend on a part: power_cap, in open and closed loop, whatever the estimate."""

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.questions.campaign.build import build_rules
from tests.support.campaigns import SPEC, planner, stands


def test_a_plan_beyond_the_cap_is_longer_and_at_last_weaker():
    at = planner()
    known = stands(at, share=0.01)
    rules = build_rules(parse_spec(SPEC, overrides=["campaign.power_cap=0.5"]))
    free = at.plan(rules, known, 60, 5, None)
    assert len(free.record) == 140
    longer = at.plan(rules, known, 60, 5, free.cost)
    assert not longer.capped
    assert longer.cost <= 0.5 * free.cost * (1 + 1e-6)
    # Of white noise at the output energy alone counts.
    assert len(longer.record) * longer.cost == pytest.approx(140 * free.cost, rel=0.03)
    weaker = at.plan(rules, known, 60, 5, 0.1 * free.cost)
    assert weaker.capped
    assert len(weaker.record) == 600 - 60
    assert weaker.cost == pytest.approx(0.05 * free.cost)
    assert not at.plan(rules, known, 60, 5, 10 * free.cost).capped


WILD = {
    "a sensor that is not connected": [1e-3, -0.1],
    "next to an integrator": [0.01, -0.99],
    "another sign": [-0.02, 0.95],
    "a gain that is too large": [900.0, -0.7],
}


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("block", "cost"),
    [(5, "{input_power: 1}"), (60, "{output_power: 1}"), (5, "{input_power: 1, output_power: 1}")],
)
@pytest.mark.parametrize("name", WILD)
def test_no_estimate_makes_a_part_dearer_than_the_cap(name, block, cost):
    """At the plant of the spec: the cap times the first plan, ten times that where outputs are paid for."""
    text = ["campaign.power_cap=0.7", f"campaign.block={block}", f"cost={cost}", "campaign.pilot=20"]
    spec = parse_spec(SPEC, overrides=text)
    at, rules = planner(SPEC, *text), build_rules(spec)
    first = at.plan(rules, None, 0, 1, None)
    known = stands(at, WILD[name], share=1e-3)
    for seed in (1, 2):
        part = at.plan(rules, known, 40, seed, first.cost).applied[:, 0]
        caused = lfilter([0, 3.6], [1, -0.7], part)
        paid = {"input_power": np.mean(part**2), "output_power": np.mean(caused**2)}
        wide = 10.0 if "output" in cost else 1.0
        spent = sum(paid[kind] for kind in paid if kind in cost)
        assert spent <= 0.7 * wide * first.cost * (1 + 1e-6)


@pytest.mark.first(2)
@pytest.mark.parametrize("cost", ["{input_power: 1}", "{input_power: 1, output_power: 0.1}"])
@pytest.mark.parametrize("cap", [0.05, 0.7, 1.0])
def test_the_first_part_keeps_the_cap_as_well(cap, cost):
    text = [f"campaign.power_cap={cap}", f"cost={cost}", "campaign.pilot=20", "campaign.last=nominal"]
    plan = planner(SPEC, *text).plan(build_rules(parse_spec(SPEC, overrides=text)), None, 0, 1, None)
    part = plan.applied[:, 0]
    spent = np.mean(part**2)
    if "output" in cost:
        spent += 0.1 * np.mean(lfilter([0, 3.6], [1, -0.7], part) ** 2)
    assert plan.part_cost == pytest.approx(spent, rel=1e-9)
    assert spent <= cap * plan.cost * (1 + 1e-9)


IN_A_LOOP = """
plant: {A: [1, -0.9], B: [0, 0.5]}
noise: {variance: 1}
cost: {input_power: 1, output_power: 2}
experiment: {samples: 200, controller: {numerator: [0.5, -0.4], denominator: [1, -1]}}
accuracy: {model_error: {relative: 0.2, band: [0.05, 3.14159]}}
spectrum: {type: fir, order: 4}
signal: {candidates: 1}
campaign: {block: 20, max_samples: 200, power_cap: 0.4, last: nominal}
"""


def spent_in_the_loop(r, a, b, start):
    """A sample from `start` on of u = r - C y, y = -a y(t-1) + b u(t-1), by hand."""
    u, y, v = np.zeros(len(r)), np.zeros(len(r)), 0.0
    for t in range(len(r)):
        if t:
            y[t] = -a * y[t - 1] + b * u[t - 1]
        v += 0.5 * y[t] - 0.4 * (y[t - 1] if t else 0.0)
        u[t] = r[t] - v
    return np.mean(u[start:] ** 2 + 2.0 * y[start:] ** 2)


def test_each_part_in_a_loop_keeps_the_cap_at_its_estimate_and_at_the_plant_of_the_spec():
    """With what the parts before have left, which moves on in the plant."""
    at, rules = planner(IN_A_LOOP), build_rules(parse_spec(IN_A_LOOP))
    known, first, r, binding = None, None, np.zeros((0, 1)), 0
    for number, theta in enumerate([[-0.9, 0.5], [-0.85, 0.55], [-0.92, 0.45], [-0.8, 0.4], [-0.9, 0.6]]):
        if number:
            known = stands(at, theta, share=0.005)
        plan = at.plan(rules, known, len(r), number, first, r)
        first = plan.cost if first is None else first
        start, r = len(r), np.concatenate([r, plan.applied])
        estimate, spec = (spent_in_the_loop(r[:, 0], *p, start) for p in (theta, (-0.9, 0.5)))
        assert plan.part_cost == pytest.approx(estimate, rel=1e-9)
        assert not plan.beyond
        assert estimate <= 0.4 * first * (1 + 1e-9)
        assert spec <= 4.0 * first * (1 + 1e-9)
        binding += plan.share < 1.0
    assert binding >= 2


def test_what_earlier_parts_have_left_beyond_the_cap_is_told():
    at, rules = planner(IN_A_LOOP), build_rules(parse_spec(IN_A_LOOP))
    first = at.plan(rules, None, 0, 1, None)
    before = np.full((40, 1), 20.0 * np.sqrt(first.cost))
    plan = at.plan(rules, stands(at, share=0.05), 40, 2, first.cost, before)
    whole = np.concatenate([before, plan.applied])[:, 0]
    assert plan.beyond
    assert plan.part_cost == pytest.approx(spent_in_the_loop(whole, -0.9, 0.5, 40), rel=1e-9)
    assert spent_in_the_loop(plan.applied[:, 0], -0.9, 0.5, 0) <= 0.4 * first.cost * (1 + 1e-9)


def test_the_first_plan_after_a_pilot_is_bounded_by_that_of_the_spec():
    at, text = planner(), "campaign={block: 60, pilot: {samples: 30, power: 0.1}}"
    rules = build_rules(parse_spec(SPEC, overrides=[text]))
    plan = at.plan(rules, stands(at, [1e-3, -0.1]), 30, 1, None)
    wanted = solve(parse_spec(SPEC, overrides=["campaign=null"])).result["cost"]
    assert np.mean(plan.applied**2) <= 10 * wanted * (1 + 1e-6)
