"""A faulty record leaves the verdict undecided, with the code of its fault; without the fault it is met."""

from functools import partial

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import assess, identify, parse_spec
from inputdesign_cli.errors import DataError
from inputdesign_cli.findings.other_systems import shared
from inputdesign_cli.identification import identify as estimate
from inputdesign_cli.identification.response_chance import perhaps_zero
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.questions import explore
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.records import Preparation
from tests.identification.test_faults import GAIN, loop
from tests.support.refusals import refusal

ARX = """
plant: {A: [1, -0.7], B: [0, 3.6]}
noise: {variance: 1.0}
experiment: {samples: 600}
accuracy: {standard_deviation: {a1: 0.05, b1: 0.3}}
spectrum: {type: white}
"""
LAG = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.5], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""
QUIET = """
plant: {B: [0, 0.5], F: [1, -0.7]}
noise: {variance: 0.01}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
"""
RISING = """
plant: {B: [0, 0.2], F: [1, -0.8]}
noise: {variance: 1.0}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.3}}
spectrum: {type: white}
"""
# The plant of `loop`, whose controller is a gain.
LOOP = """
plant: {A: [1, -0.8], B: [0, 0.5]}
noise: {variance: 0.09}
experiment: {samples: 1000, controller: {numerator: [0.5], denominator: [1]}}
accuracy: {model_error: {relative: 0.5}}
"""


def arx(seed, *, gain=3.6, late=0):
    """600 samples of the plant of ARX, optionally with another gain or an input that is logged late."""
    rng = np.random.default_rng(seed)
    u, e = rng.choice([-1.0, 1.0], 620), rng.standard_normal(620)
    y = scipy.signal.lfilter([0.0, gain], [1.0, -0.7], u) + scipy.signal.lfilter([1.0], [1.0, -0.7], e)
    return {"u": np.roll(u, late)[20:], "y": y[20:]}


def lag(seed, samples=500, *, still=None, spikes=0):
    """The plant of LAG; its sensor may stand still or show nothing from 200 to 259, or have spikes."""
    rng = np.random.default_rng(seed)
    u = 0.3 * np.sign(rng.standard_normal(samples))
    y = scipy.signal.lfilter([0, 3.6], [1, -0.7], u)
    y += scipy.signal.lfilter([1, -0.5], [1], rng.standard_normal(samples))
    if still is not None:
        y[200:260] = still * y[200]
    rng = np.random.default_rng(0)
    at = np.sort(rng.choice(samples, spikes, replace=False))
    y[at] += 30.0 * rng.choice([-1.0, 1.0], at.size)
    return {"u": u, "y": y}


def spiked(size):
    """The plant of QUIET with spikes of this size in three samples; NaN leaves these samples out."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal(500)
    y = scipy.signal.lfilter([0, 0.5], [1, -0.7], u) + 0.1 * rng.standard_normal(500)
    y[[100, 301, 400]] += size * np.array([1.0, -1.0, 1.5])
    return {"u": u, "y": y}


def rising(half):
    """The plant of RISING with a gain that rises from 1 - half to 1 + half times its value."""
    rng = np.random.default_rng(1)
    u, e = rng.standard_normal(400), 0.3 * rng.standard_normal(400)
    return {
        "u": u,
        "y": scipy.signal.lfilter([0, 0.2], [1, -0.8], np.linspace(1 - half, 1 + half, 400) * u) + e,
    }


def in_loop(late, *columns):
    """Some columns of `u,y,r` of the plant of LOOP, with an input that is logged late."""
    signals = dict(zip("uyr", (x.ravel() for x in loop(GAIN, samples=1000)), strict=True))
    signals["u"] = np.roll(signals["u"], late)
    return {name: signals[name][5:] for name in columns}


LATE = {
    f"logged {k} samples late": (ARX, partial(arx, 2, late=k), "input-logged-late") for k in (2, 3, 6, 12)
}
FAULTS = {
    **LATE,
    "columns swapped": (ARX, lambda: dict(zip("yu", arx(3).values(), strict=True)), "input-logged-late"),
    "another experiment": (ARX, lambda: {**arx(5), "u": arx(4)["u"]}, "input-without-effect"),
    "logged late in a loop": (LOOP, partial(in_loop, 1, "u", "y", "r"), "columns-misaligned"),
    "a gain that rises": (RISING, partial(rising, 0.25), "plant-changed"),
    "spikes": (QUIET, partial(spiked, 3.0), "spikes"),
    "spikes in a twentieth": (LAG, partial(lag, 5, spikes=24), "spikes"),
    "a still sensor": (LAG, partial(lag, 3, 560, still=1.0), "sensor-stands-still"),
}
FIGURES = {
    **{name: ("samples", k - 1) for name, k in zip(LATE, (2, 3, 6, 12), strict=True)},
    "spikes": ("rows", [[102, 102], [303, 303], [402, 402]]),
    "a still sensor": ("rows", [[202, 261]]),
}


# Faster cases cover these faults.
AS_WELL = ("a still sensor", "spikes in a twentieth", "logged 3 samples late", "logged 6 samples late")


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow) if one in AS_WELL else one for one in FAULTS]
)
def test_a_fault_of_a_record_is_named_and_leaves_the_verdict_undecided(name, write):
    """The fault is the only stated reason; `identify` reports it as well."""
    text, made, code = FAULTS[name]
    spec, path = parse_spec(text), write(made())
    judged = assess(spec, path)
    found = judged.results.outcome
    faults = {one.code: one for one in found.findings if one.severity == "refuted"}
    key, value = FIGURES.get(name, ("", None))
    assert judged.verdict == "undecided"
    assert found.assessment.causes == ("contradicted",)
    assert faults[code].figures.get(key) == value
    (told,) = found.assessment.undecided
    assert told in [one.message for one in faults.values()]
    if name in ("spikes", "another experiment"):  # the same words come from the same findings
        assert told in identify(spec, path).result["notes"]


SOUND = {
    "as it is": (ARX, partial(arx, 1), None),
    "a gain as small as that of the spec": (ARX.replace("3.6", "0.02"), partial(arx, 6, gain=0.02), None),
    "in a loop": (LOOP, partial(in_loop, 0, "u", "y", "r"), None),
    "a steady gain": (RISING, partial(rising, 0.0), None),
    "without spikes": (QUIET, partial(spiked, np.nan), "rows-left-out"),
    "spikes far beyond the signal": (QUIET, partial(spiked, 1e6), "spikes-replaced"),
    "without the rows of a still sensor": (LAG, partial(lag, 3, 560, still=np.nan), "rows-left-out"),
}


@pytest.mark.parametrize("name", SOUND)
def test_a_record_without_the_fault_is_met(name, write):
    """The estimate agrees with the plant of the spec, which is the true one."""
    text, made, code = SOUND[name]
    judged = assess(parse_spec(text), write(made()))
    found, true = judged.results.outcome, build_model(parse_spec(text))
    assert judged.verdict == "met"
    assert "refuted" not in {one.severity for one in found.findings or ()}
    assert code is None or code in {one.code for one in found.findings}
    for parameter, value in zip(true.names, true.theta, strict=True):
        away = abs(found.identification.theta[parameter] - value)
        assert away < 4 * found.identification.standard_deviation[parameter]


def codes(results):
    return {one.code for one in results.outcome.findings or ()}


def test_without_the_reference_a_late_input_of_a_loop_is_not_detected(write):
    assert "columns-misaligned" not in codes(identify(parse_spec(LOOP), write(in_loop(1, "u", "y"))))


@pytest.mark.first(1)
@pytest.mark.parametrize("u", ["held", "sines", "drifting"])
def test_predictable_inputs_of_right_models_are_not_reported_as_logged_late(u, write):
    """The plant has a dead time of ten samples; each kind of input has three short records."""
    zeros = "[" + "0, " * 10 + "3.6]"
    spec = parse_spec(ARX.replace("[0, 3.6]", zeros).replace("b1", "b10"))
    for seed in range(3):
        rng, n = np.random.default_rng(seed), 130
        if u == "held":
            moved = np.repeat(rng.choice([-1.0, 1.0], n // 5), 5)
        elif u == "sines":
            moved = np.cos(np.outer(np.arange(n), [0.3, 0.7, 1.1]) + rng.uniform(0.0, 6.0, 3)).sum(axis=1)
        else:
            moved = np.cumsum(rng.standard_normal(n)) / 5.0
        y = scipy.signal.lfilter([0.0] * 10 + [3.6], [1.0, -0.7], moved)
        y += scipy.signal.lfilter([1.0], [1.0, -0.7], rng.standard_normal(n))
        assert "input-logged-late" not in codes(assess(spec, write({"u": moved, "y": y})).results)


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "share"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_wald_test_finds_outputs_that_no_input_moves(gain, share):
    """The level of the Wald test is 0.001; the first of two inputs has the gain."""
    ones = np.ones(1)
    B = (np.array([0.0, 0.1]), np.array([0.0, 0.1]))
    F = (np.array([1.0, -0.5]), np.array([1.0, -0.5]))
    model = PolynomialModel((B,), (ones,), (F,), (ones,), (ones,), np.eye(1))
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        u, e = rng.standard_normal((300, 2)), rng.standard_normal((300, 1))
        y = e + gain * scipy.signal.lfilter([0.0, 1.0], [1.0, -0.5], u[:, :1], axis=0)
        one = estimate(model, u, y)
        found.append(perhaps_zero(model.at(one.theta, one.noise), one))
    assert np.mean([len(each) for each in found]) == share


def emptied(record, every):
    y = record["y"].copy()
    y[::every] = np.nan
    return {**record, "y": y}


COPIES = {
    "whole": lambda record: record,
    "its beginning": lambda record: {name: x[:300] for name, x in record.items()},
    "with empty cells": lambda record: emptied(record, 12),
    "with few empty cells": lambda record: emptied(record, 60),
}


@pytest.mark.parametrize(
    ("name", "options"),
    [*((one, {}) for one in COPIES), ("with empty cells", {"preparation": Preparation(detrend="constant")})],
)
def test_a_copy_of_a_record_is_refused(name, options, write):
    files = [write(lag(3), "a.csv"), write(COPIES[name](lag(3)), "b.csv")]
    for given in (files, files[::-1]):
        refused = partial(assess, parse_spec(LAG), given, **options)
        assert refusal(refused, DataError).code == "data-repeated"
    assert refusal(lambda: explore(files), DataError).code == "data-repeated"


@pytest.mark.slow
def test_a_copied_part_with_empty_cells_leaves_the_verdict_undecided(write):
    first, second = lag(3), lag(4)
    for name, copied in emptied(first, 25).items():
        second[name][200:400] = copied[100:300]
    judged = assess(parse_spec(LAG), [write(first, "a.csv"), write(second, "b.csv")])
    assert judged.verdict == "undecided"
    assert "samples-repeated" in codes(judged.results)


def test_rests_and_rounded_outputs_of_a_repeated_input_are_no_copies():
    """Two records have the same input and coarse rounding, but different noise."""
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)[:, None]
    y = scipy.signal.lfilter([0.2], [1, -0.8], u, axis=0)
    one, other = (np.column_stack([u, np.round(y + 0.5 * rng.standard_normal(y.shape))]) for _ in range(2))
    assert shared(one, other).mean() < 0.05
    rest = np.zeros((100, 2))
    assert not shared(np.concatenate([rest, one]), np.concatenate([rest, other[::-1]]))[:100].any()
