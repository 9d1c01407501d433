"""Plants that `uncertainty` draws or lists, and the accuracy of a given excitation at each of them."""

import itertools

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.least_cost.build import build_convex
from tests.support.refusals import code_of, refusal
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, PHYSICAL, PROCESS as EVERYWHERE

# A dead time between samples gives a zero near -1, where `uncertainty.floor` would set r_adm.
PROCESS = EVERYWHERE.replace("relative: 0.1", "relative: 0.1, band: [0, 0.5]")

WHITE = "spectrum={given: {type: white, power: 3}}"
SINE = "spectrum={given: {type: multisine, frequencies: [0.1, 1.0], amplitudes: [1, 2]}}"


def analysed(text, *overrides):
    return analyse(parse_spec(text, overrides=[WHITE, *overrides, "signal=null"]))


def alone(text, values, *overrides):
    """The worst ratio of the spec with other parameters of its plant."""
    plants = {
        FIRST: lambda b1=3.6, f1=-0.7: f"plant={{B: [0, {b1}], F: [1, {f1}]}}",
        LOOP: lambda b1=0.5, f1=-0.8: f"plant={{B: [0, {b1}], F: [1, {f1}]}}",
        PROCESS: lambda gain=2, time_constant=10, dead_time=2: (
            f"plant={{continuous: {{gain: {gain}, time_constant: {time_constant}, dead_time: {dead_time}}}, "
            "sample: zoh}"
        ),
    }
    return analysed(text, plants[text](**values), *overrides).result["model_error"]["worst_ratio"]


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("text", "given"),
    [
        *itertools.product([FIRST, LOOP], [WHITE, SINE, "signal"]),
        pytest.param(PROCESS, WHITE, marks=pytest.mark.slow),
    ],
)
def test_each_scenario_has_the_worst_ratio_of_a_spec_with_this_plant(text, given, tmp_path):
    if given == "signal":
        name = "r1" if text == LOOP else "u1"
        record = np.random.default_rng(0).choice([-1.0, 1.0], 400)
        np.savetxt(tmp_path / "u.csv", record, header=name, comments="")
        given = f"spectrum={{given: {{signal: {tmp_path / 'u.csv'}}}}}"
    others = [{"b1": 0.4}, {"b1": 0.6, "f1": -0.75}]
    listed = [{"gain": 1.0, "dead_time": 3.5}] if text == PROCESS else others
    found = analysed(text, given, f"uncertainty={{scenarios: {listed}}}")
    expected = [alone(text, values, given) for values in ({}, *listed)]
    table = found.tables["scenarios"].columns
    np.testing.assert_allclose(table["share"], expected[1:], rtol=1e-6)
    robust = found.result["robust"]
    np.testing.assert_allclose(robust["worst_share"], max(expected), rtol=1e-6)
    assert robust["worst_scenario"] == int(np.argmax(expected))
    assert (robust["missed"], found.result["status"]) == (
        sum(x > 1 for x in expected),
        "missed" if max(expected) > 1 else "met",
    )


def test_the_search_over_a_box_finds_its_worst_corner():
    box = {"b1": [3.0, 4.0], "f1": [-0.75, -0.65]}
    stated = f"uncertainty={{intervals: {box}, worst_case: 0.95, scenarios: 5, fresh: 20}}"
    robust = analysed(FIRST, stated).result["robust"]
    corners = [
        alone(FIRST, dict(zip(box, values, strict=True))) for values in itertools.product(*box.values())
    ]
    assert robust["searched"]["share"] == pytest.approx(max(corners), rel=1e-5)
    assert robust["worst_share"] <= robust["searched"]["share"]
    assert robust["fresh"]["largest"] <= robust["searched"]["share"]


def test_discard_leaves_out_the_worst_scenarios():
    stated = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 20, fresh: 0%s}}"
    every = np.sort(analysed(FIRST, stated % "").tables["scenarios"].columns["share"])
    fewer = analysed(FIRST, stated % ", discard: 0.2")
    np.testing.assert_allclose(np.sort(fewer.tables["scenarios"].columns["share"]), every[:16])
    assert fewer.result["robust"]["discarded"] == 4


def test_a_risk_takes_the_fewest_plants_that_detect_it_with_probability_0_999():
    robust = analysed(FIRST, f"uncertainty={{covariance: {COVARIANCE}, risk: 0.2, fresh: 0}}").result[
        "robust"
    ]
    assert 0.8 ** robust["scenarios"] <= 1e-3 < 0.8 ** (robust["scenarios"] - 1)


def test_fresh_plants_that_miss_the_accuracy_are_counted():
    ratio = analysed(FIRST).result["model_error"]["worst_ratio"]
    asked = f"accuracy.model_error.relative={0.02 * ratio}"  # the nominal plant just meets it
    found = analysed(FIRST, asked, "uncertainty={intervals: {b1: [3.0, 4.2]}, scenarios: 2, fresh: 60}")
    fresh = found.result["robust"]["fresh"]
    assert fresh["draws"] == 60
    assert 17 < fresh["missed"] < 43  # half of the gains are smaller, and r_u does not depend on them


@pytest.mark.parametrize("verb", [analyse, solve, simulate])
def test_analyse_solve_and_simulate_evaluate_the_scenarios(verb):
    overrides = [WHITE, "signal=null", "uncertainty={scenarios: [{b1: 3}]}", "simulation={runs: 4, seed: 1}"]
    found = verb(parse_spec(FIRST, overrides=overrides)).result
    assert found["robust"]["scenarios"] == 1
    assert ("simulation" in found) == (verb is simulate)


def test_an_excitation_without_information_on_a_plant_with_scenarios_is_refused():
    """One sinusoid does not determine three coefficients."""
    zero = "plant={B: [0, 1, 1.0, 0.5]}"
    sine = "spectrum={given: {type: multisine, frequencies: [0.3], amplitudes: [1]}}"
    assert (
        code_of(analysed, FIRST, zero, sine, "noise={variance: 1}", "uncertainty={scenarios: [{b2: 0.9}]}")
        == "not-exciting"
    )


def test_a_scenario_with_a_zero_at_the_given_sinusoid_is_named():
    """With b2 = 0, G and the information on f1 vanish at pi/2; the nominal plant is identifiable."""
    text = "plant: {B: [0, 1, 1, 1], F: [1, -0.5], known: [b1, b3]}\nnoise: {variance: 1}\n"
    text += "experiment: {samples: 500}\naccuracy: {standard_deviation: {f1: 0.1}}\n"
    sine = f"spectrum={{given: {{type: multisine, frequencies: [{np.pi / 2}], amplitudes: [1]}}}}"
    found = refusal(lambda: analysed(text, sine, "uncertainty={scenarios: [{b2: 0.9}, {b2: 0}]}"))
    assert (found.code, found.key) == ("not-exciting", "uncertainty")
    assert "b2 = 0, f1 = -0.5" in found.message


def test_the_criterion_of_a_given_excitation_has_its_closed_form():
    """White noise of power 3 into b1 q^-1 without dynamics: M = 3 N / variance."""
    overrides = ["plant={B: [0, 2]}", "noise={variance: 0.5}", "experiment={samples: 50}"]
    for letter, value in {"D": np.log(300.0), "A": -1 / 300, "E": 300.0, "T": 300.0}.items():
        found = analysed(FIRST, *overrides, f"accuracy={{criterion: {letter}}}").result["objective"]
        assert found == {"kind": letter, "value": pytest.approx(value)}


@pytest.mark.first(1)
@pytest.mark.parametrize(
    "prior",
    [
        f"covariance: {COVARIANCE}",
        "information: [[100, 0, 0], [0, 1000, 0], [0, 0, 2500]]",
        "covariance: [[0.01, 0], [0, 0.0004]], parameters: [b1, f1]",
        "intervals: {b1: [3.3, 3.9], f1: [-0.75, -0.65]}",
    ],
)
def test_plants_are_drawn_with_the_stated_mean_and_spread(prior):
    spec = parse_spec(FIRST, overrides=[f"uncertainty={{{prior}, scenarios: 150}}"])
    thetas = build_convex(spec).asked.plants.batch.thetas
    assert thetas.shape == (150, 3)
    mean, spread = thetas.mean(axis=0), thetas.std(axis=0)
    assert mean == pytest.approx([3.6, -0.9, -0.7], abs=0.03)
    b1, c1, f1 = (0.1, 0.0316, 0.02) if "intervals" not in prior else (0.1732, 0.0, 0.02887)
    assert spread == pytest.approx([b1, 0.0 if "b1, f1" in prior else c1, f1], rel=0.2)
    again = build_convex(spec).asked.plants.batch.thetas
    np.testing.assert_array_equal(thetas, again)


def test_a_record_or_a_model_file_sets_the_spread_of_the_plants(tmp_path):
    rng = np.random.default_rng(1)
    np.savetxt(tmp_path / "first.csv", rng.normal(size=400), header="u", comments="")
    (tmp_path / "model.yaml").write_text(
        "estimate: {parameters: {b1: 3.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    )
    for asked in ("information: first.csv", "covariance: model.yaml", "information: model.yaml"):
        spec = parse_spec(FIRST, overrides=[f"uncertainty={{{asked}, scenarios: 100}}"], folder=tmp_path)
        thetas = build_convex(spec).asked.plants.batch.thetas
        if "model" in asked:
            assert thetas.std(axis=0) == pytest.approx([0.1, 0.0316, 0.02], rel=0.2)
        else:
            # White input of power one: the deviation of b1 is of the order of 1 / sqrt(400).
            assert 0.02 < thetas[:, 0].std() < 0.2
    moved = "estimate: {parameters: {b1: 4.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    (tmp_path / "model.yaml").write_text(moved)
    spec = parse_spec(FIRST, overrides=["uncertainty={covariance: model.yaml}"], folder=tmp_path)
    assert code_of(build_task, spec) == "wrong-estimate"


@pytest.mark.parametrize(
    ("order", "risk", "number"), [(6, 0.2, 85), pytest.param(10, 0.1, 235, marks=pytest.mark.slow)]
)
def test_the_risk_sets_the_number_of_plants(order, risk, number):
    asked = f"uncertainty={{covariance: {COVARIANCE}, risk: {risk}}}"
    spec = parse_spec(FIRST, overrides=[asked, f"spectrum.order={order}"])
    assert len(build_convex(spec).asked.plants.batch.plants) == number


@pytest.mark.parametrize(
    ("text", "intervals", "name"),
    [(EVERYWHERE, "dead_time: [-1, 4]", "dead_time"), (PHYSICAL, "K: [-1, 3]", "K")],
)
def test_draws_that_are_no_plants_are_replaced_and_counted(text, intervals, name):
    """A fifth of the interval has a negative dead time; a gain of sqrt(K) needs K >= 0."""
    prior = f"uncertainty={{intervals: {{{intervals}}}, scenarios: 40, seed: 1}}"
    batch = build_convex(parse_spec(text, overrides=[prior])).asked.plants.batch
    assert len(batch.plants) == 40
    assert 2 <= batch.rejected <= 25
    index = batch.plants[0].experiment.model.names.index(name)
    assert np.all(batch.thetas[:, index] >= 0.0)


def test_draws_with_unstable_loops_are_replaced_and_counted():
    """This loop is unstable for f1 below about -1.02."""
    prior = "intervals: {f1: [-1.2, -0.6]}, scenarios: 60, seed: 3"
    batch = build_convex(parse_spec(LOOP, overrides=[f"uncertainty={{{prior}}}"])).asked.plants.batch
    assert len(batch.plants) == 60
    assert batch.rejected > 0
    for plant in batch.plants:
        assert np.abs(plant.experiment.loop.closed_poles).max() < 0.9981
