"""Cones of cuts against the sets they describe, and proved inequalities against members of the sets."""

import numpy as np
import pytest
import scipy.sparse as sp

from inputdesign_cli.accuracy.cuts import DeterminantCut, EllipsoidCut, MatrixCut, TraceCut, VarianceCut
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.spectrum import svec
from tests.support.convex_designs import pole_form

K = 3


def random_matrix(rng, rank=K + 2):
    root = rng.normal(size=(K, rank))
    return root @ root.T


def fixed():
    """R, V, W and the form of the ellipsoid, for the cuts below."""
    rng = np.random.default_rng(0)
    R, V, W = random_matrix(rng, 2), rng.normal(size=(K, 2)), random_matrix(rng)
    return R, V, W, pole_form(*rng.normal(size=(2, 2, K)))


R, V, W, FORM = fixed()


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def ellipsoid_scale(M, alpha):
    """The least s for which no point of x^T s M x <= alpha^2 violates the form, by sampling directions."""
    half = np.linalg.inv(np.linalg.cholesky(M))
    directions = np.random.default_rng(1).normal(size=(400000, K))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    d = directions @ half
    # Along each direction, the form is a quadratic in the length: its least positive root.
    a, b = np.einsum("ni,ij,nj->n", d, FORM[:K, :K], d), 2 * d @ FORM[:K, K]
    root = np.sqrt(np.maximum(b**2 + 4 * a, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = np.stack([(-b + root) / (2 * a), (-b - root) / (2 * a)])
    lengths = np.where((lengths > 0) & (b**2 + 4 * a >= 0), lengths, np.inf)
    return (alpha / lengths.min()) ** 2


# Each cut with the least multiple of M that belongs to it, from its definition.
CUTS = {
    "matrix": (MatrixCut(R), lambda M: np.linalg.eigvals(np.linalg.solve(M, R)).real.max()),
    "variance": (VarianceCut(V), lambda M: np.trace(V.T @ np.linalg.solve(M, V))),
    "determinant": (DeterminantCut(0.7), lambda M: 0.7 / np.linalg.det(M) ** (1 / K)),
    "trace": (TraceCut(W), lambda M: 1 / np.trace(W @ M)),
    "ellipsoid": (EllipsoidCut(FORM, 1.3), lambda M: ellipsoid_scale(M, 1.3)),
}


def least_scale(cut, M):
    """Minimise s subject to the cones of the cut at s M."""
    blocks = cut.blocks(K)
    aux = blocks[0].auxiliary.shape[1]
    cones = []
    for block in blocks:
        column = block.information @ svec(M)[:, None]
        matrix = sp.hstack([sp.csc_matrix(column), block.auxiliary], format="csc")
        cones.append(Block(block.kind, matrix, block.constant, block.order))
    solution = solve_conic(np.eye(1 + aux)[0], cones, tolerance=1e-9)
    assert solution.status in ("solved", "almost_solved")  # judged by the values below
    return solution.x[0], solution.multipliers


@pytest.mark.parametrize("name", CUTS)
def test_cones_describe_the_set_of_the_definition(name, rng):
    cut, definition = CUTS[name]
    for _ in range(3):
        M = random_matrix(rng)
        scale, _ = least_scale(cut, M)
        assert scale == pytest.approx(definition(M), rel=2e-3 if name == "ellipsoid" else 1e-6)


def proved(cut, rng):
    """The inequality (Y, r) that random multipliers of the cones prove."""
    multipliers = []
    for block in cut.blocks(K):
        if block.kind == "psd":
            root = rng.normal(size=(block.order, block.order))
            multipliers.append(svec(root @ root.T + 0.3 * rng.normal() * np.eye(block.order)))
        else:
            multipliers.append(rng.normal(size=block.constant.size))
    return cut.proof(multipliers)


def implied(cut, rng):
    """The inequality (Y, r) that a random symmetric matrix implies."""
    order = K if cut.inequality is None else len(cut.inequality.constant)
    root = rng.normal(size=(order, order))
    return cut.implied(root @ root.T + 0.3 * rng.normal() * np.eye(order))


@pytest.mark.parametrize("way", [proved, implied])
@pytest.mark.parametrize("name", CUTS)
def test_proved_inequalities_hold_for_any_multipliers(name, way, rng):
    """tr(Y M) >= r for every M of the set: random multipliers, random members on the boundary."""
    cut, _ = CUTS[name]
    boundary = [least_scale(cut, M)[0] * M for M in (random_matrix(rng) for _ in range(6))]
    for _ in range(20):
        Y, r = way(cut, rng)
        assert way is implied or np.linalg.eigvalsh(Y)[0] >= -1e-9 * max(np.trace(Y), 1)
        for M in boundary:
            assert np.sum(Y * M) >= r - 1e-6 * abs(r)


@pytest.mark.parametrize("name", CUTS)
def test_proofs_are_tight_at_the_optimum(name, rng):
    """With the solver's own multipliers the inequality is an equality: strong duality."""
    cut, _ = CUTS[name]
    M = random_matrix(rng)
    scale, multipliers = least_scale(cut, M)
    Y, r = cut.proof(list(multipliers))
    assert np.sum(Y * M) * scale == pytest.approx(r, rel=1e-5)


@pytest.mark.parametrize("name", CUTS)
def test_transformed_cuts_describe_the_same_set(name, rng):
    cut, _ = CUTS[name]
    M, congruence = random_matrix(rng), rng.normal(size=(K, K))
    moved, _ = least_scale(cut.transformed(congruence), congruence @ M @ congruence.T)
    assert moved == pytest.approx(least_scale(cut, M)[0], rel=1e-6)


CONCAVE = [name for name, (cut, _) in CUTS.items() if cut.concave is not None]


@pytest.mark.parametrize("name", CONCAVE)
def test_concave_functions_equal_one_on_the_boundary_of_the_set(name, rng):
    """g is homogeneous of degree one, and equals one where M reaches the set."""
    cut, definition = CUTS[name]
    M = random_matrix(rng)
    value, gradient = cut.concave.at(M, np.linalg.inv(M))
    assert 1.0 / value == pytest.approx(definition(M), rel=1e-9)
    assert np.sum(gradient * M) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("name", CONCAVE)
def test_derivatives_of_concave_functions_agree_with_finite_differences(name, rng):
    """Gradient and curvature against finite differences."""
    function = CUTS[name][0].concave
    M = random_matrix(rng) + np.eye(K)
    D = rng.normal(size=(K, K))
    D = D + D.T

    def value(t):
        return function.at(M + t * D, np.linalg.inv(M + t * D))[0]

    h = 1e-3
    g, G = function.at(M, np.linalg.inv(M))
    assert (value(h) - value(-h)) / (2 * h) == pytest.approx(np.sum(G * D), rel=1e-4)
    second = function.curvature * (np.sum(G * D) ** 2 / g - np.trace(np.linalg.solve(M, D) @ G @ D))
    assert (value(h) - 2 * g + value(-h)) / h**2 == pytest.approx(second, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("name", [name for name in CUTS if name not in CONCAVE])
def test_matrix_inequalities_are_tight_on_the_boundary_of_the_set(name, rng):
    """On the boundary of the set the largest least eigenvalue over nu is zero."""
    cut, _ = CUTS[name]
    part = cut.inequality
    M = random_matrix(rng)
    M = least_scale(cut, M)[0] * M
    whole = part.constant.copy()
    whole[:K, :K] += part.scale * M
    shares = np.linspace(0.0, 5.0, 5001) if part.form is not None else [0.0]
    form = np.zeros_like(whole) if part.form is None else part.form
    best = max(np.linalg.eigvalsh(whole + nu * form)[0] for nu in shares)
    assert best == pytest.approx(0.0, abs=1e-3 * np.abs(whole).max())
