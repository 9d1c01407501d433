"""Plants in s under digital controllers: polynomials, PID settings, single loops."""

import warnings

import cvxpy as cp
import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.least_cost.build import build_convex

MOTOR = "specs/motor_loop.yaml"
GAIN = np.array([[2.0, -0.5], [0.0, 1.2]])
DECAY = np.array([[1.0, 1.5], [0.8, 0.3]])
STEP = 0.4
REST = """
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment:
  samples: 500
  controller:
    numerator: [[[0.5, -0.4], [0.1]], [[0.0], [0.6, -0.5]]]
    denominator: [1, -1]
cost: {input_power: 1, output_power: [0.1, 0.2], excitation_power: 0.01}
accuracy: {model_error: {relative: 0.1, alpha: 3}}
spectrum: {type: fir, order: 1}
"""


def rows(matrix):
    return np.asarray(matrix).tolist()


HELD = f"""
sample_time: {STEP}
plant:
  continuous:
    numerator: {rows(GAIN[..., None])}
    denominator: {rows(np.stack([np.ones((2, 2)), DECAY], axis=-1))}
  sample: zoh
{REST}"""


def test_a_limit_on_the_output_of_a_loop_holds_for_the_record():
    """The loop is simulated under the record, sample by sample."""
    spec = load_spec(
        MOTOR,
        [
            "limits.amplitude.output=0.02",
            "spectrum.order=5",
            "signal.candidates=2",
            "solver.any_spectrum=false",
        ],
    )
    outcome = solve(spec)
    r = np.asarray(outcome.tables["signal"].columns["r1"])[:, None]
    y, u = build_experiment(spec).loop.signals(r, np.zeros_like(r))
    assert np.abs(y).max() <= 0.02 * (1 + 1e-9)
    entry = outcome.result["signal"]
    assert entry["output_peak"][0] == pytest.approx(np.abs(y).max(), rel=1e-9)
    assert entry["input_power"][0] == pytest.approx(np.mean(u**2), rel=1e-9)
    assert entry["worst_ratio"] <= 1 + 1e-6


WORDED = """
sample_time: 0.5
noise: {variance: 0.1}
accuracy: {model_error: {relative: 0.1, band: [0.05, 1.5]}}
spectrum: {type: fir, order: 3}
signal: {samples: 60, seed: 1}
"""
ONE = "{continuous: {gain: 2.0, time_constant: 3.0, dead_time: 0.7}, sample: zoh}"
TWO = """{sample: zoh, continuous: {numerator: [[[1.0], [0.2]], [[0.1], [1.5]]],
  denominator: [[[2, 1], [3, 1]], [[3, 1], [1, 1]]]}}"""


def spec_of(controller, plant=ONE, **kwargs):
    experiment = f"experiment: {{samples: 300, controller: {controller}}}"
    return parse_spec(f"plant: {plant}\n{experiment}\n{WORDED}", **kwargs)


# Kp (1 + h/2/Ti (1 + q)/(1 - q)) with Kp = 0.4, Ti = 2.5, h = 0.5, and with hold and backward differences
PI = {
    "tustin": "numerator: [0.44, -0.36], denominator: [1, -1]",
    "backward": "numerator: [0.48, -0.4], denominator: [1, -1]",
    "zoh": "numerator: [0.4, -0.32], denominator: [1, -1]",
}


@pytest.mark.parametrize("rule", PI)
def test_a_pid_controller_equals_its_polynomials_under_each_sampling_rule(rule):
    words = [
        f"{{pid: {{Kp: 0.4, Ti: 2.5, sample: {rule}}}}}",
        f"{{continuous: {{numerator: [1.0, 0.4], denominator: [2.5, 0]}}, sample: {rule}}}",
        f"{{{PI[rule]}}}",
    ]
    w = np.array([0.0, 0.1, 2.0])
    found = [build_experiment(spec_of(one)).excitation_gradient(w) for one in words]
    for gradient in found:
        np.testing.assert_allclose(gradient, found[0], rtol=1e-9, atol=1e-12)


def test_a_controller_delay_of_one_multiplies_its_response_by_exp_minus_jw():
    w = np.array([0.1, 1.0])
    late = build_experiment(spec_of("{pid: {Kp: 0.4, Ti: 2.5}, delay: 1}")).loop.controller.at(w)
    soon = build_experiment(spec_of("{pid: {Kp: 0.4, Ti: 2.5}}")).loop.controller.at(w)
    np.testing.assert_allclose(late[:, 0, 0], soon[:, 0, 0] * np.exp(-1j * w))


def test_single_loops_equal_a_diagonal_controller_matrix():
    loops = """{loops: [{output: 1, input: 1, controller: {pid: {Kp: 0.4, Ti: 2.5}}},
      {output: 2, input: 2, controller: {numerator: [0.3]}}]}"""
    matrix = "{numerator: [[[0.44, -0.36], [0]], [[0], [0.3]]], denominator: [[[1, -1], [1]], [[1], [1]]]}"
    made = [build_experiment(spec_of(one, TWO)) for one in (loops, matrix)]
    w = np.array([0.0, 0.2, 2.0])
    gradients = [experiment.excitation_gradient(w) for experiment in made]
    np.testing.assert_allclose(gradients[0], gradients[1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(made[0].noise_information, made[1].noise_information, rtol=1e-9, atol=1e-12)


def motor(theta, w):
    """G of the motor at theta = (b0, a0, a1), by scipy."""
    top, bottom, _ = scipy.signal.cont2discrete(([theta[0]], [1, theta[2], theta[1]]), 0.05, "zoh")
    return scipy.signal.freqz(top[0], bottom, w)[1]


@pytest.mark.slow
def test_the_design_of_the_motor_is_that_of_a_semidefinite_program():
    """The least cost of r of order 3: relative parameters, sums over a circle, LMIs at 180 frequencies."""
    spec = load_spec(MOTOR, ["spectrum.order=3"])
    found = build_convex(spec).designed().design.result
    theta, samples, variance, order = np.array([2.0, 20.02, 12.0]), 600, 2.5e-5, 3

    def gradient(w):
        steps = 1e-5 * np.diag(theta)
        return np.array([(motor(theta + h, w) - motor(theta - h, w)) / 2e-5 for h in steps])

    def controller(w):
        return (40 - 36.2 * np.exp(-1j * w)) / (1 - np.exp(-1j * w))

    w = (np.arange(8192) + 0.5) * 2 * np.pi / 8192  # off the pole of the integrator
    G, C, D = motor(theta, w), controller(w), gradient(w)
    S = 1 / (1 + C * G)
    cosines = np.array([np.ones(w.size)] + [2 * np.cos(k * w) for k in range(1, order + 1)])
    price = cosines @ (np.abs(S) ** 2 * (1 + 1000 * np.abs(G) ** 2)) / w.size
    noise = samples / w.size * ((D * C * S) @ (D * C * S).conj().T).real
    maps = [samples / variance / w.size * ((D * S * c) @ (D * S).conj().T).real for c in cosines]
    at = np.concatenate(
        [np.geomspace(1e-3, np.pi, 60), np.linspace(0.2, 0.9, 60), np.linspace(0.465, 0.478, 60)]
    )
    r_adm = (np.abs(1 + controller(at) * motor(theta, at)) - 10 ** (-5 / 20)) / np.abs(controller(at))
    T = gradient(at) * np.sqrt(scipy.stats.chi2.ppf(0.95, 3)) / r_adm
    x = cp.Variable(order + 1)
    scale = np.sqrt(np.diag(maps[0]))
    M = (noise + sum(x[k] * maps[k] for k in range(order + 1))) / np.outer(scale, scale)
    grid = np.linspace(0, np.pi, 500)
    constraints = [1 * x[0] + sum(2 * np.cos(k * grid) * x[k] for k in range(1, order + 1)) >= 0]
    for column in T.T:
        R = np.stack([column.real, column.imag]) / scale
        constraints.append((M + M.T) / 2 - R.T @ R >> 0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = cp.Problem(cp.Minimize(price @ x), constraints).solve(solver=cp.CLARABEL)
    assert found.objective == pytest.approx(expected, rel=2e-5)
