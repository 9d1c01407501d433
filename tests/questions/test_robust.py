"""`uncertainty`: designs for every plant that the true one might be, and for the worst of a region."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
from scipy.signal import lfilter

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.compute.time_limit import stoppable
from inputdesign_cli.design.convex.demands import Alternative
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.building.uncertainty import build_plants
from inputdesign_cli.questions.common.robust import tried_on
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.questions.least_cost.robust_outcome import robust_result
from tests.support.refusals import code_of
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, TWO, solved


@pytest.mark.first(3)
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
def test_scenarios_that_copy_the_nominal_plant_do_not_change_the_design(text, asked):
    """This holds for several requirements, in a loop and with several channels."""
    (name, value) = ("f1", -0.8) if text is LOOP else ("f1", -0.7) if text is FIRST else ("b1[1,1]", 1.0)
    scenarios = f"uncertainty={{scenarios: [{{'{name}': {value}}}, {{'{name}': {value}}}]}}"
    robust = [one for one in asked if one.startswith("uncertainty")]
    once = solved(text, *(one for one in asked if one not in robust))
    again = solved(text, scenarios, *asked)
    assert again["objective"]["value"] == pytest.approx(once["objective"]["value"], rel=1e-6)
    assert again["cost"] == pytest.approx(once["cost"], rel=1e-5)
    assert again["robust"]["worst_share"] == pytest.approx(1.0, abs=1e-3)  # a whole number of samples


def test_limits_on_powers_bind_design_and_record_at_every_plant():
    """The slower plant has the larger output power; records of several seeds keep its limit."""
    asked = ("limits={output_power: 5}", "objective=best_accuracy", "uncertainty={scenarios: [{f1: -0.9}]}")
    design = build_convex(parse_spec(FIRST, overrides=asked)).designed()
    powers = [design.problem.power("output", None, s).at(design.design.result.x) for s in (0, 1)]
    assert powers[1] == pytest.approx(5.0, rel=1e-6)
    assert powers[0] < 4.0
    found = []
    for seed in range(4):
        robust = solve(parse_spec(FIRST, overrides=[*asked, f"signal.seed={seed}"]))
        u = robust.tables["signal"].columns["u1"]
        found.append([np.mean(lfilter([0, 3.6], [1, pole], u) ** 2) for pole in (-0.7, -0.9)])
    (limit,) = robust.result["limits"]
    assert limit["binding"]
    assert limit["value"] == pytest.approx(5.0, rel=1e-6)
    assert max(found)[0] < 4.0
    assert all(slow <= 5.0 * (1 + 1e-9) for _, slow in found)
    assert max(slow for _, slow in found) > 4.99  # the limit is active


def test_the_cost_is_that_of_the_nominal_plant_the_mean_or_the_largest():
    scenarios = "uncertainty={scenarios: [{f1: -0.75}, {f1: -0.85}], cost: %s}"
    of_each = {"nominal": lambda paid: paid[0], "mean": np.mean, "worst": max}
    for cost, of in of_each.items():
        found = build_convex(parse_spec(LOOP, overrides=[scenarios % cost])).designed()
        at, x = found.problem, found.design.result.x
        paid = [sum(at.power(kind, None, s).at(x) for kind in ("input", "output")) for s in range(3)]
        assert found.design.result.objective == pytest.approx(of(paid), rel=1e-9)
    assert solved(LOOP, scenarios.replace(", cost: %s", ""))["robust"]["cost"] == "mean"


@pytest.mark.slow
def test_cost_worst_is_the_largest_cost_of_the_drawn_plants_and_of_most_others():
    """With `cost: worst` a fresh plant also counts as missed if it costs more."""
    prior = "covariance: [[0.001, 0], [0, 4.0e-4]], scenarios: 30, fresh: 60"
    found = solve(parse_spec(LOOP, overrides=[f"uncertainty={{{prior}, cost: worst}}"])).result
    mean = solved(LOOP, f"uncertainty={{{prior}, cost: mean}}")
    robust = found["robust"]
    assert robust["cost"] == "worst"
    assert found["cost"] == pytest.approx(found["objective"]["value"], rel=1e-9)
    assert found["cost"] > 1.05 * mean["cost"]
    assert robust["dearest"]["cost"] == pytest.approx(found["cost"], rel=1e-6)
    assert robust["dearest"]["scenario"] in [one["scenario"] for one in robust["active"]]
    assert robust["fresh"]["share"] <= robust["risk"]["after"]
    assert "dearest" not in mean["robust"]
    assert "less" not in mean["robust"]["fresh"]


def test_fresh_plants_that_miss_accuracy_or_cost_are_counted_separately():
    prior = "uncertainty={covariance: [[0.001, 0], [0, 4.0e-4]], scenarios: 3, fresh: 60, cost: worst}"
    task = build_convex(parse_spec(LOOP, overrides=[prior]))
    done = task.designed()
    tried = [
        one
        for batch in task.asked.plants.afresh()
        for one in tried_on(done.design, done.experiment.samples, batch.plants)
    ]
    less = {n for n, one in enumerate(tried) if one.share > 1.0 + 1e-6}
    dearer = {n for n, one in enumerate(tried) if one.cost > done.design.result.objective * (1 + 1e-6)}
    entry = robust_result(done, done.plants).entry
    assert entry.dearest.cost == pytest.approx(done.design.result.objective, rel=1e-6)
    told = entry.fresh
    assert (told.less, told.dearer, told.missed) == (len(less), len(dearer), len(less | dearer))
    assert less > dearer > set()


def test_discarding_the_most_demanding_plants_lowers_the_cost():
    prior = f"covariance: {COVARIANCE}, scenarios: 15, fresh: 1"
    whole = solve(parse_spec(FIRST, overrides=[f"uncertainty={{{prior}}}"]))
    fewer = solve(parse_spec(FIRST, overrides=[f"uncertainty={{{prior}, discard: 0.2}}"]))
    assert fewer.result["robust"]["discarded"] == 3
    assert fewer.result["cost"] < 0.99 * whole.result["cost"]
    assert "risk" not in fewer.result["robust"]
    assert len(fewer.tables["scenarios"].columns["scenario"]) == 12
    before, after = (found.tables["scenarios"].columns["scenario"] for found in (whole, fewer))
    gone = set(before) - set(after)
    assert whole.result["robust"]["active"][0]["scenario"] in gone


@pytest.mark.slow
def test_r_adm_has_a_floor_where_it_vanishes_at_a_plant():
    """The loop of the scenario itself exceeds the required sensitivity: without a floor no design exists."""
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 9}")
    plant = "uncertainty={scenarios: [{f1: -0.85, b1: 0.9}]%s}"
    assert solved(text, plant % "")["robust"]["worst_share"] == pytest.approx(1.0, abs=1e-6)
    without = parse_spec(text, overrides=[plant % ", floor: 0"])
    assert code_of(build_task, without) == "admissible-not-positive"
    fixed = solved(text, plant % ", r_adm: fixed")
    assert fixed["cost"] < solved(text, plant % "")["cost"]


def test_the_true_flexible_transmission_misses_r_adm_of_the_initial_estimate():
    """At the true plant, r_u of the design is 1.02 of the plant's own r_adm, 1.86 of the estimate's."""
    path = "specs/flexible_transmission.yaml"
    true = [
        "plant={A: [1, -1.99185, 2.20265, -1.84083, 0.89413], B: [0, 0, 0, 0.10276, 0.18123]}",
        "noise.variance=0.5",
    ]
    nominal = build_convex(load_spec(path))
    oracle = build_convex(load_spec(path, true)).asked.question
    assert solve_design(oracle, tolerance=1e-7).result.objective == pytest.approx(7.7804, abs=1e-3)
    design = solve_design(nominal.asked.question, tolerance=1e-7)
    # Its cost at the true plant, by sums in numpy for a design by another program, is 12.444049.
    spectrum, true_plant = design.result, oracle.experiment
    cost = sum(
        spectrum.basis.integrals(lambda w, k=k: true_plant.power_density(k, w), true_plant.singularities)
        @ spectrum.x
        for k in ("input", "output")
    )
    assert cost == pytest.approx(12.444049, rel=1e-5)
    own = Alternative(oracle.experiment, oracle.requirements)
    estimated = replace(own, requirements=nominal.asked.question.requirements)
    by_own, by_estimate = tried_on(design, 500, [own, estimated])
    assert by_own.share == pytest.approx(1.02, abs=0.02)
    assert by_estimate.share == pytest.approx(1.86, abs=0.02)
    assert by_estimate.frequency == pytest.approx(0.390, abs=2e-3)


@pytest.mark.first(1)
@pytest.mark.parametrize("asked", [(), ("limits={input_power: 1}", "objective=best_accuracy")])
def test_the_worst_ratio_of_the_record_is_the_largest_over_all_plants(asked):
    prior = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 20, fresh: 5}}"
    spec = parse_spec(FIRST, overrides=[prior, *asked])
    found = solve(spec)
    samples = found.tables["signal"].columns["u1"][:, None]
    ratios = []
    for plant in build_convex(spec).asked.question.plants:
        scenario = plant.at(plant.experiment.whitened(1.0))
        told = FiniteRecord(scenario.experiment, len(samples)).information(samples)
        ratios.append(scenario.requirements[0].worst(told).ratio)
    assert max(ratios) == pytest.approx(found.result["signal"]["worst_ratio"], rel=1e-9)
    assert max(ratios) > ratios[0]
    if not asked:
        assert max(ratios) <= 1.0 + 1e-9


@pytest.mark.slow
def test_the_fan_of_ratios_shows_every_plant_and_names_the_active_ones():
    found = solve(
        parse_spec(TWO, overrides=["uncertainty={scenarios: [{'b1[1,1]': 0.8}, {'b1[1,1]': 1.1}]}"])
    )
    curves, columns = found.curves["fan"], found.tables["fan"].columns
    assert curves.ratios.shape == (2, curves.frequency.size)
    np.testing.assert_allclose(columns["largest"], np.maximum(curves.ratios.max(axis=0), curves.nominal))
    assert columns["largest"].max() == pytest.approx(1.0, abs=1e-3)
    numbers = {item["scenario"] for item in found.result["robust"]["active"] if item["scenario"]}
    named = [label.split(", ") for label in curves.active]
    assert {label[0] for label in named} == {f"plant {number}" for number in numbers}
    assert all(f"b1[1,1] {(0.8, 1.1)[int(label[0][-1]) - 1]}" in label for label in named)
    assert draw_all(found)["fan.png"].startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize("loop", [False, True])
def test_amplitude_limits_hold_for_the_record_at_every_plant(loop):
    """Filters of plant and controller simulate the output, and in a loop the input."""
    controller = "experiment={samples: 500, controller: {numerator: [0.1], denominator: [1]}}"
    plants, gain = [(3.6, -0.7), (3.6, -0.9), (5.0, -0.8)], 0.1 if loop else 0.0
    scenarios = "uncertainty={scenarios: [{f1: -0.9}, {b1: 5.0, f1: -0.8}]}"
    limits = "limits={amplitude: {input: 0.5, output: 9}}"
    asked = ("objective=best_accuracy", limits, scenarios, *([controller] if loop else []))
    result = solve(parse_spec(FIRST, overrides=asked))
    record = result.tables["signal"].columns["r1" if loop else "u1"]
    peaks = []
    for b, f in plants:  # y = b q^-1 u / (1 + f q^-1), u = r - gain y
        y = lfilter([0, b], [1, f + gain * b], record)
        peaks.append((np.abs(y).max() / 9.0, np.abs(record - gain * y).max() / 0.5))
    assert np.max(peaks) <= 1.0 + 1e-9
    assert np.max(peaks[1:]) > 0.99  # the limit is active at another plant than that of the spec
    assert result.result["signal"]["of_limits"].keys() == {"amplitude.input", "amplitude.output"}


def test_fresh_plants_are_tried_until_the_time_limit():
    """Skipped peaks change neither the misses nor the largest ratio; the time limit keeps the design."""
    asked = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 10, fresh: 60}}"
    done = build_convex(parse_spec(FIRST, overrides=[asked])).designed()
    batches = list(done.plants.afresh())
    shares = [
        one.share for batch in batches for one in tried_on(done.design, done.experiment.samples, batch.plants)
    ]
    whole = robust_result(done, done.plants)
    assert whole.entry.fresh.draws == len(shares) == 60
    assert whole.entry.fresh.missed == sum(share > 1.0 + 1e-6 for share in shares) > 0
    assert whole.entry.fresh.largest == pytest.approx(max(shares), rel=1e-12)
    assert whole.findings == ()
    with stoppable() as stop:

        def ends_after_the_first():
            yield batches[0]
            stop()
            yield batches[1]

        cut = robust_result(done, replace(done.plants, afresh=ends_after_the_first))
    first = len(batches[0].plants)
    assert cut.entry.fresh.draws == first
    assert cut.entry.fresh.missed == sum(share > 1.0 + 1e-6 for share in shares[:first])
    assert [one.code for one in cut.findings] == ["fresh-plants-cut-short"]
    assert cut.findings[0].figures == {"tried": first, "asked": 60}


@pytest.mark.slow
def test_the_worst_ratio_after_the_experiment_at_the_worst_plant_is_predicted():
    """One gain b: r_u is the same everywhere, r_adm a share of |b|, and the estimate is normal."""
    deviation, worst = 0.1, 0.8
    text = """
plant: {B: [0, 1]}
noise: {variance: 4}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.2}}
limits: {input_power: 1}
objective: best_accuracy
spectrum: {type: white}
uncertainty: {intervals: {b1: [0.8, 1.2]}, scenarios: 3, worst_case: 0.95, fresh: 5}
signal: {candidates: 1, seed: 1}
"""
    found = solved(text)["robust"]
    assert found["searched"]["parameters"]["b1"] == pytest.approx(worst)
    assert found["estimates"]["draws"] == 100
    # The 5 % quantile of 100 estimates scatters itself by (q (1 - q)/n)^0.5 over the density, here 0.1031.
    own = 3.0 * np.sqrt(0.05 * 0.95 / 100) / 0.1031
    least, most = (worst - (1.645 + side * own) * deviation for side in (1, -1))
    assert worst / most < found["estimates"]["largest"] < worst / least
    assert "estimates" not in solved(text, "uncertainty.fresh=0")["robust"]


def test_plants_that_are_tried_together_have_the_ratios_of_each_alone():
    """This holds also beside a plant of gain zero, on which the experiment has no information."""
    asked = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 10, fresh: 20}}"
    done = build_convex(parse_spec(FIRST, overrides=[asked])).designed()
    (batch,) = done.plants.afresh()
    alone = [tried_on(done.design, 500, batch.plants[place : place + 1])[0] for place in range(20)]
    together = tried_on(done.design, 500, batch.plants)
    assert [one.share for one in together] == pytest.approx([one.share for one in alone], rel=1e-9)
    model = batch.plants[3].experiment.model
    gone = model.at(np.where(np.array(model.names) == "b1", 1e-200, model.theta))
    plants = list(batch.plants)
    plants[3] = replace(plants[3], experiment=replace(plants[3].experiment, model=gone))
    shares = [one.share for one in tried_on(done.design, 500, plants)]
    assert shares[3] == np.inf
    assert np.delete(shares, 3) == pytest.approx([one.share for one in np.delete(alone, 3)], rel=1e-9)


def test_the_search_finds_the_end_of_an_interval_that_needs_most_power():
    """A faster pole needs more power: the worst case is the design for the end of the interval."""
    found = solved(
        FIRST, "uncertainty={intervals: {f1: [-0.8, -0.5]}, scenarios: 3, fresh: 0, worst_case: 0.95}"
    )
    told = found["robust"]["searched"]
    assert told["proved"] is False
    assert told["region"] == "the intervals"
    assert told["added"] == 1
    assert told["parameters"] == pytest.approx({"b1": 3.6, "c1": -0.9, "f1": -0.5}, abs=1e-12)
    assert told["share"] == pytest.approx(1.0, abs=1e-6)
    at_the_end = solved(FIRST, "uncertainty={scenarios: [{f1: -0.5}]}")
    assert found["cost"] == pytest.approx(at_the_end["cost"], rel=1e-6)
    assert "risk" not in found["robust"]  # the plant was not drawn


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "covariance"), [(FIRST, COVARIANCE), (LOOP, "[[0.001, 0.0003], [0.0003, 4.0e-4]]")]
)
def test_no_plant_of_the_ellipsoid_is_worse_than_the_one_that_the_search_finds(text, covariance):
    """The plants are 200 draws on the boundary of the ellipsoid by other means."""
    overrides = [f"uncertainty={{covariance: {covariance}, scenarios: 5, fresh: 0, worst_case: 0.9}}"]
    spec = parse_spec(text, overrides=overrides)
    task = build_convex(spec)
    done = task.designed()
    share = done.plants.searched.kept.share
    assert share <= 1.0 + 1e-3
    assert done.plants.searched.added >= 1
    covariance = np.array(json.loads(covariance))
    rng, nominal = np.random.default_rng(1), task.simulation.nominal.model.theta
    z = rng.standard_normal((200, nominal.size))
    z /= np.sqrt(np.einsum("ni,ij,nj->n", z, np.linalg.inv(covariance), z))[:, None]
    radius = {2: 4.605170, 3: 6.251389}[nominal.size] ** 0.5  # 90 % quantiles of chi-squared from tables
    plants = build_plants(spec, task.asked.question.experiment, task.asked.question.basis)
    tried = [(theta, plants.region.at(theta)) for theta in nominal + radius * z]
    thetas, alternatives = zip(*[one for one in tried if one[1] is not None], strict=True)
    assert len(thetas) > 150
    shares = [one.share for one in tried_on(done.design, 500, alternatives)]
    assert max(shares) <= share * (1 + 1e-3)
    assert max(shares) > 0.8


PEAKS = """
plant: {B: [0, 1.0], F: [1, -0.8]}
noise: {variance: 0.01}
experiment: {samples: 120}
accuracy: {model_error: {relative: 0.5}}
objective: best_accuracy
limits: {amplitude: {input: 1, output: 2}}
uncertainty: {intervals: {b1: [0.8, 1.2], f1: [-0.85, -0.75]}, scenarios: 4, fresh: 60}
spectrum: {type: fir, order: 4}
signal: {type: multisine, seed: 1, candidates: 1}
solver: {any_spectrum: false}
"""


def peaks(u, plants):
    return [
        np.abs(scipy.signal.lfilter([0.0, b], [1.0, f], u)).max() / 2.0
        for b, f in (plant.experiment.model.theta for plant in plants)
    ]


@pytest.mark.slow
def test_drawn_plants_keep_output_limits_and_fresh_ones_beyond_them_are_counted():
    found = solve(parse_spec(PEAKS))
    u = found.tables["signal"].columns["u1"]
    done = build_convex(parse_spec(PEAKS)).designed()
    assert max(peaks(u, done.plants.batch.plants)) <= 1.0
    others = [size for batch in done.plants.afresh() for size in peaks(u, batch.plants)]
    told = found.result["robust"]["fresh"]["beyond_limits"]
    assert told["largest"] == pytest.approx(max(others), rel=1e-9)
    assert told["draws"] == sum(size > 1.0 + 1e-6 for size in others) > 0


PEAK_DB = 6.0
W = np.linspace(1e-4, np.pi, 40001)
Z = np.exp(1j * W)


def peak(b, f, K, p):
    """The peak of |S| of b q^-1 / (1 + f q^-1) under K / (1 - p q^-1), by the textbook."""
    loop = K / (1.0 - p / Z) * b / Z / (1.0 + f / Z)
    return float(np.max(1.0 / np.abs(1.0 + loop)))


def radius(b, f, K, p):
    """The largest radius of the poles of that loop."""
    return np.max(np.abs(np.roots([1.0, f - p + b * K, -f * p])))


def asked(seed):
    """Spec of random plants with a controller that keeps the margin at the nominal one; peaks; limit."""
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
def test_exactly_the_plants_beyond_the_required_sensitivity_are_reported(seed):
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


REGION = "uncertainty={intervals: {b1: [0.3, 0.9]}, scenarios: 2, fresh: %s}"


def test_fresh_plants_beyond_the_required_sensitivity_are_counted():
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 7.5}")
    robust = solve(parse_spec(text, overrides=[REGION % 30, "solver.any_spectrum=false"])).result["robust"]
    beyond = np.mean([peak(b, -0.8, 0.4, 0.95) > 10 ** (7.5 / 20) for b in np.linspace(0.3, 0.9, 50)])
    assert robust["fresh"]["lost"] == pytest.approx(30 * beyond, abs=8)  # three deviations


@pytest.mark.slow
def test_a_searched_plant_beyond_the_required_sensitivity_is_reported():
    text = LOOP.replace("relative: 0.1", "sensitivity: {max_db: 7.5}")
    region = (REGION % 1).replace("fresh", "worst_case: 0.9, fresh")
    found = solve(parse_spec(text, overrides=[region, "solver.any_spectrum=false"])).result["robust"][
        "searched"
    ]
    assert found["lost"]
    assert found["peak"] == pytest.approx(peak(found["parameters"]["b1"], -0.8, 0.4, 0.95), rel=1e-3)


@pytest.mark.slow
def test_fresh_plants_are_missed_no_more_often_than_the_wait_and_judge_bound():
    found = solved(FIRST, f"uncertainty={{covariance: {COVARIANCE}, scenarios: 40, fresh: 120}}")
    robust = found["robust"]
    assert robust["worst_share"] == pytest.approx(1.0, abs=1e-6)
    assert robust["fresh"]["draws"] == 120
    low, high = robust["fresh"]["limits"]
    assert low <= robust["fresh"]["share"] <= high
    assert robust["fresh"]["share"] <= robust["risk"]["after"] <= robust["risk"]["before"]
    assert found["cost"] > 1.05 * solved(FIRST)["cost"]
