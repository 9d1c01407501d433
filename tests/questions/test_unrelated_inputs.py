"""Inputs that are not what moved the plant, or not when they say, leave the verdict open."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import assess, identify, parse_spec
from inputdesign_cli.identification import identify as estimate
from inputdesign_cli.identification.response_chance import like_nothing
from inputdesign_cli.plant import PolynomialModel

SPEC = """
plant: {A: [1, -0.7], B: [0, 3.6]}
noise: {variance: 1.0}
experiment: {samples: 600}
accuracy: {standard_deviation: {a1: 0.05, b1: 0.3}}
spectrum: {type: white}
"""
SAMPLES = 600


def record(seed, gain=3.6):
    """u and y of the plant of the spec, with another gain."""
    rng = np.random.default_rng(seed)
    u, e = rng.choice([-1.0, 1.0], SAMPLES + 20), rng.standard_normal(SAMPLES + 20)
    return u, scipy.signal.lfilter([0.0, gain], [1.0, -0.7], u) + scipy.signal.lfilter([1.0], [1.0, -0.7], e)


def verdict(tmp_path, u, y, spec=SPEC):
    path = tmp_path / "log.csv"
    path.write_text("u,y\n" + "".join(f"{a:.12g},{b:.12g}\n" for a, b in zip(u, y, strict=True)))
    found = assess(parse_spec(spec), path)
    told = identify(parse_spec(spec), path).result.get("notes", [])
    return found.verdict, " ".join(found.results.result["assessment"].get("undecided", [])), " ".join(told)


def test_the_record_as_it_is_meets_what_is_asked(tmp_path):
    u, y = record(1)
    assert verdict(tmp_path, u, y)[0] == "met"


@pytest.mark.parametrize("late", [2, 3, 6, 12])
def test_an_input_that_was_logged_late_answers_the_noise(late, tmp_path):
    """b1 would be told as 0 +- 0.15: small enough, and wrong."""
    u, y = record(2)
    logged = np.concatenate([np.full(late, u[0]), u[:-late]])
    found, why, notes = verdict(tmp_path, logged[20:], y[20:])
    assert found == "undecided"
    assert "logged late" in why
    assert "logged late" in notes


def test_swapped_columns_are_no_plant(tmp_path):
    u, y = record(3)
    found, why, _ = verdict(tmp_path, y, u)
    assert found == "undecided"
    assert "columns are swapped" in why


def test_an_input_of_another_experiment_explains_nothing(tmp_path):
    u, _ = record(4)
    _, y = record(5)
    found, why, _ = verdict(tmp_path, u, y)
    assert found == "undecided"
    assert why.startswith("An input explains nothing: u ")


def test_a_gain_that_is_small_in_the_spec_as_well_may_be_zero(tmp_path):
    """Where the plant of the spec is as near to zero as the estimate, nothing is contradicted."""
    u, y = record(6, gain=0.02)
    found, why, _ = verdict(tmp_path, u, y, SPEC.replace("3.6", "0.02"))
    assert found == "met", why


@pytest.mark.first(1)
@pytest.mark.parametrize("u", ["held", "sines", "drifting"])
def test_inputs_that_are_foretold_by_their_own_past_answer_nothing(u, tmp_path):
    """Of three short records of right models none is blamed, whatever moves the plant, after a dead time."""
    spec = SPEC.replace("B: [0, 3.6]", "B: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3.6]").replace("b1", "b10")
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
        assert "logged late" not in verdict(tmp_path, moved, y, spec)[1]


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "share"), [(0.0, 1.0), (1.0, 0.0)])
def test_an_output_that_no_input_moves_is_told_from_one_that_some_moves(gain, share):
    """By the statistic of Wald, at one in a thousand; the first of two inputs has the gain."""
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
        found.append(like_nothing(model.at(one.theta, one.noise), one))
    assert np.mean([len(each) for each in found]) == share
