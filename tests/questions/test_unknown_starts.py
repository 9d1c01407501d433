"""Records that need a start from rest are reported, with the error for unknown starts by regression."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.identification import information_of_data
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.questions.common.task import growth_by_start
from inputdesign_cli.questions.least_cost.build import build_convex

N = 500
DOUBLE = """
sample_time: 0.1
plant: {parameters: {J: 2}, continuous: {numerator: ["1/J"], denominator: [1, 0, 0]}, sample: zoh}
noise: {variance: 0.0001}
experiment: {samples: 500}
accuracy: {standard_deviation: {J: 0.01}}
spectrum: {type: multisine, lines: 50}
"""
SINGLE = """
plant: {B: [0, 0.1], F: [1, -1], known: [f1]}
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {standard_deviation: {b1: 0.001}}
spectrum: {type: multisine, lines: 50}
"""
SETTLED = SINGLE.replace("F: [1, -1]", "F: [1, -0.8]")


def solved(text):
    done = solve(parse_spec(text))
    return done, [one for one in done.result.get("findings", []) if one["code"] == "start-from-rest"]


def residual_norm(psi, starts):
    """The norm of a gradient (N,) after regression on unknown starts (N, m)."""
    return np.linalg.norm(psi - starts @ np.linalg.lstsq(starts, psi, rcond=None)[0])


def growth(found):
    (one,) = found
    return one["figures"]["growth"]


def test_unknown_position_velocity_and_level_raise_the_error_of_an_inertia():
    """y = u / (J s^2) behind a hold, by recursion; the start adds a line, a level of u a parabola."""
    done, notes = solved(DOUBLE)
    u, h, J = done.tables["signal"].columns["u1"], 0.1, 2.0
    y = scipy.signal.lfilter(h**2 / 2 * np.array([0.0, 1.0, 1.0]), [1.0, -2.0, 1.0], u) / J
    psi = -y / J
    assert 0.01 / np.linalg.norm(psi) == pytest.approx(0.01, rel=1e-6)
    line = np.column_stack([np.ones(N), np.arange(N) / N])
    curve = np.column_stack([line, line[:, 1] ** 2])
    assert np.linalg.norm(psi) / residual_norm(psi, line) > 20.0
    assert growth(notes) == pytest.approx(np.linalg.norm(psi) / residual_norm(psi, curve), rel=5e-3)


def test_an_unknown_start_raises_the_error_of_an_integrator():
    done, notes = solved(SINGLE)
    psi = scipy.signal.lfilter([0.0, 1.0], [1.0, -1.0], done.tables["signal"].columns["u1"])
    line = np.column_stack([np.ones(N), np.arange(N) / N])
    expected = pytest.approx(np.linalg.norm(psi) / residual_norm(psi, line), rel=5e-3)
    assert growth(notes) == expected
    assert done.result["signal"]["begun_anywhere"] == expected


def test_the_growth_by_an_unknown_start_bounds_that_by_the_information():
    task = build_convex(parse_spec(SETTLED))
    record, nominal = task.delivered().record, task.simulation.nominal
    experiment = replace(nominal, samples=len(record))
    plant = FiniteRecord(experiment, len(record))
    found = growth_by_start(
        experiment, record, 1.0, [make(experiment) for make in task.asked.question.requirements]
    )
    anywhere = information_of_data(experiment.model, record, plant.signals("output", record), free=True)
    (exact,) = np.sqrt(np.diag(plant.information(record)) / np.diag(plant.known + anywhere))
    assert 1.0 < exact <= found < 1.2  # a bound suffices where nothing is reported


@pytest.mark.parametrize("D", [[1.0], [1.0, -0.6]], ids=["white", "coloured"])
@pytest.mark.parametrize("F", [[1.0, -0.8], [1.0, -1.0], [1.0, -1.5, 0.7]], ids=["lag", "tank", "spring"])
def test_information_with_an_unknown_start_is_that_of_generalised_least_squares(F, D):
    """Gradients by differences are weighted by the noise covariance; starts are all states of 1/F."""
    text = f"plant: {{B: [0, 0.5], F: {F}}}\nnoise: {{D: {D}, variance: 0.3, known: [d1]}}\n"
    model = build_model(parse_spec(text.replace(", known: [d1]", "") if len(D) == 1 else text, design=False))
    u = np.random.default_rng(4).standard_normal(80)

    def output(theta):
        return scipy.signal.lfilter([0, theta[0]], [1.0, *theta[1:]], u)

    theta, step = np.array([0.5, *F[1:]]), 1e-6
    psi = np.array([(output(theta + d) - output(theta - d)) / (2 * step) for d in step * np.eye(theta.size)])
    pole = -D[-1] if len(D) > 1 else 0.0
    V = 0.3 / (1.0 - pole**2) * scipy.linalg.toeplitz(pole ** np.arange(80))
    white = np.linalg.inv(np.linalg.cholesky(V))
    # A level, the states of 1/F; where that integrates, a level of u.
    X = [np.ones(80), *(scipy.signal.lfilter([1.0], F, row) for row in np.eye(len(F) - 1, 80))]
    X = np.array([*X, *([scipy.signal.lfilter([1.0], F, np.ones(80))] if sum(F) == 0.0 else [])]).T
    rest = white @ (psi.T - X @ np.linalg.lstsq(white @ X, white @ psi.T, rcond=None)[0])
    y = scipy.signal.lfilter([0, 0.5], F, u)
    found = information_of_data(model, u[:, None], y[:, None], free=True)
    assert found[: theta.size, : theta.size] == pytest.approx(rest.T @ rest, rel=1e-5)
