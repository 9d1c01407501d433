"""Answers are read to their last word, in the units that they name."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.composing import compose
from inputdesign_cli.wizard.plants import plant_of_words
from tests.support.wishes import ENGINEER

PHRASES = {
    "plant": [
        "gain about 2, time constant about 180 s, dead time about 25 s, each within 30 %",
        "gain 2 +- 10 %, time constant 3 min +- 20 %, dead time 25 s within 30 %",
        "gain 2.1 degC/%, time constant 180",
    ],
    "wish": [
        "PI loop with 6 dB",
        "I want a PI loop with 6 dB of margin",
        "PID loop with 29 degrees",
        "PI loop with a phase margin of 29 degrees",
        "PI loop with gain margin of 6 dB",
        "PI loop with 6 dB and a closed-loop time constant of 100 s",
        "my controller is Kp 0.5, Ti 60 in a loop with 6 dB",
        "prediction within 5 % up to 0.005 Hz",
        "parameters within 5 %",
        "Bode plot within 5 % from 0.001 to 0.05 rad/s",
    ],
    "range": ["plus/minus 5 around 40", "40 +/- 5", "35 % to 45 %", "5 around 40", "plus/minus 5 %"],
    "limits": ["none", "rate 0.5", "rate 30 %/min", "output 3 degC and rate 1 K/s"],
    "noise": ["standard deviation 0.2 degC", "resolution 12 bits up to 100", "std 0.2 and resolution 0.5"],
    "loop": ["open", "PI Kp 1, Ti 60", "PID Kp 1, Ti 1 min, Td 5"],
    "converter": ["no", "12 bits up to 100 V"],
}
EVERY = [(key, text) for key, texts in PHRASES.items() for text in texts]


def written(key, text, folder=Path()):
    return compose({**ENGINEER, key: text}, "x", folder).text


def entry(name, text):
    """The text after a key of the spec, up to a comment."""
    return re.search(rf"\b{name}: ([^#\n]*)", text)[1].strip()


@pytest.mark.parametrize(("key", "text"), EVERY)
def test_a_word_that_is_not_understood_is_refused(key, text):
    """A word after a number is excepted, since it may be a unit."""
    written(key, text)
    for more in (f"{text}, nonsense", f"nonsense {text}", f"{text}, Tf 20"):
        with pytest.raises(SpecError) as caught:
            written(key, more)
        (found,) = caught.value.diagnostics
        assert (found.code, found.key) == ("bad-answer", key)


@pytest.mark.parametrize(
    ("text", "shares"),
    [
        ("gain 2 +- 10 %, time constant 180 s +- 20 %, dead time 25 s within 30 %", (0.1, 0.2, 0.3)),
        ("gain 2, time constant 180 s, dead time 25 s, each within 30 %", (0.3, 0.3, 0.3)),
        ("gain 2, time constant 180 s, dead time 25 s within 30 %", (0.3, 0.3, 0.3)),
        ("gain 2 +- 10 %, time constant 180 s, dead time 25 s", (0.1, None, None)),
        ("gain 2 +- 10 %, time constant 180 s, dead time 25 s, each within 30 %", (0.1, 0.3, 0.3)),
    ],
)
def test_each_quantity_has_the_tolerance_that_is_stated(text, shares):
    values = {"gain": 2.0, "time_constant": 180.0, "dead_time": 25.0}
    stated = {name: share for name, share in zip(values, shares, strict=True) if share is not None}
    ends = {name: (values[name] * (1 - share), values[name] * (1 + share)) for name, share in stated.items()}
    assert plant_of_words(text).intervals == {name: pytest.approx(both) for name, both in ends.items()}


@pytest.mark.parametrize(
    ("key", "text", "name", "value"),
    [
        ("limits", "rate 3 per minute", "rate", 3 / 60 * 5),
        ("limits", "rate 30 %/min", "rate", 30 / 60 * 5),
        ("limits", "rate 0.5", "rate", 0.5 * 5),
        ("range", "40 +/- 5", "offset", 40),
        ("range", "35 % to 45 %", "offset", 40),
        ("plant", "gain 2, time constant 3 min", "time_constant", 180),
        ("plant", "gain 2, time constant 0.05 h, sample time 0.1 min", "sample_time", 6),
        ("plant", "gain 2, time constant 3 hrs, sampled every 30 seconds", "sample_time", 30),
        ("plant", "integrates 0.1, dead time 0.5 min, sample time 10 s", "sample_time", 10),
        ("wish", "PI loop with gain margin of 10 dB", "gain_margin", 10**0.5),
        ("noise", "resolution 12 bits up to 100", "variance", (100 / 4096) ** 2 / 12),
        ("noise", "standard deviation 0.2, white, and resolution 0.5", "variance", 0.04 + 0.25 / 12),
        ("noise", "0.2 degC that fades in half a minute", "correlation_time", 30),
        ("noise", "0.2 degC, slowly, about a minute", "correlation_time", 60),
        ("noise", "sensor noise sigma 0.5, white", "variance", 0.25),
        ("noise", "standard deviation +- 0.5", "standard_deviation", 0.5),
        ("noise", "0.5 degC with a memory of 2 s", "correlation_time", 2),
        ("time", "half an hour", "duration", 1800),
        ("time", "1.5 h", "duration", 5400),
        ("limits", "output 3", "output", 3),
        ("converter", "12 bits up to 100", "bits", 12),
        ("hold", "1 min", "hold", 12),
        ("hold", "57 s", "hold", 12),
        ("wish", "PI loop with a safe margin", "max_sensitivity_db", 6),
        ("range", "the valve may move +-8 around 45 %", "amplitude", 8),
    ],
)
def test_values_are_read_in_the_units_that_are_named(key, text, name, value):
    found = re.match(r"[-+.\de]+", entry(name, written(key, text)))
    assert float(found[0]) == pytest.approx(value, rel=1e-5)


def test_frequencies_in_hertz_are_converted_to_radians_per_second():
    low, high = re.findall(r"[\d.]+", entry("band", written("wish", "prediction within 5 % up to 0.005 Hz")))
    assert (float(low), float(high)) == pytest.approx((2 * np.pi / 3600, 0.005 * 2 * np.pi), rel=1e-4)


@pytest.mark.first(1)
@pytest.mark.parametrize(("every", "head"), [(1, "time_s"), (20, "time_s"), (20, "time_min")])
def test_noise_recorded_at_rest_may_have_its_own_sample_time(tmp_path, every, head):
    """The noise has a pole of 0.9 at the sample time of 5 s, and is logged at another one."""
    pole = 0.9**0.2
    white = np.random.default_rng(5).standard_normal(200_000)
    seen = lfilter([0.2 * np.sqrt(1 - pole**2)], [1, -pole], white)[1000::every][:9000]
    rows = np.column_stack([np.arange(len(seen)) * every / (60 if "min" in head else 1), seen])
    np.savetxt(tmp_path / "rest.csv", rows, delimiter=",", header=f"{head},y", comments="")
    spec = written("noise", "rest rest.csv", tmp_path)
    found = -float(entry("D", spec).strip("[]").split(",")[1])
    assert found == pytest.approx(0.9, abs=0.03)
    assert float(entry("variance", spec)) == pytest.approx(0.04 * (1 - 0.81), rel=0.3)


@pytest.mark.parametrize("said", ["from 0.001 to 0.005 Hz", "from 0.001 Hz up to 0.005", "from 1 - 5 mHz"])
def test_one_unit_holds_for_both_ends_of_a_band(said):
    low, high = json.loads(entry("band", written("wish", f"Bode plot within 5 % {said}")).split("]")[0] + "]")
    assert (low, high) == pytest.approx((0.002 * np.pi, 0.01 * np.pi), rel=1e-5)


@pytest.mark.parametrize(
    ("key", "text", "told"),
    [
        ("loop", "PI Kp 1", "a PI controller needs Ti"),
        ("loop", "PID Kp 1, Ti 60", "a PID controller needs Td"),
        ("loop", "PI Kp 1, Ti 60, Td 5", "a PI controller has no Td"),
        ("wish", "PI loop with 6 dB, Kp 1.5", "a PI controller needs Ti"),
    ],
)
def test_settings_must_belong_to_the_controller_that_is_named(key, text, told):
    with pytest.raises(SpecError, match=told):
        written(key, text)


@pytest.mark.parametrize("what", ["12 bits", "12-bit", "3 digits", "of 4096 counts"])
def test_a_resolution_without_a_range_has_no_size(what):
    with pytest.raises(SpecError, match="no size without a range"):
        written("noise", f"resolution {what}")
