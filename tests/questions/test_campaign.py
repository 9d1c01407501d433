"""Campaigns: the division of an experiment, the model after each part, and the cost of the next part."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli import parse_spec, simulate, solve
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.identification import identify, information_of_data
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.campaign.build import build_campaign, build_planner, build_rules
from inputdesign_cli.questions.campaign.directory import continued
from inputdesign_cli.questions.campaign.plans import standing
from inputdesign_cli.questions.campaign.schedule import Standing
from inputdesign_cli.records import Record
from tests.support.campaigns import SPEC, planner, record, stands


@pytest.mark.parametrize(
    ("campaign", "takes"),
    [
        ("{block: 50}", [20, 50, 50, 50, 30, 50, 50]),
        ("{block: 50, pilot: 10, max_samples: 230}", [10, 50, 50, 50, 40, 30, 0]),
        ("{stages: [50, 90, 60]}", [50, 90, 60, 60, 60]),
        ("{pilot: {samples: 30, power: 1.0}}", [30] + 10 * [20] + [20, 20]),
    ],
)
def test_parts_have_the_lengths_of_block_pilot_and_stages(campaign, takes):
    schedule = build_rules(parse_spec(SPEC, overrides=[f"campaign={campaign}"])).schedule
    done, found = 0, []
    for _ in takes:
        found.append(schedule.take(done))
        # A plan covers all remaining samples, and at least its first part.
        assert schedule.rest(done) == max(schedule.samples - done, found[-1])
        done += found[-1]
    assert found == takes
    if done == schedule.most:
        assert schedule.looks == np.count_nonzero(takes)


@pytest.mark.parametrize(
    ("campaign", "done", "take"),
    [
        ("{stages: [50, 90, 60]}", 49, 91),  # one sample of the first stage was not recorded
        ("{stages: [50, 90, 60]}", 40, 10),
        ("{stages: [50, 90, 60]}", 198, 60),
        ("{block: 50}", 199, 50),
        ("{block: 50}", 190, 10),
        ("{block: 50, max_samples: 201}", 199, 2),
    ],
)
def test_a_short_remainder_is_added_to_the_next_part(campaign, done, take):
    """A part of one sample would have to give all the missing information."""
    schedule = build_rules(parse_spec(SPEC, overrides=[f"campaign={campaign}"])).schedule
    assert schedule.take(done) == take <= schedule.rest(done)


def test_the_information_of_data_is_the_sum_of_gradient_products_at_any_model():
    u, y = record()
    model = planner().nominal.model
    for theta in ([3.6, -0.7], [3.2, -0.5]):
        at = model.at(np.array(theta), np.array([[1.7]]))
        b, f = theta
        # The derivatives of y = b u(t-1) / (1 + f q^-1) by hand.
        gradient = np.array(
            [lfilter([0, 1], [1, f], u[:, 0]), lfilter([0, 0, -b], np.convolve([1, f], [1, f]), u[:, 0])]
        )
        wanted = gradient @ gradient.T / 1.7
        assert np.allclose(information_of_data(at, u, y), wanted, rtol=1e-10)
    found = identify(model, u, y, rest=True)
    assert np.allclose(
        information_of_data(model.at(found.theta, found.noise), u, y), found.information, rtol=1e-6
    )


def test_a_plan_is_the_ordinary_design_with_the_data_as_prior():
    u, y = record(40)
    at, rules = planner(), build_rules(parse_spec(SPEC))
    model = at.nominal.model.at(np.array([3.4, -0.73]), np.array([[1.2]]))
    known = standing(at, model, lambda m: information_of_data(m, u, y), at.nominal.model)
    assert known.share == 1.0
    plan = at.plan(rules, known, 80, 5, None)
    changes = {
        "plant": {"B": [0, 3.4], "F": [1, -0.73]},
        "noise": {"variance": 1.2},
        "experiment": {"samples": 120, "prior": {"information": known.information.tolist()}},
        "campaign": None,
    }
    by_hand = solve(parse_spec(SPEC, overrides=[f"{key}={json.dumps(x)}" for key, x in changes.items()]))
    assert plan.cost == pytest.approx(by_hand.result["objective"]["value"], rel=1e-6)
    assert plan.take == 60
    assert len(plan.record) == 120
    by_hand = solve(
        parse_spec(
            by_hand.resolved_spec,
            overrides=["signal.seed=5", "signal.scale=design", "solver.any_spectrum=false"],
        )
    )
    assert np.allclose(by_hand.signal, plan.record)
    # The stored claim of the plan has the bound and the spectrum of the result.
    wanted, kept = by_hand.outcome, plan.claim()
    assert kept.objective.lower_bound == pytest.approx(wanted.objective.lower_bound, rel=1e-9)
    assert kept.objective.lower_bound <= kept.objective.value * (1 + 1e-9)
    coefficients = [one.spectrum.details["coefficients"] for one in (kept, wanted)]
    assert coefficients[0] == pytest.approx(coefficients[1], rel=1e-9)
    # The ratio of the data is that of the design with the prior alone.
    question = at.question(model, known.information)
    assert question.ratio(question.information) == pytest.approx(known.ratio)


def test_the_last_part_is_planned_robustly_if_campaign_last_is_robust():
    spec = parse_spec(SPEC, overrides=["uncertainty={intervals: {b1: [3, 4]}, scenarios: 10, fresh: 0}"])
    at = build_planner(spec)
    known = stands(at, share=0.2, samples=150)
    costs = {}
    for last in ("robust", "nominal"):
        rules = build_rules(spec.with_(**{"campaign.last": last}))
        assert at.plan(rules, known, 80, 5, None).kind == "nominal"  # more parts follow
        plan = at.plan(rules, known, 150, 5, None)
        assert plan.kind == last
        costs[last] = plan.cost
    assert costs["robust"] > costs["nominal"]
    # A plan beyond the cap gets longer, so that a later part may still be robust.
    rules = build_rules(spec.with_(**{"campaign.power_cap": 1.0}))
    plans = [at.plan(rules, known, 150, 5, cap) for cap in (sum(costs.values()) / 2, costs["nominal"] / 2)]
    assert [(plan.kind, len(plan.record) > plan.take, plan.fragile) for plan in plans] == [
        ("nominal", False, True),
        ("nominal", True, False),
    ]


COLOURED = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.1}, standard_deviation: {c1: 0.03}}
spectrum: {type: fir, order: 4}
signal: {candidates: 1}
campaign: {stages: [100, 200], max_samples: 500}
"""


@pytest.mark.slow
def test_a_stopgap_part_is_planned_where_no_power_is_enough():
    """The noise alone gives var c1 = (1 - c1^2) / N: with c1 = 0 it takes 1111 samples at any power."""
    at, rules = planner(COLOURED), build_rules(parse_spec(COLOURED))
    first = at.plan(rules, None, 0, 5, None)
    assert first.kind == "nominal"
    known = stands(at, [3.6, 0.0, -0.7], samples=100)
    plan = at.plan(rules, known, 100, 5, first.cost)
    assert (plan.kind, plan.claim, plan.take) == ("stopgap", None, 200)
    assert "no power is enough" in plan.why
    assert plan.cost == pytest.approx(first.cost)
    assert np.mean(plan.record**2) == pytest.approx(first.cost, rel=1e-9)  # the cost is the input power
    half = at.plan(
        build_rules(parse_spec(COLOURED, overrides=["campaign.power_cap=0.5"])), known, 100, 5, 2.0
    )
    assert half.cost == pytest.approx(1.0)


def test_an_unstable_estimate_is_shrunk_towards_the_last_stable_one():
    u, y = record()
    at = planner()
    last = at.nominal.model
    wild = last.at(np.array([3.0, -1.05]))
    found = standing(at, wild, lambda m: information_of_data(m, u, y), last)
    assert 0.0 < found.share < 1.0
    assert found.model.radius <= at.farthest
    expected = last.theta + found.share * (wild.theta - last.theta)
    assert np.allclose(found.model.theta, expected)
    assert not Standing(found.model, found.information, 0.5, found.share).met  # it never counts as met


def test_records_with_consecutive_times_are_joined():
    units = Units("s", 0.5, True, False, 1, 1)
    times = np.concatenate([0.5 * np.arange(4), 0.5 * np.arange(4, 7), 0.5 * np.arange(3)])
    signal = np.zeros((10, 1))
    data = Record(signal, signal, None, times, (4, 3, 3), (("a", 4), ("b", 3), ("c", 3)))
    assert continued(data, units.sample_time).lengths == (7, 3)


@pytest.mark.slow
def test_simulated_campaigns_are_compared_with_one_shot_white_and_oracle():
    text = SPEC + "simulation: {runs: 2, seed: 2, compare: [white], plant: {B: [0, 3.2], F: [1, -0.75]}}\n"
    overrides = [
        "signal.candidates=1",
        "campaign={stages: [60, 140]}",
        "uncertainty={intervals: {b1: [3, 4]}, scenarios: 3, fresh: 0}",
    ]
    results = simulate(parse_spec(text, overrides=overrides))
    told = results.result["simulation"]
    assert list(told["inputs"]) == ["campaign", "one_shot", "one_shot_robust", "white"]
    for entry in told["inputs"].values():
        assert sum(entry[key] for key in ("stopped", "missed", "undecided", "unplanned")) == 2
        low, high = entry["within_r_adm_true_limits"]
        assert low <= entry["within_r_adm_true"] <= high
    campaign = told["inputs"]["campaign"]
    assert campaign["samples"]["mean"] >= 60
    # The oracle is the design that knows the true plant.
    known = ["signal.candidates=1", "campaign=null", "plant={B: [0, 3.2], F: [1, -0.75]}"]
    solved = solve(parse_spec(SPEC, overrides=known))
    truth, applied = solved.result, solved.tables["signal"].columns["u1"]
    assert told["oracle_cost"] == pytest.approx(truth["cost"], rel=1e-6)
    assert campaign["cost_over_oracle"]["mean"] == pytest.approx(
        campaign["energy"]["mean"] / (200 * truth["cost"]), rel=1e-6
    )
    # The oracle also has a record, whose cost is its mean square.
    assert told["oracle_record_cost"] == pytest.approx(np.mean(applied**2), rel=1e-9)
    assert campaign["cost_over_oracle_record"]["mean"] == pytest.approx(
        campaign["energy"]["mean"] / np.sum(applied**2), rel=1e-9
    )
    # The first part has 60 samples, later ones 140 or less; an experiment in one shot is one part.
    later = (campaign["samples"]["mean"] - 60) / 140
    assert later <= campaign["parts"]["mean"] - 1.0 < later + 1.0
    assert [told["inputs"][way]["parts"]["mean"] for way in ("one_shot", "white")] == [1.0, 1.0]
    # The numbers in campaigns.csv have these names.
    table, numbers = results.tables["campaigns"].columns, told["numbers"]
    for way, name in enumerate(numbers["way"]):
        ended = table["status"][table["way"] == way]
        for status, ending in enumerate(numbers["status"]):
            assert np.sum(ended == status) == told["inputs"][name][ending]
    # An experiment in one shot costs about as much as its design states.
    shot = told["inputs"]["one_shot"]
    assert shot["samples"]["mean"] == 200
    assert shot["energy"]["mean"] == pytest.approx(200 * results.result["cost"], rel=0.3)
    figures = draw_all(results)
    assert {"true_ratio.png", "cost_coverage.png"} <= figures.keys()


def test_one_shot_and_campaign_begin_with_the_same_pilot():
    spec = parse_spec(SPEC, overrides=["campaign={block: 50, pilot: {samples: 30, power: 0.1}}"])
    ways = build_campaign(spec).ways
    assert ways["one_shot"].schedule.parts == (30, 200)
    assert ways["campaign"].schedule.samples == 230


@pytest.mark.slow
def test_campaigns_from_a_wrong_nominal_model_keep_their_coverage_at_less_cost():
    """The spec has a pole at 0.5 instead of 0.7; an experiment in one shot costs more."""
    text = SPEC.replace("-0.7", "-0.5") + "simulation: {runs: 40, plant: {B: [0, 3.6], F: [1, -0.7]}}\n"
    told = simulate(parse_spec(text, overrides=["campaign={block: 20, last: nominal}"])).result["simulation"]
    campaign, shot = told["inputs"]["campaign"], told["inputs"]["one_shot"]
    assert campaign["within_r_adm_true_limits"][1] >= 0.95
    assert campaign["cost_over_oracle"]["mean"] < shot["cost_over_oracle"]["mean"]


def test_a_plan_beyond_the_power_cap_is_made_longer_and_finally_weaker():
    at = planner()
    known = stands(at, share=0.01)
    rules = build_rules(parse_spec(SPEC, overrides=["campaign.power_cap=0.5"]))
    free = at.plan(rules, known, 60, 5, None)
    assert len(free.record) == 140
    longer = at.plan(rules, known, 60, 5, free.cost)
    assert not longer.capped
    assert longer.cost <= 0.5 * free.cost * (1 + 1e-6)
    # With white noise at the output only the energy counts.
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
def test_no_estimate_makes_a_part_cost_more_than_the_cap(name, block, cost):
    """At the plant of the spec a part costs at most 0.7 times the first plan; 7 times with output power."""
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
    """Mean of u^2 + 2 y^2 from `start` on for u = r - C y, y = -a y(t-1) + b u(t-1), by hand."""
    u, y, v = np.zeros(len(r)), np.zeros(len(r)), 0.0
    for t in range(len(r)):
        if t:
            y[t] = -a * y[t - 1] + b * u[t - 1]
        v += 0.5 * y[t] - 0.4 * (y[t - 1] if t else 0.0)
        u[t] = r[t] - v
    return np.mean(u[start:] ** 2 + 2.0 * y[start:] ** 2)


def test_parts_in_a_loop_keep_the_power_cap_at_the_estimate_and_tenfold_at_the_spec():
    """The cost includes the transients of earlier parts."""
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


def test_transients_of_earlier_parts_beyond_the_cap_are_reported():
    at, rules = planner(IN_A_LOOP), build_rules(parse_spec(IN_A_LOOP))
    first = at.plan(rules, None, 0, 1, None)
    before = np.full((40, 1), 20.0 * np.sqrt(first.cost))
    plan = at.plan(rules, stands(at, share=0.05), 40, 2, first.cost, before)
    whole = np.concatenate([before, plan.applied])[:, 0]
    assert plan.beyond
    assert plan.part_cost == pytest.approx(spent_in_the_loop(whole, -0.9, 0.5, 40), rel=1e-9)
    assert spent_in_the_loop(plan.applied[:, 0], -0.9, 0.5, 0) <= 0.4 * first.cost * (1 + 1e-9)


def test_the_first_plan_after_a_pilot_has_at_most_ten_times_the_nominal_cost():
    at, text = planner(), "campaign={block: 60, pilot: {samples: 30, power: 0.1}}"
    rules = build_rules(parse_spec(SPEC, overrides=[text]))
    plan = at.plan(rules, stands(at, [1e-3, -0.1]), 30, 1, None)
    wanted = solve(parse_spec(SPEC, overrides=["campaign=null"])).result["cost"]
    assert np.mean(plan.applied**2) <= 10 * wanted * (1 + 1e-6)
