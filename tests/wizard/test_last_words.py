"""What the wizard says is to be applied and logged."""

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.composing import compose
from inputdesign_cli.wizard.solving import lasting, to_log, verdict
from inputdesign_cli.wizard.wishes import input_range
from tests.wizard.test_wizard import ENGINEER


def words(applied, caused, offset=None, **of_signal):
    spec = SimpleNamespace(signal=SimpleNamespace(offset=offset), sample_time=2.0, time_unit="s")
    tables = {
        "signal": SimpleNamespace(columns=dict.fromkeys(["time_s", *applied])),
        "predicted_output": SimpleNamespace(
            columns=dict.fromkeys(["time_s", *caused, *(f"{y}_noise_deviation" for y in caused)])
        ),
    }
    return to_log(spec, SimpleNamespace(tables=tables, result={"signal": of_signal}), "spec.yaml")


def test_all_channels_are_logged():
    apply, judge = words(["u1", "u2"], ["y1", "y2"], [40.0, 5.0])
    assert "apply signal.csv, and log time, u1, u2, y1 and y2 every 2 s" in apply
    assert "--operating-point u1=40,u2=5,y1=REST,y2=REST" in judge


def test_the_operating_point_is_the_one_that_the_record_swings_about():
    """A converter of 31 steps of 24/31 V has no level of 10 V."""
    _, judge = words(["u1"], ["y1"], 10.0, operating_point=[10.5])
    assert "--operating-point u1=10.5,y1=REST" in judge


def test_a_reference_is_no_position_of_the_actuator():
    apply, level, judge = words(["r1"], ["y1"], 40.0)
    assert "has the level 40 of the input in it: while y rests, u = r" in level
    assert "need not be logged" in level
    assert "u = r - C y" in apply
    assert "no position of the actuator" in apply
    assert "log time, u1 and y1" in apply
    assert "--operating-point u1=40,y1=REST" in judge


def told(ratio=0.5, there=None, solve=None, limits=None, **robust):
    """The sentences about a record of 720 samples, 5 s apart."""
    spec = compose({**ENGINEER, **({"limits": limits} if limits else {})}, "x", Path()).spec()
    signal = {"worst_ratio": ratio, "input_peak": [1.25 if limits else 5.0], "of_limits": {"rate": 1.0}}
    result = {"samples": 720, "signal": signal, **({"robust": robust} if robust else {})}
    missing = {"signal": {}}
    return " ".join(verdict(spec, result, solve or (lambda other: missing), there))


def told_of_the_margin(**robust):
    """The sentences about an own controller with 6 dB, where the loop is among what is required."""
    spec = compose({**ENGINEER, "wish": "own loop with 6 dB, Kp 0.5, Ti 180"}, "x", Path()).spec()
    loop = {"gain_margin": 2.0, "phase_margin": 29.0}
    signal = {"worst_ratio": 0.3, "input_peak": [5.0]}
    result = {"samples": 720, "signal": signal, "requirements": [{"loop": loop}], "robust": robust}
    return " ".join(verdict(spec, result, lambda other: {"signal": {}}))


def test_no_margin_is_promised_at_a_plant_that_the_controller_does_not_fit():
    promised = told_of_the_margin(scenarios=30)
    assert "enough: the model" in promised
    assert "The peak of |S| of the loop stays below 6 dB for every plant" in promised
    worst = {"scenario": 3, "peak": 10 ** (13.5 / 20), "parameters": {"gain": 1.2, "dead_time": 24.0}}
    floor = {"share": 0.1, "raised": [3, 5, 7], "lost": [3, 5], "worst": [worst]}
    said = told_of_the_margin(
        scenarios=30, floor=floor, fresh={"missed": 0, "largest": 0.9, "draws": 200, "raised": 55, "lost": 51}
    )
    assert "enough wherever this controller has the margin:" in said
    assert "at 2 of the 30 other plants that were tried and at 51 of 200 more" in said
    assert "such as gain 1.2, dead_time 24, where |S| reaches 13.5 dB" in said
    assert "the verdict of assess will be undecided" in said
    assert "At the other plants that were tried the peak of |S|" in said


def test_a_rate_that_binds_is_said():
    assert "60 min at plus/minus 5 is enough" in told()
    said = told(limits="rate 0.01")
    assert "plus/minus 5 (it moves by 1.25 at most; the rate is at the limit) is enough" in said


def test_a_length_that_would_do_is_shorter_than_the_record_that_does():
    def solve(changed):
        return {"signal": {"worst_ratio": 0.99, "samples": changed.experiment.samples}, "samples": 0}

    assert "would do" not in told(0.98, solve=solve)
    assert f"{lasting(5.0 * 434)} would do" in told(0.74, solve=solve)


def test_time_that_is_left_is_used():
    def solve(changed):
        ratio = 1.5 * (720 / changed.experiment.samples) ** 0.5
        return {"signal": {"worst_ratio": ratio, "samples": changed.experiment.samples}, "samples": 0}

    said = told(1.5, there=4 * 3600.0, solve=solve)
    assert "Of the 4 h that there are, 60 min were used" in said
    assert f"write duration: {5 * math.ceil(720 * 1.5**2 * 1.1)} into the spec" in said
    assert "write duration" not in told(1.5, there=3600.0, solve=solve)


@pytest.mark.parametrize(
    ("ratio", "fresh", "words"),
    [
        (0.5, {"missed": 0, "largest": 1.0}, "Nor is it worse at 200 more of them."),
        (0.5, {"missed": 9, "largest": 1.2}, "up to 0.6 times as much as is admitted, which is enough"),
        (0.9, {"missed": 9, "largest": 1.2}, "up to 1.08 times as much as is admitted, which is too much"),
    ],
)
def test_what_is_known_of_other_plants_is_said_in_words_of_the_wish(ratio, fresh, words):
    said = told(ratio, scenarios=30, fresh={"draws": 200, **fresh})
    assert words in said
    assert "drawn afresh" not in said


def test_a_record_that_is_just_enough_may_be_called_missed():
    """The data tell a plant at which the error is larger: a length has room for that."""
    robust = {"scenarios": 32, "estimates": {"draws": 100, "confidence": 0.95, "largest": 1.1}}

    def solve(changed):
        ratio = 0.95 * (720 / changed.experiment.samples) ** 0.5
        samples = changed.experiment.samples
        return {"signal": {"worst_ratio": ratio, "samples": samples}, "samples": samples, "robust": robust}

    said = told(0.95, solve=solve, **robust)
    assert "60 min at plus/minus 5 is enough" in said
    assert "5 % of experiments would give one at which it errs 1.04 times" in said
    assert f"{lasting(5.0 * math.ceil(720 * 1.1 * (0.95 * 1.1) ** 2))} would do" in said
    assert "missed" not in told(0.9, **robust)


def test_the_worst_plant_that_was_found_is_named():
    said = told(scenarios=32, searched={"added": 2, "parameters": {"gain": 1.4, "dead_time": 17.5}})
    assert "at 30 others" in said
    assert "at the worst one that a search found (gain 1.4, dead_time 17.5)" in said


@pytest.mark.parametrize(
    ("peaks", "words"),
    [
        ({"draws": 51, "largest": 1.05}, "at 51 of 200 more they go beyond, up to 105 % of a limit"),
        ({"draws": 0, "largest": 0.98}, "and at 200 more; noise comes on top of that"),
    ],
)
def test_limits_are_promised_for_the_plants_that_were_tried(peaks, words):
    said = told(scenarios=30, fresh={"draws": 200, "missed": 0, "largest": 1.0, "beyond_limits": peaks})
    assert "within your limits at the plant as you stated it and at 30 others" in said
    assert words in said


def test_the_column_is_told_once_what_can_be_done():
    for wish in ("PI loop with 6 dB", "own loop with 6 dB, Kp 1.5, Ti 180"):
        with pytest.raises(SpecError) as caught:
            compose({**ENGINEER, "plant": "column", "wish": wish}, "x", Path()).validate()
        (found,) = caught.value.diagnostics
        assert found.message.count("(wish)") == 1
        assert "has 2 channels" in found.message
        assert "prediction within 10 %" in found.message
    with pytest.raises(SpecError, match=r"\(loop\): the plant has 2 channels"):
        compose({**ENGINEER, "plant": "column", "loop": "PI Kp 1, Ti 60"}, "x", Path())


@pytest.mark.parametrize(
    "text", ["5 % around 40 %", "5 around 40", "plus/minus 5 around 40", "± 5 % around 40 %", "35 to 45"]
)
def test_ranges_in_many_words(text):
    span = input_range(text)
    assert (span.amplitude, span.offset) == (5.0, 40.0)


def test_what_is_not_used_for_a_bode_plot_is_said():
    wish = "Bode plot within 5 % from 0.005 to 0.05"
    draft = compose({**ENGINEER, "wish": wish, "time": "8 h"}, "x", Path())
    assert any("how well the plant is known is not used" in one for one in draft.notes)
    assert "# how well the plant is known is not used" in draft.text


def test_a_bode_plot_that_is_refused_says_which_time_would_do():
    """Harmonics of a fifth of an hour are 2 pi/720 s = 0.0087 rad/s apart."""
    answers = {**ENGINEER, "wish": "Bode plot within 5 % from 0.001 to 0.01"}
    with pytest.raises(SpecError) as caught:
        compose(answers, "x", Path()).validate()
    (told,) = caught.value.diagnostics
    assert "the band holds 1 harmonics" in told.message
    seconds = float(told.hint.split("take ")[1].split(" s or more")[0])
    compose({**answers, "time": f"{seconds:g} s"}, "x", Path()).validate()
    with pytest.raises(SpecError):
        compose({**answers, "time": f"{0.95 * seconds:g} s"}, "x", Path()).validate()
