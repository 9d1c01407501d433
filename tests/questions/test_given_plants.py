"""A given excitation at the plants of `uncertainty`: each as if it were the plant of the spec."""

import itertools

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.errors import SpecError
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, PROCESS as EVERYWHERE, TWO

# Between samples a dead time brings a zero near -1, where r_adm would be that of `uncertainty.floor`.
PROCESS = EVERYWHERE.replace("relative: 0.1", "relative: 0.1, band: [0, 0.5]")

WHITE = "spectrum={given: {type: white, power: 3}}"
SINE = "spectrum={given: {type: multisine, frequencies: [0.1, 1.0], amplitudes: [1, 2]}}"


def analysed(text, *overrides):
    return analyse(parse_spec(text, overrides=[WHITE, *overrides, "signal=null"]))


def alone(text, values, *overrides):
    """The ratio where a plant of other parameters is that of the spec."""
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
def test_every_plant_has_the_ratio_that_it_has_alone(text, given, tmp_path):
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


def test_a_plant_that_is_missed_misses_what_is_asked():
    ratio = analysed(FIRST).result["model_error"]["worst_ratio"]
    asked = f"accuracy.model_error.relative={0.02 * 1.1 * ratio}"
    assert analysed(FIRST, asked).result["status"] == "met"
    found = analysed(FIRST, asked, "uncertainty={scenarios: [{b1: 2}]}").result
    assert found["model_error"]["worst_ratio"] == pytest.approx(1 / 1.1)
    assert (found["status"], found["robust"]["missed"]) == ("missed", 1)


def test_the_worst_plant_of_a_box_is_searched():
    box = {"b1": [3.0, 4.0], "f1": [-0.75, -0.65]}
    stated = f"uncertainty={{intervals: {box}, worst_case: 0.95, scenarios: 5, fresh: 20}}"
    robust = analysed(FIRST, stated).result["robust"]
    corners = [
        alone(FIRST, dict(zip(box, values, strict=True))) for values in itertools.product(*box.values())
    ]
    assert robust["searched"]["share"] == pytest.approx(max(corners), rel=1e-5)
    assert robust["worst_share"] <= robust["searched"]["share"]
    assert robust["fresh"]["largest"] <= robust["searched"]["share"]


def test_the_worst_plants_are_left_out():
    stated = f"uncertainty={{covariance: {COVARIANCE}, scenarios: 20, fresh: 0%s}}"
    every = np.sort(analysed(FIRST, stated % "").tables["scenarios"].columns["share"])
    fewer = analysed(FIRST, stated % ", discard: 0.2")
    np.testing.assert_allclose(np.sort(fewer.tables["scenarios"].columns["share"]), every[:16])
    assert fewer.result["robust"]["discarded"] == 4


def test_a_risk_takes_as_many_plants_as_a_series_of_trials():
    robust = analysed(FIRST, f"uncertainty={{covariance: {COVARIANCE}, risk: 0.2, fresh: 0}}").result[
        "robust"
    ]
    assert 0.8 ** robust["scenarios"] <= 1e-3 < 0.8 ** (robust["scenarios"] - 1)


def test_fresh_plants_are_counted():
    ratio = analysed(FIRST).result["model_error"]["worst_ratio"]
    asked = f"accuracy.model_error.relative={0.02 * ratio}"  # that of the spec is just served
    found = analysed(FIRST, asked, "uncertainty={intervals: {b1: [3.0, 4.2]}, scenarios: 2, fresh: 60}")
    fresh = found.result["robust"]["fresh"]
    assert fresh["draws"] == 60
    assert 17 < fresh["missed"] < 43  # half of the gains are smaller, and r_u does not depend on them


@pytest.mark.parametrize("verb", [analyse, solve, simulate])
def test_other_commands_look_at_the_plants_too(verb):
    overrides = [WHITE, "signal=null", "uncertainty={scenarios: [{b1: 3}]}", "simulation={runs: 4, seed: 1}"]
    found = verb(parse_spec(FIRST, overrides=overrides)).result
    assert found["robust"]["scenarios"] == 1
    assert ("simulation" in found) == (verb is simulate)


def test_several_channels():
    nominal = analysed(TWO).result["model_error"]["worst_ratio"]
    first = 'uncertainty={scenarios: [{"b1[1,1]": 0.5}]}'
    found = analysed(TWO, first).result["robust"]
    changed = TWO.replace("[0, 1.0, 0.4]", "[0, 0.5, 0.4]")
    assert changed != TWO
    expected = analysed(changed).result["model_error"]["worst_ratio"]
    assert found["worst_share"] == pytest.approx(max(nominal, expected), rel=1e-6)


def test_a_plant_whose_parameters_are_not_told_is_an_error():
    """Two sinusoids of which one is at the zero of the other plant."""
    zero = "plant={B: [0, 1, 1.0, 0.5]}"
    sine = "spectrum={given: {type: multisine, frequencies: [0.3], amplitudes: [1]}}"
    with pytest.raises(SpecError) as caught:
        analysed(FIRST, zero, sine, "noise={variance: 1}", "uncertainty={scenarios: [{b2: 0.9}]}")
    assert caught.value.diagnostics[0].code == "not-exciting"


def test_the_criterion_of_a_given_excitation_is_told():
    """White noise of power 3 into b1 q^-1 without dynamics: M = 3 N / variance."""
    overrides = ["plant={B: [0, 2]}", "noise={variance: 0.5}", "experiment={samples: 50}"]
    for letter, value in {"D": np.log(300.0), "A": -1 / 300, "E": 300.0, "T": 300.0}.items():
        found = analysed(FIRST, *overrides, f"accuracy={{criterion: {letter}}}").result["objective"]
        assert found == {"kind": letter, "value": pytest.approx(value)}
