"""Unmeasured load changes and linear trends in a record, from the file to the estimate."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
from scipy.signal import lfilter

from inputdesign_cli import assess, identify, parse_spec, questions
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification import LevelShift
from inputdesign_cli.identification.adequacy import ScoreTest
from inputdesign_cli.questions import explore
from inputdesign_cli.questions.exploration import explore as exploring
from inputdesign_cli.records import Preparation, read_log

K, T = 2.0, 12.0
SPEC = f"""
sample_time: 1
plant: {{continuous: {{gain: {K}, time_constant: {T}, dead_time: 2}}, sample: zoh}}
noise: {{variance: 0.01}}
experiment: {{samples: 400}}
accuracy: {{model_error: {{relative: 0.2, band: [0.001, 0.1]}}}}
"""


def rows_of(samples, at, seed):
    """(n, 3): time, u, y of K/(T s + 1) e^-2s, u held for 15 to 45 samples, a lagged load from `at`."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], samples), rng.integers(15, 46, samples))[:samples]
    pole = np.exp(-1.0 / T)
    y = scipy.signal.lfilter([0.0, 0.0, 0.0, K * (1.0 - pole)], [1.0, -pole], u)
    if at is not None:
        y += -1.2 * np.expm1(-np.maximum(np.arange(samples) - at, 0.0) / 10.0)
    return np.c_[np.arange(samples), u, y + 0.1 * rng.standard_normal(samples)]


def saved(path, rows):
    np.savetxt(path, rows, delimiter=",", header="time,u,y", comments="", fmt="%.10g")
    return path


def option_in(note):
    """File, first and last of the rows that a note proposes to leave out."""
    name, first, last = re.search(r"--without (?:(\S+):)?(\d+)-(\d+)", note).groups("")
    return (name, int(first), int(last))


def shifts_in(notes):
    return [note for note in notes if "which no input explains" in note]


@pytest.mark.slow
@pytest.mark.parametrize("at", [150, 260])
def test_explore_leaves_out_a_level_shift_and_finds_the_plant(at, tmp_path):
    log = saved(tmp_path / "log.csv", rows_of(400, at, 2))
    found = explore([log], Preparation())
    assert not found.reasons
    (told,) = shifts_in(found.results.result["exploration"]["steps"])
    assert "y rises about row" in told
    name, first, last = option_in(told)
    # Sample k stands in row k + 2.
    assert first <= at + 3 <= last
    theta, deviation = (
        found.results.result["identification"][key] for key in ("theta", "standard_deviation")
    )
    assert theta["K"] == pytest.approx(K, rel=0.03)
    assert abs(theta["K"] - K) < 3.5 * deviation["K"]
    assert abs(theta["T"] - T) < 3.5 * deviation["T"]
    # The option --without gives the same estimate.
    again = explore([log], Preparation(without=((name, first, last),))).results.result
    assert again["identification"]["theta"] == pytest.approx(theta, rel=1e-6)
    assert not shifts_in(again["notes"])


@pytest.mark.slow
def test_identify_reports_a_level_shift_and_leaving_it_out_decides_the_verdict(tmp_path):
    log, spec = saved(tmp_path / "log.csv", rows_of(400, 200, 3)), parse_spec(SPEC)
    (told,) = shifts_in(identify(spec, log).result["notes"])
    judged = assess(spec, log)
    assert judged.verdict == "undecided"
    assert told in judged.results.result["assessment"]["undecided"]
    without = Preparation(without=(option_in(told),))
    assert not shifts_in(identify(spec, log, preparation=without).result["notes"])
    assert assess(spec, log, preparation=without).verdict == "met"
    assert assess(spec, saved(tmp_path / "good.csv", rows_of(400, None, 3))).verdict == "met"


def found_with(samples, places, split="halves"):
    """A stand-in for an exploration of some samples that finds level shifts at these places."""
    shifts = tuple(
        LevelShift(
            0,
            at,
            0.0,
            at - 1,
            at + 2,
            True,
            ScoreTest("level_shift", "shift", 50.0, 1, 1e-9, None),
            50.0,
            99,
            True,
        )
        for at in places
    )
    estimate = SimpleNamespace(tests=SimpleNamespace(shifted=shifts))
    model = SimpleNamespace(outputs=1)
    return SimpleNamespace(
        estimate=estimate, samples=np.arange(samples), split=split, integrates=(), model=model
    )


@pytest.mark.parametrize(
    ("answers", "lengths", "taken"),
    [
        ([found_with(100, [])], (100,), 0),
        ([found_with(100, [40]), found_with(97, [])], (39, 58), 1),
        ([found_with(100, [40, 42]), found_with(95, [])], (39, 56), 1),
        ([found_with(100, [8, 60]), found_with(86, [])], (49, 38), 1),
        ([found_with(100, [40]), found_with(97, [], split="none")], (100,), 0),
        ([found_with(100, [40]), SpecError([])], (100,), 0),
        ([found_with(100, [40]), found_with(97, [70]), found_with(94, [])], (39, 30, 25), 2),
        ([found_with(100, [40]), found_with(97, [70]), found_with(94, [20])], (100,), 0),
    ],
)
def test_level_shifts_are_left_out_if_the_rest_suffices(monkeypatch, tmp_path, answers, lengths, taken):
    """Shifts overlap, leave too few samples, are all that determines the plant, or recur without end."""
    log = read_log(saved(tmp_path / "log.csv", rows_of(100, None, 1)), Preparation())
    given = iter(answers)

    def explored(*args, **settings):
        answer = next(given)
        if isinstance(answer, SpecError):
            raise answer
        return answer

    monkeypatch.setattr(exploring, "explore_records", explored)
    rest, found = exploring.explored_beside_shifts(log, loop=False)
    assert rest.lengths == lengths
    assert found is answers[taken]
    steps = " ".join(rest.notes)
    assert bool(shifts_in([steps])) == (rest.lengths != (100,))


LINEAR = "plant: {B: [0, 0.3], F: [1, -0.7]}\nnoise: {C: [1, 0.4], variance: 0.01}\n"


def log(path, slope, seed=4, samples=400):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], samples // 8), 8)
    y = lfilter([0, 0.3], [1, -0.7], u) + lfilter([1, 0.4], [1], 0.1 * rng.standard_normal(samples))
    columns = np.column_stack([u, y + slope * np.arange(samples)])
    np.savetxt(path, columns, delimiter=",", header="u,y", comments="")
    return path


@pytest.mark.first(1)
@pytest.mark.parametrize("detrend", ["linear", "auto"])
def test_removing_a_linear_trend_does_not_move_the_estimate(tmp_path, detrend):
    """The removed trend of the input passes the plant; it is not the trend fitted to the output."""
    spec, told = parse_spec(LINEAR, design=False), []
    for slope in (0.01, 0.03):
        data = log(tmp_path / f"{slope}.csv", slope)
        found = questions.identify(spec, data, preparation=Preparation(detrend=detrend)).result
        told.append(list(found["identification"]["theta"].values()))
    np.testing.assert_allclose(told[0], told[1], rtol=1e-5)


@pytest.mark.first(1)
@pytest.mark.parametrize(("gain", "code"), [(0.3, "noise-prevails"), (0.0, "output-unexplained")])
def test_random_walk_noise_larger_than_the_response_does_not_hide_the_gain(tmp_path, gain, code):
    """Reference: the likelihood ratio by least squares on differences, with known noise."""
    rng = np.random.default_rng(11)
    samples, deviation = 600, 0.3
    u = np.repeat(rng.choice([-1.0, 1.0], samples // 10), 10)
    walk = np.cumsum(deviation * rng.standard_normal(samples))
    y = lfilter([0, gain], [1, -0.7], u) + walk
    moves = np.diff(y)
    caused = np.diff(lfilter([0, 1.0], [1, -0.7], u))
    ratio = (caused @ moves) ** 2 / (caused @ caused) / deviation**2
    assert (ratio > 50.0) == bool(gain)
    data = tmp_path / "log.csv"
    np.savetxt(data, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    text = "plant: {B: [0, 0.3], F: [1, -0.7]}\nnoise: {drift: true, variance: 0.09}\n"
    found = questions.identify(parse_spec(text, design=False), data).result
    assert found["identification"]["fit_percent"] < 0.0
    either = {"noise-prevails", "output-unexplained"}
    assert [one["code"] for one in found["findings"] if one["code"] in either] == [code]
