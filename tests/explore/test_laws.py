"""Inputs that follow from the outputs, and inputs that somebody sets."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import (
    answers_between_moves,
    answers_output,
    only_answers,
    set_apart,
    together_at_once,
)
from tests.support.loops import LAWS, SAMPLES, loop


@pytest.mark.parametrize("dither", [0.0, 0.1])
def test_an_input_that_only_answers_is_noticed(dither):
    rng = np.random.default_rng(14)
    e, d = rng.standard_normal((2, 800))
    y, u = np.zeros(800), np.zeros(800)
    for k in range(1, 800):
        y[k] = 0.9 * y[k - 1] + 0.4 * u[k - 1] + e[k]
        u[k] = u[k - 1] - 0.5 * y[k] + 0.4 * y[k - 1] + dither * d[k]
    assert only_answers([(u[:, None], y[:, None])]) == ([] if dither else [0])


def test_a_sinusoid_is_no_answer():
    u = np.sin(0.3 * np.arange(500.0))[:, None]
    assert only_answers([(u, u + 0.1 * np.random.default_rng(1).standard_normal(u.shape))]) == []


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("seed", range(5))
def test_a_controller_whose_reference_moves_a_few_times_is_seen(law, seed):
    """Its input tells the past of the output, so that nothing new in that helps to tell the input."""
    assert [j for j, p in answers_output([loop(seed, law)]) if p < 1e-6] == [0]


@pytest.mark.parametrize("level", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("seed", range(10))
def test_inputs_of_an_open_loop_follow_no_law(level, seed):
    """Of a plant that answers at once; without noise a law holds everywhere in its records."""
    rng = np.random.default_rng(seed)
    slow = scipy.signal.lfilter([1], [1, -rng.uniform(0.3, 0.98)], rng.standard_normal(SAMPLES))
    for u in (slow, rng.choice([-1.0, 1.0], SAMPLES), np.repeat(rng.standard_normal(SAMPLES // 5), 5)):
        v = level * np.std(u) * rng.standard_normal(SAMPLES)
        y = scipy.signal.lfilter([1, 0.4], [1, -0.8], u) + (v if level else 0.0)
        told = answers_between_moves([(u[:, None], y[:, None])])
        assert told == [] or (level and level < 5e-3 and u is slow)


SET = {
    "held": lambda rng: np.repeat(rng.standard_normal(SAMPLES // 5), 5),
    "switched": lambda rng: rng.choice([-1.0, 0.0, 2.0], SAMPLES),
    "periodic": lambda rng: np.tile(np.cumsum(rng.standard_normal(200)), 4),
    "white": lambda rng: rng.standard_normal(SAMPLES),
}


@pytest.mark.parametrize("make", SET.values(), ids=SET)
def test_inputs_that_somebody_sets_tell_so(make):
    assert all(
        set_apart([(make(np.random.default_rng(s))[:, None], np.zeros((SAMPLES, 1)))], 0) for s in (1, 2)
    )


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_answers_of_a_controller_do_not(law):
    for steps, reported in ((0.0, 0.02), (0.3, 0.02), (0.3, 0.0)):
        u, y = loop(3, law, steps=steps, reported=reported)
        assert not set_apart([(u, y)], 0)
        assert together_at_once([(u, y)]).tolist() == [[True]]


def test_what_comes_a_sample_later_does_not_go_together_at_once():
    rng = np.random.default_rng(8)
    u = scipy.signal.lfilter([1], [1, -0.9], rng.standard_normal((SAMPLES, 2)), axis=0)
    y = np.column_stack([u[:, 1] + 0.3 * rng.standard_normal(SAMPLES), np.roll(u[:, 0], 1)])
    y[:, 1] += rng.standard_normal(SAMPLES)
    assert together_at_once([(u, y)]).tolist() == [[False, True], [False, False]]
