"""`uncertainty`: designs for every plant that the true one might be."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.errors import SpecError
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.report.facts import facts
from inputdesign_cli.report.question import read_question
from inputdesign_cli.report.sources import assumptions, citations
from inputdesign_cli.tasks.build.convex import build_convex
from inputdesign_cli.tasks.build.task import build_task
from inputdesign_cli.tasks.robust import Batch, tried_on

FIRST = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.02}}
spectrum: {type: fir, order: 6}
signal: {candidates: 1, seed: 1}
"""
LOOP = """
plant: {B: [0, 0.5], F: [1, -0.8]}
noise: {variance: 1.0}
experiment: {samples: 500, controller: {numerator: [0.4], denominator: [1, -0.95]}}
cost: {input_power: 1, output_power: 1}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 6}
signal: {candidates: 1, seed: 1}
"""
TWO = """
plant: {A: [[1, -0.7], [1, 0.4]], B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]]}
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.2}}
spectrum: {type: fir, order: 3}
signal: {candidates: 1, seed: 1}
solver: {any_spectrum_tolerance: 0.009}
"""
PROCESS = """
sample_time: 1
plant: {continuous: {gain: 2, time_constant: 10, dead_time: 2}, sample: zoh}
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""
PHYSICAL = """
sample_time: 1
plant:
  parameters: {K: 2, T: 15}
  continuous: {numerator: ["sqrt(K)/(T - 5)"], denominator: ["T", 1]}
  sample: zoh
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""
COVARIANCE = "[[0.01, 0, 0], [0, 0.001, 0], [0, 0, 0.0004]]"


def solved(text, *overrides):
    return solve(parse_spec(text, overrides=list(overrides))).result


def complaint(text, *overrides):
    with pytest.raises(SpecError) as caught:
        build_task(parse_spec(text, overrides=list(overrides)))
    return caught.value.diagnostics[0]


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        (FIRST, ()),
        (FIRST, ("limits={output_power: 1}", "objective=best_accuracy")),
        (FIRST, ("limits={output_power: 1}", "objective=shortest_experiment")),
        (FIRST, ("accuracy={criterion: D, standard_deviation: {f1: 0.02}}", "limits={input_power: 1}")),
        (LOOP, ()),
        (LOOP, ("accuracy={model_error: {sensitivity: {max_db: 9}}}", "uncertainty.cost=mean")),
        (TWO, ("limits={output_power: [200, 200]}",)),
        (TWO, ("accuracy={criterion: A, scale: relative}", "limits={input_power: [1, 2]}")),
    ],
)
def test_copies_of_the_plant_change_nothing(text, asked):
    """Whatever is asked, in a loop and with several channels."""
    (name, value) = ("f1", -0.8) if text is LOOP else ("f1", -0.7) if text is FIRST else ("b1[1,1]", 1.0)
    scenarios = f"uncertainty={{scenarios: [{{'{name}': {value}}}, {{'{name}': {value}}}]}}"
    robust = [one for one in asked if one.startswith("uncertainty")]
    once = solved(text, *(one for one in asked if one not in robust))
    again = solved(text, scenarios, *asked)
    assert again["objective"]["value"] == pytest.approx(once["objective"]["value"], rel=1e-6)
    assert again["cost"] == pytest.approx(once["cost"], rel=1e-5)
    assert again["robust"]["worst_share"] == pytest.approx(1.0, abs=1e-3)  # a whole number of samples


def test_a_plant_that_asks_for_more_sets_the_cost():
    alone = solved(FIRST.replace("-0.7", "-0.5"))
    both = solved(FIRST, "uncertainty={scenarios: [{f1: -0.5}]}")
    nominal = solved(FIRST)
    assert both["cost"] >= max(alone["cost"], nominal["cost"]) * (1 - 1e-7)
    assert both["robust"]["active"][0]["parameters"]["f1"] == -0.5
    assert both["robust"]["active"][0]["scenario"] == 1
    assert "fresh" not in both["robust"]


def test_limits_hold_at_every_plant():
    """The power of the output is that of the plant that answers most."""
    asked = ("limits={output_power: 5}", "objective=best_accuracy")
    robust = solve(parse_spec(FIRST, overrides=[*asked, "uncertainty={scenarios: [{f1: -0.9}]}"]))
    design = build_convex(
        parse_spec(FIRST, overrides=[*asked, "uncertainty={scenarios: [{f1: -0.9}]}"])
    ).designed()[0]
    powers = [design.problem.power("output", None, s).at(design.design.result.x) for s in (0, 1)]
    assert powers[1] == pytest.approx(5.0, rel=1e-6)
    assert powers[0] < 4.0
    (limit,) = robust.result["limits"]
    assert limit["binding"]
    assert limit["value"] == pytest.approx(5.0, rel=1e-6)


def test_the_cost_is_that_of_the_nominal_plant_or_the_mean():
    scenarios = "uncertainty={scenarios: [{f1: -0.75}, {f1: -0.85}], cost: %s}"
    for cost in ("nominal", "mean"):
        found = build_convex(parse_spec(LOOP, overrides=[scenarios % cost])).designed()[0]
        at, x = found.problem, found.design.result.x
        paid = [sum(at.power(kind, None, s).at(x) for kind in ("input", "output")) for s in range(3)]
        expected = paid[0] if cost == "nominal" else np.mean(paid)
        assert found.design.result.objective == pytest.approx(expected, rel=1e-9)
    assert solved(LOOP, scenarios.replace(", cost: %s", ""))["robust"]["cost"] == "mean"


@pytest.mark.parametrize(
    "prior",
    [
        f"covariance: {COVARIANCE}",
        "information: [[100, 0, 0], [0, 1000, 0], [0, 0, 2500]]",
        "covariance: [[0.01, 0], [0, 0.0004]], parameters: [b1, f1]",
        "intervals: {b1: [3.3, 3.9], f1: [-0.75, -0.65]}",
    ],
)
def test_plants_are_drawn_from_what_is_known(prior):
    spec = parse_spec(FIRST, overrides=[f"uncertainty={{{prior}, scenarios: 150}}"])
    thetas = build_convex(spec).plants.batch.thetas
    assert thetas.shape == (150, 3)
    mean, spread = thetas.mean(axis=0), thetas.std(axis=0)
    assert mean == pytest.approx([3.6, -0.9, -0.7], abs=0.03)
    b1, c1, f1 = (0.1, 0.0316, 0.02) if "intervals" not in prior else (0.1732, 0.0, 0.02887)
    assert spread == pytest.approx([b1, 0.0 if "b1, f1" in prior else c1, f1], rel=0.2)
    again = build_convex(spec).plants.batch.thetas
    np.testing.assert_array_equal(thetas, again)


def test_a_record_and_a_model_file_tell_how_well_the_plant_is_known(tmp_path):
    rng = np.random.default_rng(1)
    np.savetxt(tmp_path / "first.csv", rng.normal(size=400), header="u", comments="")
    (tmp_path / "model.yaml").write_text(
        "estimate: {parameters: {b1: 3.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    )
    for asked in ("information: first.csv", "covariance: model.yaml", "information: model.yaml"):
        spec = parse_spec(FIRST, overrides=[f"uncertainty={{{asked}, scenarios: 100}}"], folder=tmp_path)
        thetas = build_convex(spec).plants.batch.thetas
        if "model" in asked:
            assert thetas.std(axis=0) == pytest.approx([0.1, 0.0316, 0.02], rel=0.2)
        else:
            # White input of power one: the variance of b1 is about that of a mean of 400 samples or more.
            assert 0.02 < thetas[:, 0].std() < 0.2
    moved = "estimate: {parameters: {b1: 4.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    (tmp_path / "model.yaml").write_text(moved)
    spec = parse_spec(FIRST, overrides=["uncertainty={covariance: model.yaml}"], folder=tmp_path)
    with pytest.raises(SpecError, match=r"b1 is 4\.6 there and 3\.6 here"):
        build_task(spec)


def test_the_risk_sets_the_number_of_plants():
    for order, risk, number in ((10, 0.1, 235), (6, 0.2, 85)):
        asked = f"uncertainty={{covariance: {COVARIANCE}, risk: {risk}}}"
        spec = parse_spec(FIRST, overrides=[asked, f"spectrum.order={order}"])
        assert len(build_convex(spec).plants.batch.plants) == number


@pytest.mark.parametrize(
    ("text", "intervals", "name"),
    [(PROCESS, "dead_time: [-1, 4]", "dead_time"), (PHYSICAL, "K: [-1, 3]", "K")],
)
def test_what_is_no_plant_is_drawn_again_and_counted(text, intervals, name):
    """A fifth of the interval is a negative dead time; the root of a negative number is no gain."""
    prior = f"uncertainty={{intervals: {{{intervals}}}, scenarios: 40, seed: 1}}"
    batch = build_convex(parse_spec(text, overrides=[prior])).plants.batch
    assert len(batch.plants) == 40
    assert 2 <= batch.rejected <= 25
    index = batch.plants[0].experiment.model.names.index(name)
    assert np.all(batch.thetas[:, index] >= 0.0)


def test_unstable_loops_are_drawn_again_and_counted():
    """In this loop f1 < -1.02 or so is unstable."""
    prior = "intervals: {f1: [-1.2, -0.6]}, scenarios: 60, seed: 3"
    batch = build_convex(parse_spec(LOOP, overrides=[f"uncertainty={{{prior}}}"])).plants.batch
    assert len(batch.plants) == 60
    assert batch.rejected > 0
    for plant in batch.plants:
        assert np.abs(plant.experiment.loop.closed_poles).max() < 0.9981


def test_fresh_draws_are_missed_no_more_often_than_wait_and_judge_says():
    found = solved(FIRST, f"uncertainty={{covariance: {COVARIANCE}, scenarios: 40, fresh: 120}}")
    robust = found["robust"]
    assert robust["worst_share"] == pytest.approx(1.0, abs=1e-6)
    assert robust["fresh"]["draws"] == 120
    low, high = robust["fresh"]["limits"]
    assert low <= robust["fresh"]["share"] <= high
    assert robust["fresh"]["share"] <= robust["risk"]["after"] <= robust["risk"]["before"]
    assert found["cost"] > 1.05 * solved(FIRST)["cost"]


def test_leaving_out_the_dearest_plants_makes_it_cheaper():
    prior = f"covariance: {COVARIANCE}, scenarios: 30, fresh: 10"
    whole = solve(parse_spec(FIRST, overrides=[f"uncertainty={{{prior}}}"]))
    fewer = solve(parse_spec(FIRST, overrides=[f"uncertainty={{{prior}, discard: 0.1}}"]))
    assert fewer.result["robust"]["discarded"] == 3
    assert fewer.result["cost"] < 0.99 * whole.result["cost"]
    assert "risk" not in fewer.result["robust"]
    assert len(fewer.tables["scenarios"].columns["scenario"]) == 27
    before, after = (found.tables["scenarios"].columns["scenario"] for found in (whole, fewer))
    gone = set(before) - set(after)
    assert whole.result["robust"]["active"][0]["scenario"] in gone


def test_r_adm_has_a_floor_where_it_vanishes_at_a_plant():
    """The sensitivity of the scenario's own loop misses what is asked: without a floor nothing would do."""
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 9}")
    plant = "uncertainty={scenarios: [{f1: -0.85, b1: 0.9}]%s}"
    assert solved(text, plant % "")["robust"]["worst_share"] == pytest.approx(1.0, abs=1e-6)
    assert complaint(text, plant % ", floor: 0").code == "admissible-not-positive"
    fixed = solved(text, plant % ", r_adm: fixed")
    assert fixed["cost"] < solved(text, plant % "")["cost"]


@pytest.mark.parametrize(
    ("text", "stated", "code", "key"),
    [
        (FIRST, "scenarios: [{f1: -0.6}, {a1: 0.3}]", "unknown-parameter", "uncertainty.scenarios[1]"),
        (FIRST, "scenarios: [{f1: -1.6}]", "no-stable-plant", "uncertainty.scenarios[0]"),
        (FIRST, "scenarios: [{f1: -1.0}]", "no-stable-plant", "uncertainty.scenarios[0]"),
        (FIRST, "scenarios: [{c1: 1.0}]", "no-stable-plant", "uncertainty.scenarios[0]"),
        (PROCESS, "scenarios: [{time_constant: 1.0e-3, dead_time: 2.0}]", "without-effect", "uncertainty"),
        (FIRST, "scenarios: [{b1: 3}, {b1: 0}]", "not-a-plant", "uncertainty.scenarios[1]"),
        (PROCESS, "scenarios: [{gain: 0}]", "not-a-plant", "uncertainty.scenarios[0]"),
        (PROCESS, "scenarios: [{time_constant: 0}]", "not-a-plant", "uncertainty.scenarios[0]"),
        (PROCESS, "scenarios: [{dead_time: -1.0e-3}]", "not-a-plant", "uncertainty.scenarios[0]"),
        (PHYSICAL, "scenarios: [{K: -1}]", "not-a-plant", "uncertainty.scenarios[0]"),
        (PHYSICAL, "scenarios: [{T: 5}]", "not-a-plant", "uncertainty.scenarios[0]"),
        (FIRST, "covariance: [[1, 0], [0, 1]]", "wrong-shape", "uncertainty.covariance"),
        (FIRST, "covariance: [[1, 0], [0, 1]], parameters: [b1, b9]", "unknown-parameter",
         "uncertainty.covariance"),
        (FIRST, "information: [[1, 0, 0], [0, 0, 0], [0, 0, 1]]", "not-positive-definite",
         "uncertainty.information"),
        (LOOP, "intervals: {b1: [-90, -30], f1: [-0.9, -0.7]}", "bad-interval", "uncertainty.intervals.b1"),
        (LOOP, "covariance: [[1.0e+4, 0], [0, 1]]", "no-stable-plant", "uncertainty"),
        (LOOP, "covariance: [[1, 0], [0, 1]], stable_within: 0.5", "no-stable-plant",
         "uncertainty.stable_within"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_said(text, stated, code, key):
    found = complaint(text, f"uncertainty={{{stated}}}")
    assert (found.code, found.key) == (code, key)
    assert found.hint


@pytest.mark.parametrize(
    ("stated", "code"),
    [
        ("seed: 3", "missing-key"),
        (f"covariance: {COVARIANCE}, intervals: {{b1: [1, 5]}}", "conflicting-keys"),
        (f"covariance: {COVARIANCE}, scenarios: [{{b1: 3}}]", "conflicting-keys"),
        ("scenarios: [{b1: 3}], risk: 0.1", "conflicting-keys"),
        (f"covariance: {COVARIANCE}, scenarios: 10, risk: 0.1", "conflicting-keys"),
        ("covariance: [[1, 2], [2, 1]]", "not-positive-definite"),
        ("intervals: {b1: [4, 3]}", "bad-interval"),
        (f"covariance: {COVARIANCE}, scenarios: 5000", "too-large"),
        (f"covariance: {COVARIANCE}, discard: 0.7", "out-of-range"),
    ],
)
def test_what_contradicts_itself_is_said(stated, code):
    with pytest.raises(SpecError) as caught:
        parse_spec(FIRST, overrides=[f"uncertainty={{{stated}}}"])
    assert code in {found.code for found in caught.value.diagnostics}


@pytest.mark.parametrize(
    "overrides",
    [
        ["spectrum={given: {type: white, power: 1}}"],
        ["solver.method=lmi"],
        ["accuracy={criterion: D}", "limits={input_power: 1}",
         "spectrum={type: polynomial, order: 4, band: [0, 3], factor_columns: 1}"],
        ["accuracy={model_error: {relative: 0.1, region: ellipsoid}}", "uncertainty.r_adm=fixed"],
        ["accuracy={model_error: {relative: 0.1, confidence: {exact: 0.95}}}"],
    ],
)  # fmt: skip
def test_what_is_not_made_robust_is_said(overrides):
    found = complaint(FIRST, "uncertainty={scenarios: [{b1: 3}]}", *overrides)
    assert (found.code, found.key) == ("not-supported", "uncertainty")


def test_the_flexible_transmission_is_missed_by_the_wrong_bound():
    """The design on the initial estimate, on the true plant: by its own r_adm, and that of the estimate."""
    path = "specs/flexible_transmission.yaml"
    true = [
        "plant={A: [1, -1.99185, 2.20265, -1.84083, 0.89413], B: [0, 0, 0, 0.10276, 0.18123]}",
        "noise.variance=0.5",
    ]
    nominal = build_convex(load_spec(path))
    oracle = build_convex(load_spec(path, true)).question
    assert solve_design(oracle, tolerance=1e-7).result.objective == pytest.approx(7.7804, abs=1e-3)
    design = solve_design(nominal.question, tolerance=1e-7)
    own = Alternative(oracle.experiment, oracle.requirements)
    estimated = replace(own, requirements=nominal.question.requirements)
    by_own, by_estimate = tried_on(design, 500, Batch(np.zeros((2, 6)), (own, estimated), 2))
    assert by_own.share == pytest.approx(1.02, abs=0.02)
    assert by_estimate.share == pytest.approx(1.86, abs=0.02)
    assert by_estimate.frequency == pytest.approx(0.390, abs=2e-3)


@pytest.mark.parametrize("asked", [(), ("limits={input_power: 1}", "objective=best_accuracy")])
def test_the_record_serves_every_plant_by_its_own_samples(asked):
    prior = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 20, fresh: 5}}"
    spec = parse_spec(FIRST, overrides=[prior, *asked])
    found = solve(spec)
    samples = found.tables["signal"].columns["u1"][:, None]
    ratios = []
    for plant in build_convex(spec).question.plants:
        scenario = plant.at(plant.experiment.whitened(1.0))
        told = FiniteRecord(scenario.experiment, len(samples)).information(samples)
        ratios.append(scenario.requirements[0].worst(told).ratio)
    assert max(ratios) == pytest.approx(found.result["signal"]["worst_ratio"], rel=1e-9)
    assert max(ratios) > ratios[0]
    if not asked:
        assert max(ratios) <= 1.0 + 1e-9


def test_the_fan_shows_every_plant_and_names_those_that_bind():
    found = solve(
        parse_spec(TWO, overrides=["uncertainty={scenarios: [{'b1[1,1]': 0.8}, {'b1[1,1]': 1.1}]}"])
    )
    curves, columns = found.curves["fan"], found.tables["fan"].columns
    assert curves.ratios.shape == (2, curves.frequency.size)
    np.testing.assert_allclose(columns["largest"], np.maximum(curves.ratios.max(axis=0), curves.nominal))
    assert columns["largest"].max() == pytest.approx(1.0, abs=1e-3)
    names = {f"plant {item['scenario']}" for item in found.result["robust"]["active"] if item["scenario"]}
    assert set(curves.active) == names
    assert draw_all(found)["fan.png"].startswith(b"\x89PNG")


def test_what_is_said_is_said_under_the_prior():
    found = solve(
        parse_spec(FIRST, overrides=[f"uncertainty={{covariance: {COVARIANCE}, fresh: 20, scenarios: 9}}"])
    )
    lines = {name: (text, note) for name, text, note in facts(found.result, "s")}
    assert lines["plants"][0] == "what is asked holds at the plant of the spec and 9 drawn"
    assert "not of the true plant" in lines["fresh plants"][1]
    question = read_question(found.resolved_spec)
    assert any("9 plants drawn from its covariance" in sentence for sentence in question.sentences)
    assert "true plant" in assumptions(question, found.result)[0]
    assert sum("Campi" in source for source in citations(question, found.result)) == 2


@pytest.mark.parametrize("listed", ["scenarios: [{dead_time: 900}]", "intervals: {dead_time: [1, 5000]}"])
def test_a_dead_time_beyond_the_record_is_refused_at_every_plant(listed):
    text = (
        "sample_time: 1\nplant: {continuous: {gain: 2, time_constant: 10, dead_time: 2}, sample: zoh}\n"
        "noise: {variance: 0.04}\nexperiment: {samples: 500}\naccuracy: {model_error: {relative: 0.1}}\n"
        f"spectrum: {{type: fir, order: 6}}\nuncertainty: {{{listed}}}\n"
    )
    with pytest.raises(SpecError) as caught:
        solve(parse_spec(text))
    assert caught.value.diagnostics[0].code == "delay-beyond-record"
