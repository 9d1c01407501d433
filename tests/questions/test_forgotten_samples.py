"""Whoever forgets `sample: zoh` is told: with it the complaint is gone, and other advice can be kept."""

import re

import pytest

from inputdesign_cli import parse_spec, validate
from tests.support.refusals import refusal

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
def test_the_key_that_was_forgotten_is_named_and_helps(name):
    overrides = CASES[name]
    found = complaint(text_of(name), overrides)
    assert "sample: zoh" in found.hint
    ends = re.findall(r"end the band at ([\d.]+)", found.hint)
    band = [f"limits={{band: [0, {end}]}}" for end in ends]
    kept = [one for one in overrides if one != BAND]
    validate(parse_spec(text_of(name), overrides=[*kept, "plant.sample=zoh", *band]))


@pytest.mark.parametrize("sample_time", [0.01, 4.76, 300])
@pytest.mark.parametrize("name", ["lines", "no spectrum"])
def test_the_band_that_is_proposed_can_be_kept(name, sample_time):
    own = [f"sample_time={sample_time}", "plant.continuous.dead_time=0"]
    overrides = [*own, *(["limits={band: [0, 1.0e-9]}"] if name == "no spectrum" else [])]
    hint = complaint(text_of(name), overrides).hint
    band = float(re.search(r"band: \[0, ([\d.e+-]+)\]", hint).group(1))
    validate(parse_spec(SPEC, overrides=[*own, f"limits={{band: [0, {band}]}}"]))
