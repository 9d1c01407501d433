"""The norm of the model error and the sensitivity of a loop with several channels."""

import warnings

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli import solve
from inputdesign_cli.accuracy import Absolute, Sensitivity
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, TransferMatrix
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import parse_spec
from tests.support.matrix_specs import IN_LOOP

SPEC = IN_LOOP + "accuracy: {model_error: {sensitivity: {max_db: 7}}}\n"
OPEN = """
plant: {A: [1, -0.5], B: [[[0, 1.0], [0, 0.4]], [[0, -0.3], [0, 0.8]]]}
noise: {variance: [[1.0, 0.3], [0.3, 0.5]]}
experiment: {samples: 100}
accuracy: {model_error: {absolute: 0.2, alpha: 3, norm: frobenius}}
spectrum: {type: fir, order: 1}
"""
GRID = np.linspace(1e-3, np.pi, 400)


def designed(text, *overrides):
    spec = parse_spec(text, overrides=[*overrides, "solver.any_spectrum=false"])
    return build_convex(spec).designed().design


@pytest.fixture(scope="module")
def design():
    return designed(SPEC)


def responses(loop, w):
    """G and C (n, 2, 2)."""
    return loop.model.plant_at(w), loop.controller.at(w)


def random_errors(rng, n, size):
    error = rng.standard_normal((n, size, size)) + 1j * rng.standard_normal((n, size, size))
    return error / np.linalg.norm(error, 2, axis=(1, 2))[:, None, None]


def test_every_error_below_r_adm_keeps_the_sensitivity(design):
    """The errors have random phases and directions at every frequency; r_adm is positive."""
    requirement = design.problem.requirements[0]
    G, C = responses(requirement.experiment.loop, GRID)
    bound = requirement.admissible.at(GRID)
    assert bound.min() > 0
    rng = np.random.default_rng(0)
    for _ in range(30):
        changed = G + random_errors(rng, GRID.size, 2) * bound[:, None, None]
        S = np.linalg.inv(np.eye(2) + changed @ C)
        assert np.linalg.norm(S, 2, axis=(1, 2)).max() <= 10 ** (7 / 20) * (1 + 1e-9)


def test_r_adm_is_no_smaller_than_by_the_triangle_inequality(design):
    """With s(D C) <= s(D) s(C), no model would suffice where only one channel has integral action."""
    requirement = design.problem.requirements[0]
    w = np.array([0.8])
    G, C = responses(requirement.experiment.loop, w)
    S = np.linalg.inv(np.eye(2) + G @ C)[0]
    bound = requirement.admissible.at(w)[0]
    expected = (1 - np.linalg.norm(S, 2) / 10 ** (7 / 20)) / np.linalg.norm(C[0] @ S, 2)
    assert bound == pytest.approx(expected, rel=1e-9)
    plain = (1 / np.linalg.norm(S, 2) - 10 ** (-7 / 20)) / np.linalg.norm(C[0], 2)
    assert bound >= plain * (1 - 1e-12)  # never less than the bound by s(C) s(D)


def test_models_of_the_ellipsoid_keep_the_sensitivity(design):
    """Boundary of the confidence ellipsoid, G changed to first order in the parameters."""
    requirement, found = design.problem.requirements[0], design.result
    assert found.gap < 1e-6
    experiment = requirement.experiment
    G, C = responses(experiment.loop, GRID)
    raw = experiment.model.plant_gradient(GRID)
    gradient = np.einsum("kl,nlpr->nkpr", experiment.from_raw, raw)
    half = np.linalg.inv(np.linalg.cholesky(found.information)).T
    rng = np.random.default_rng(1)
    peak, largest = 0.0, 0.0
    for _ in range(100):
        step = rng.standard_normal(len(half))
        change = np.einsum("k,nkpr->npr", half @ step * (requirement.alpha / np.linalg.norm(step)), gradient)
        largest = max(largest, (np.linalg.norm(change, axis=(1, 2)) / requirement.admissible.at(GRID)).max())
        peak = max(peak, np.linalg.norm(np.linalg.inv(np.eye(2) + (G + change) @ C), 2, axis=(1, 2)).max())
    assert largest <= 1 + 1e-9
    assert peak <= 10 ** (7 / 20)


def test_r_adm_of_one_channel_is_the_siso_bound():
    A, B = [1, -0.9], [0, 0.5, 0.2]
    numerator, denominator, W = [0.4, -0.3], [1, -1], Rational.build([0.5, 0.1], [1, -0.3])
    loop = Loop(PolynomialModel.single(B, A=A), TransferMatrix.build([[numerator]], [[denominator]]))
    q = np.exp(-1j * GRID)
    G, C = np.polyval(B[::-1], q) / np.polyval(A[::-1], q), np.polyval(numerator[::-1], q) / (1 - q)
    weight = (0.5 + 0.1 * q) / (1 - 0.3 * q)
    expected = (np.abs(1 + C * G) - np.abs(weight)) / np.abs(C)
    np.testing.assert_allclose(Sensitivity(loop, W).at(GRID), expected, rtol=1e-9)


def gradients(values, w):
    """dG (n, k, 4) of the common A and the four gains by central differences, parameters in order."""

    def plant(theta):
        q = np.exp(-1j * w)
        return np.stack([theta[1 + i] * q / (1 + theta[0] * q) for i in range(4)], axis=1)

    columns = []
    for k in range(5):
        up, down = values.copy(), values.copy()
        up[k] += 1e-6
        down[k] -= 1e-6
        columns.append((plant(up) - plant(down)) / 2e-6)
    return np.stack(columns, axis=1)


@pytest.mark.slow
def test_a_design_for_the_frobenius_norm_is_that_of_a_semidefinite_program():
    """Least power with T P T^T <= (r_adm / alpha)^2 at 60 frequencies, all in raw parameters."""
    design = designed(OPEN)
    problem, found = design.problem, design.result
    assert found.gap < 1e-6
    raw = [problem.experiment.to_raw(m) for m in problem.information_map]
    baseline = problem.experiment.to_raw(problem.baseline_information)
    Q = cp.Variable((4, 4), PSD=True)
    c0, c1 = Q[:2, :2] + Q[2:, 2:], Q[2:, :2]
    x = cp.hstack([c0[0, 0], c0[0, 1], c0[1, 1], c1[0, 0], c1[0, 1], c1[1, 0], c1[1, 1]])
    M = baseline + sum(x[i] * raw[i] for i in range(7))
    constraints = []
    w = np.linspace(0.0, np.pi, 60)
    for T in gradients(np.array([-0.5, 1.0, 0.4, -0.3, 0.8]), w):
        rows = np.concatenate([T.T.real, T.T.imag]) * (3 / 0.2)
        constraints.append((M + M.T) / 2 - rows.T @ rows >> 0)
    program = cp.Problem(cp.Minimize(cp.trace(c0)), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = program.solve(solver=cp.CLARABEL)
    assert problem.experiment.model.names == ("a1", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]")
    assert found.objective == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_the_norm_costs_more_than_the_entries_and_is_reported():
    entries = designed(OPEN, "accuracy.model_error.norm=entry").result.objective
    outcome = solve(parse_spec(OPEN))
    assert outcome.result["cost"] > entries
    assert outcome.result["requirements"][0]["norm"] == "frobenius"
    assert outcome.result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    columns = outcome.tables["bound"].columns
    assert np.all(columns["r_u"] <= columns["r_adm"] * (1 + 1e-6))
    requirement = designed(OPEN).problem.requirements[0]
    assert requirement.of_the_norm
    assert isinstance(requirement.admissible, Absolute)
