"""Outputs that a historian has drawn between the values that it keeps."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import interpolated_outputs

SAMPLES = 600


def answer(rng, noise):
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)
    return u, scipy.signal.lfilter([0.0, 0.1], [1.0, -0.9], u) + noise * rng.standard_normal(SAMPLES)


@pytest.mark.parametrize("every", [3, 10, 25])
def test_lines_between_values_are_seen(every):
    u, y = answer(np.random.default_rng(1), 0.05)
    at = np.arange(0, SAMPLES, every)
    drawn = np.interp(np.arange(SAMPLES), at, y[at])
    assert interpolated_outputs([(u[:, None], np.column_stack([y, drawn]))]) == [1]


@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("rounded", [None, 1, 2])
def test_what_was_measured_is_none(noise, rounded):
    u, y = answer(np.random.default_rng(2), noise)
    y = y if rounded is None else np.round(y, rounded)
    assert interpolated_outputs([(u[:, None], y[:, None])]) == []


def test_a_value_that_is_repeated_is_no_line():
    u, y = answer(np.random.default_rng(3), 0.05)
    assert interpolated_outputs([(u[:, None], np.repeat(y[::5], 5)[:, None])]) == []
    assert interpolated_outputs([(u[:, None], np.ones((SAMPLES, 1)))]) == []
