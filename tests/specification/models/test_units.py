"""Numbers with units: the hint proposes the same quantity in the unit of the spec."""

import math
import re

import pytest

from inputdesign_cli import parse_spec
from tests.support.refusals import refused

# The seconds in each unit, independent of the table of the package.
LONG = {"ms": 0.001, "sec": 1, "min": 60, "minutes": 60, "h": 3600, "hours": 3600, "d": 86400, "us": 1e-6}
TIMES = {
    "sample_time": "sample_time: {}",
    "experiment.duration": "experiment: {{duration: {}}}",
    "limits.duration": "limits: {{duration: {}}}",
    "plant.continuous.dead_time": "plant: {{continuous: {{gain: 2, time_constant: 9, dead_time: {}}}}}",
    "plant.continuous.time_constant": "plant: {{continuous: {{gain: 2, time_constant: [[{}]]}}}}",
    "experiment.controller.pid.Ti": "experiment: {{controller: {{pid: {{Kp: 1, Ti: {}}}}}}}",
}
FREQUENCIES = {
    "limits.band": "limits: {{band: [0, {}]}}",
    "spectrum.frequencies": "spectrum: {{type: multisine, frequencies: [{}, 2]}}",
}


def hint_of(key, template, text, time_unit="s"):
    (found,) = [
        d
        for d in refused(parse_spec, template.format(text) + f"\ntime_unit: {time_unit}\n")
        if d.key.startswith(key)
    ]
    return found.hint


def proposed(hint):
    return float(re.search(r"write ([\d.e+-]+)", hint.replace("the number without a unit: ", "")).group(1))


@pytest.mark.parametrize("unit", LONG)
@pytest.mark.parametrize("time_unit", ["s", "ms", "min", "h"])
def test_durations_are_converted(unit, time_unit):
    for key, template in TIMES.items():
        asked = 2.5 * LONG[unit] / LONG.get(time_unit, 1)
        assert proposed(hint_of(key, template, f"2.5 {unit}", time_unit)) == pytest.approx(asked), key


@pytest.mark.parametrize("time_unit", ["s", "ms", "min"])
def test_frequencies_are_converted(time_unit):
    long = LONG.get(time_unit, 1)
    for unit, radians in {"Hz": 2 * math.pi, "rad/s": 1, "rad/min": 1 / 60, "rpm": math.pi / 30}.items():
        for key, template in FREQUENCIES.items():
            hint = hint_of(key, template, f"0.25{unit}", time_unit)
            assert proposed(hint) == pytest.approx(0.25 * radians * long), (key, unit)


def test_other_units_are_dropped_and_a_percentage_may_be_a_fraction():
    for unit in ("V", " degC", "m/s"):
        assert proposed(hint_of("signal.offset", "signal: {{offset: [{}, 2]}}", f"'40{unit}'")) == 40
    for key, template in (
        ("cost.input_power", "cost: {{input_power: {}}}"),
        ("accuracy.model_error.confidence", "accuracy: {{model_error: {{relative: 0.1, confidence: {}}}}}"),
    ):
        hint = hint_of(key, template, "40%")
        assert "0.4 where a fraction" in hint
        assert "40 where the unit is percent" in hint
    assert "unit: 3" in hint_of("sample_time", "sample_time: {}", "3 fortnights")
    assert proposed(hint_of("solver.time_limit", "solver: {{time_limit: {}}}", "2 min", "h")) == 120


def test_the_unit_of_a_parameter_shows_which_quantity_it_is():
    """A parameter may be any quantity, and the unit of an expression is not known."""
    plant = "plant: {{parameters: {{T: %s}}, continuous: {{gain: 2, time_constant: %s}}, sample: zoh}}"
    named, stated = "plant.parameters.T", "plant.continuous.time_constant"
    assert proposed(hint_of(named, plant % ("{}", "T"), "1.5 h", "min")) == 90
    assert proposed(hint_of(named, plant % ("{}", "T"), "3 rad/s", "min")) == 180
    assert proposed(hint_of(named, plant % ("{}", "T"), "1.5 kg", "min")) == 1.5
    assert "in time_unit: 1.5 if that is h" in hint_of(stated, plant % ("3", "{}"), "1.5 h", "min")
