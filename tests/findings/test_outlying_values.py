"""Faults of measurement are told; what a plant answers to white, few-level or rare inputs is none."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.findings.outlying_values import outlying_inputs, outlying_outputs

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
def test_what_the_input_explains_is_no_fault(make, pole, delay):
    rng = np.random.default_rng(4)
    for noise in (1e-4, 1e-2, 0.3):
        u = make(rng)
        y = 20.0 + scipy.signal.lfilter([*np.zeros(delay), 1.0], [1.0, -pole], u)
        y += noise * rng.standard_normal(N)
        assert outlying_outputs("y", y, u[:, None], LINES) == []


@pytest.mark.parametrize("make", [white, INPUTS["two levels"]], ids=["white", "two levels"])
def test_faults_are_told_beside_a_white_input_too(make):
    rng = np.random.default_rng(5)
    u = np.column_stack([make(rng), make(rng)])
    y = scipy.signal.lfilter([0.0, 1.0], [1.0, -0.8], u @ [1.0, 0.5]) + 0.05 * rng.standard_normal(N)
    u[50] = np.nan  # a cell that is empty
    assert outlying_outputs("y", y, u, LINES) == []
    at = np.arange(10, N - 12, 12)
    few, many = y.copy(), y.copy()
    few[at[:3]] += 80.0
    many[at] += 40.0
    (told,) = outlying_outputs("y", few, u, LINES)
    assert (told.code, told.figures["rows"]) == ("outlying-values", [12, 24, 36])
    (told,) = outlying_outputs("y", many, u, LINES)
    assert (told.code, told.figures["values"]) == ("outlying-values", 49)


def test_an_input_is_judged_by_itself():
    u = np.sign(np.random.default_rng(6).standard_normal(N))
    assert outlying_inputs("u", u, LINES) == []
    u[40] = -9999.0
    (told,) = outlying_inputs("u", u, LINES)
    assert (told.where, told.figures["rows"]) == ("u", [42])


def test_an_input_without_numbers_beside_the_output_explains_nothing():
    """As where a logger writes inputs and outputs in turn."""
    y = np.random.default_rng(7).standard_normal(N)
    y[10] = 90.0
    (told,) = outlying_outputs("y", y, np.full((N, 2), np.nan), LINES)
    assert told.figures["rows"] == [12]


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("angle", [1.3, 2.4])
@pytest.mark.parametrize("samples", [100, N])
def test_the_noise_of_a_resonance_is_no_fault_and_spikes_upon_it_are(angle, samples, noise):
    """Noise through poles of radius 0.97, in which every third value may lie between its neighbours."""
    A = np.convolve([1.0, -1.94 * np.cos(angle), 0.9409], [1.0, -1.6, 0.92])
    for seed in range(5):
        rng = np.random.default_rng(seed)
        u = np.zeros((samples, 1))
        y = scipy.signal.lfilter([1.0], A, rng.standard_normal(samples)) + noise * rng.standard_normal(
            samples
        )
        assert outlying_outputs("y", y, u, LINES[:samples]) == []
        at = np.arange(6, samples, 12)
        y[at] += 60.0 * np.std(y)
        (told,) = outlying_outputs("y", y, u, LINES[:samples])
        assert told.figures["values"] == at.size
