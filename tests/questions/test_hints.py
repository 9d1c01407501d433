"""Remedies of hints work: refused specs succeed once they are changed as the hint proposes."""

from __future__ import annotations

import re

import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import InfeasibleError
from tests.support.first_order_specs import PLANT
from tests.support.outcomes import codes_in
from tests.support.refusals import refusal

INTEGRATING = """
plant: {B: [0, 0.5], F: [1, -1], known: [f1]}
noise: {variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
"""


@pytest.mark.parametrize("spectrum", [[], ["spectrum={type: fir, order: 6}"], ["spectrum={type: free}"]])
def test_both_remedies_for_a_pole_at_frequency_zero_work(spectrum):
    told = refusal(lambda: solve(parse_spec(INTEGRATING, overrides=spectrum)))
    assert told.code == "infinite-information"
    found = re.findall(r"(limits|spectrum): (\{[^}]*\})", told.hint)
    lines, *band = [f"{key}={value}" for key, value in found]
    for way in ([lines], [*(() if band[0].startswith("spectrum") else spectrum), *band]):
        assert solve(parse_spec(INTEGRATING, overrides=way)).result["status"] == "optimal"


@pytest.mark.parametrize(("relative", "told"), [(0.1, False), (0.99, False), (1.0, True), (10, True)])
def test_an_admissible_error_as_large_as_the_plant_is_reported(relative, told):
    spec = parse_spec(
        INTEGRATING.replace("-1]", "-0.5]"), overrides=[f"accuracy.model_error.relative={relative}"]
    )
    assert ("error-as-large-as-plant" in codes_in(solve(spec).result)) == told


DELAYED = """
plant: {%s}
noise: {variance: 0.04}
experiment: {samples: 60}
accuracy: {standard_deviation: {%s: 0.05}}
spectrum: {type: fir, order: 3}
signal: {candidates: 1, seed: 1}
solver: {any_spectrum: false}
"""


@pytest.mark.parametrize("late", [20, 52, 56, 57, 57.5, 59.9])
@pytest.mark.parametrize("held", [True, False], ids=["held", "in q^-1"])
def test_no_record_costs_a_thousand_times_its_design(late, held):
    """Few samples follow the dead time; a single one cannot determine two or three parameters."""
    words = "parameters: {K: 2, T: 6, L: %g}, continuous: {numerator: [K], denominator: [T, 1], delay: L}, "
    zeros = ", ".join(["0"] * int(late + 1))
    text = (words % late + "sample: zoh", "K") if held else (f"B: [{zeros}, 0.3], F: [1, -0.8]", "f1")
    try:
        found = solve(parse_spec(DELAYED % text)).result
    except InfeasibleError as error:
        (told,) = error.diagnostics
        assert (told.code, told.key, late > 40) == ("record-too-short", "experiment.samples", True)
        assert "experiment.samples: 120" in told.hint
    else:
        assert late < 57
        assert found["signal"]["extra_power"] < 1e3
        assert found["signal"]["worst_ratio"] <= 1.0 + 1e-9


def test_the_search_for_a_remedy_is_limited_in_time(monkeypatch):
    """The proof of infeasibility comes first and has the same numbers."""
    text = (
        PLANT.replace("500", "100") + "accuracy: {model_error: {relative: 0.05}}\nspectrum: {type: white}\n"
    )
    text += "limits: {amplitude: 0.3}\nsignal: {type: multisine, seed: 1}\n"

    def refused():
        return refusal(lambda: solve(parse_spec(text)), InfeasibleError)

    whole = refused()
    monkeypatch.setattr("inputdesign_cli.compute.time_limit.HINT_SECONDS", 0.0)
    short = refused()
    assert whole.code == short.code == "infeasible"
    assert whole.details == short.details
    assert "not looked for further" not in whole.hint
    assert "not looked for further" in short.hint


SPEC = """
sample_time: 4.76
plant: {continuous: {gain: 2.1, time_constant: 180, dead_time: 3}}
noise: {variance: 0.04}
experiment: {samples: 720}
accuracy: {standard_deviation: {gain: 0.05}}
spectrum: {type: multisine, lines: 60}
"""
BAND = "limits={band: [0, 0.6]}"
CASES = {
    "lines": [],
    "white": ["spectrum={type: white}"],
    "free": ["spectrum={type: free}"],
    "no spectrum": [BAND],
    "fir": ["spectrum={type: fir, order: 10}"],
    "band": ["limits={band: [0, 2]}"],
    "C": ["noise.C=[1, -0.2]", BAND],
    "drift": ["noise.drift=true", BAND],
    "controller": ["experiment.controller={numerator: [0.1]}", BAND],
    "binary": ["signal={type: binary}", BAND],
    "true plant": ["simulation={plant: {B: [0, 1]}}", BAND],
}


def complaint(text, overrides):
    return refusal(lambda: validate(parse_spec(text, overrides=overrides)))


def text_of(name):
    return SPEC.replace("spectrum: {type: multisine, lines: 60}\n", "") if name == "no spectrum" else SPEC


@pytest.mark.parametrize("name", CASES)
def test_a_forgotten_sample_zoh_is_named_and_makes_the_spec_valid(name):
    overrides = CASES[name]
    found = complaint(text_of(name), overrides)
    assert "sample: zoh" in found.hint
    ends = re.findall(r"end the band at ([\d.]+)", found.hint)
    band = [f"limits={{band: [0, {end}]}}" for end in ends]
    kept = [one for one in overrides if one != BAND]
    validate(parse_spec(text_of(name), overrides=[*kept, "plant.sample=zoh", *band]))


@pytest.mark.parametrize("sample_time", [0.01, 4.76, 300])
@pytest.mark.parametrize("name", ["lines", "no spectrum"])
def test_the_band_that_a_hint_proposes_is_valid(name, sample_time):
    own = [f"sample_time={sample_time}", "plant.continuous.dead_time=0"]
    overrides = [*own, *(["limits={band: [0, 1.0e-9]}"] if name == "no spectrum" else [])]
    hint = complaint(text_of(name), overrides).hint
    band = float(re.search(r"band: \[0, ([\d.e+-]+)\]", hint).group(1))
    validate(parse_spec(SPEC, overrides=[*own, f"limits={{band: [0, {band}]}}"]))
