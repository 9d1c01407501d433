"""Outlying values are reported; responses to white, few-level or rare inputs are not outlying."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.findings.outlying_values import outlying

N = 600
LINES = np.arange(2, N + 2)


def white(rng):
    return rng.standard_normal(N)


INPUTS = {
    "white": white,
    "uniform": lambda rng: rng.uniform(-1.0, 1.0, N),
    "two levels": lambda rng: np.sign(rng.standard_normal(N)),
    "three levels": lambda rng: rng.choice([-1.0, 0.0, 0.0, 0.0, 1.0], N),
    "two levels, held": lambda rng: np.repeat(np.sign(rng.standard_normal(N)), 3)[:N],
    "pulses": lambda rng: (rng.random(N) < 0.1) * rng.standard_normal(N),
    "rare pulses": lambda rng: 1.0 * (rng.random(N) < 0.03),
}


@pytest.mark.parametrize("make", INPUTS.values(), ids=INPUTS)
@pytest.mark.parametrize(("pole", "delay"), [(0.0, 0), (0.1, 7), (0.5, 1), (0.9, 20)])
def test_responses_that_the_input_explains_are_not_outlying(make, pole, delay):
    rng = np.random.default_rng(4)
    for noise in (1e-4, 1e-2, 0.3):
        u = make(rng)
        y = 20.0 + scipy.signal.lfilter([*np.zeros(delay), 1.0], [1.0, -pole], u)
        y += noise * rng.standard_normal(N)
        assert outlying("y", y, u[:, None], LINES) == []


@pytest.mark.parametrize("make", [white, INPUTS["two levels"]], ids=["white", "two levels"])
def test_outlying_outputs_are_found_with_a_white_input_too(make):
    rng = np.random.default_rng(5)
    u = np.column_stack([make(rng), make(rng)])
    y = scipy.signal.lfilter([0.0, 1.0], [1.0, -0.8], u @ [1.0, 0.5]) + 0.05 * rng.standard_normal(N)
    u[50] = np.nan  # a cell that is empty
    assert outlying("y", y, u, LINES) == []
    at = np.arange(10, N - 12, 12)
    y[at[:3]] += 80.0
    (told,) = outlying("y", y, u, LINES)
    assert (told.code, told.figures["rows"]) == ("outlying-values", [12, 24, 36])


def test_an_input_is_compared_with_its_own_values_alone():
    u = np.sign(np.random.default_rng(6).standard_normal(N))
    assert outlying("u", u, None, LINES) == []
    u[40] = -9999.0
    (told,) = outlying("u", u, None, LINES)
    assert (told.where, told.figures["rows"]) == ("u", [42])


def test_inputs_without_numbers_do_not_hide_an_outlying_output():
    """A logger may write inputs and outputs in turn."""
    y = np.random.default_rng(7).standard_normal(N)
    y[10] = 90.0
    (told,) = outlying("y", y, np.full((N, 2), np.nan), LINES)
    assert told.figures["rows"] == [12]
