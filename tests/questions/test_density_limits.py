"""Bounds on the spectrum matrix of several inputs, against semidefinite programs on a frequency grid."""

import warnings

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import parse_spec
from inputdesign_cli.spectrum import FirBasis, PolynomialBasis
from tests.support.matrix_specs import ARX

FIR = ARX + "accuracy: {criterion: D}\nlimits: {input_power: 8, spectrum: {max: 5, min: 3.6}}\n"
GRID = np.linspace(0.0, np.pi, 801)


def designed(text, *overrides):
    spec = parse_spec(text, overrides=[*overrides, "solver.any_spectrum=false"])
    return build_convex(spec).designed().design


def semidefinite_program(design, order, upper, lower, power):
    """The largest log det M over real Gram matrices with lower I <= Phi <= upper I at 41 frequencies."""
    problem = design.problem
    Q = cp.Variable((2 * (order + 1), 2 * (order + 1)), PSD=True)
    c = [
        sum(Q[2 * (s + t) : 2 * (s + t) + 2, 2 * s : 2 * s + 2] for s in range(order + 1 - t))
        for t in range(order + 1)
    ]
    later = [c[t][i, j] for t in range(1, order + 1) for i in (0, 1) for j in (0, 1)]
    x = cp.hstack([c[0][0, 0], c[0][0, 1], c[0][1, 1], *later])
    maps = problem.information_map
    M = problem.baseline_information + sum(x[i] * maps[i] for i in range(len(maps)))
    constraints = [cp.trace(c[0]) <= power]
    for w in np.linspace(0.0, np.pi, 41):
        real = c[0] + sum(np.cos(w * t) * (c[t] + c[t].T) for t in range(1, order + 1))
        imag = sum(np.sin(w * t) * (c[t].T - c[t]) for t in range(1, order + 1))
        phi = cp.bmat([[real, -imag], [imag, real]])
        constraints += [upper * np.eye(4) - phi >> 0, phi - lower * np.eye(4) >> 0]
    program = cp.Problem(cp.Maximize(cp.log_det((M + M.T) / 2)), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return program.solve(solver=cp.CLARABEL)


@pytest.mark.slow
def test_the_d_optimum_between_two_bounds_is_that_of_a_semidefinite_program():
    design = designed(FIR, "spectrum={type: fir, order: 2}")
    found = design.result
    assert found.gap < 1e-6
    eigenvalues = np.linalg.eigvalsh(found.basis.density(found.x, GRID))
    assert eigenvalues.max() <= 5 * (1 + 1e-7)
    assert eigenvalues.max() > 5 * (1 - 1e-4)
    assert eigenvalues.min() >= 3.6 * (1 - 1e-7)
    expected = semidefinite_program(design, 2, 5.0, 3.6, 8.0)
    # Between its 41 frequencies the program may exceed the bounds a little.
    assert np.linalg.slogdet(found.information)[1] == pytest.approx(expected, abs=3e-4)
    free = designed(FIR, "spectrum={type: fir, order: 3}", "limits.spectrum=100")
    assert found.objective > free.result.objective * (1 + 1e-3)


def test_a_polynomial_density_of_one_input_keeps_and_reaches_its_bounds():
    text = "plant: {B: [[[0, 1, 0.3]]], A: [1, -0.8]}\nnoise: {variance: 0.1}\naccuracy: {criterion: E}\n"
    text += "limits: {input_power: 1, spectrum: {max: 1.15, min: 0.9}}\n"
    design = designed(text, "spectrum={type: polynomial, order: 6, band: [0, 3]}")
    phi = design.result.basis.density(design.result.x, np.linspace(0.0, 3.0, 2001))
    assert design.result.gap < 1e-6
    assert 0.9 * (1 - 1e-6) <= phi.min() < 0.9 * (1 + 1e-3)
    assert 1.15 * (1 - 1e-3) < phi.max() <= 1.15 * (1 + 1e-6)


@pytest.mark.slow
def test_an_accuracy_that_white_excitation_at_the_bound_misses_is_infeasible():
    """Phi <= level I has no more information than white excitation of that level."""
    asked = ARX + "accuracy: {model_error: {relative: 0.05}}\nspectrum: {type: fir, order: 2}\n"
    level = designed(asked).white_power / 2
    with pytest.raises(InfeasibleError):
        designed(asked, f"limits.spectrum={0.99 * level}")


@pytest.mark.parametrize(
    "basis",
    [FirBasis(1, 4), FirBasis(2, 3), PolynomialBasis(2, 3), PolynomialBasis(3, 2, (0.5, 2.0), True)],
    ids=["fir", "matrix fir", "real polynomial", "complex polynomial"],
)
def test_a_directed_functional_is_the_density_along_that_direction(basis):
    rng = np.random.default_rng(0)
    r = getattr(basis, "inputs", 1)
    x = rng.standard_normal(basis.size)
    v = rng.standard_normal(r) + 1j * rng.standard_normal(r)
    v = v / np.linalg.norm(v) if r > 1 else np.ones(1)
    phi = np.asarray(basis.density(x, np.array([0.7]))).reshape(1, r, r)[0]
    assert basis.directed(0.7, v) @ x == pytest.approx((v.conj() @ phi @ v).real, rel=1e-12)


@pytest.mark.slow
def test_a_bound_on_the_density_raises_the_least_cost_but_not_above_white():
    asked = ARX + "accuracy: {standard_deviation: {'a1[1]': 0.001, 'b2[2,1]': 0.003}}\n"
    asked += "spectrum: {type: fir, order: 2}\n"
    free, bound = designed(asked), designed(asked, "limits.spectrum=600")
    found = bound.result
    assert found.gap < 1e-6
    assert free.result.objective * 1.01 < found.objective < bound.white_power
    assert np.linalg.eigvalsh(found.basis.density(found.x, GRID)).max() <= 600 * (1 + 1e-6)
