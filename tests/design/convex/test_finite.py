"""Finite programs: the interior-point method against Clarabel, and programs of lines against cvxpy."""

import dataclasses

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli.accuracy.cuts import DeterminantCut, EllipsoidCut, MatrixCut, TraceCut, VarianceCut
from inputdesign_cli.design.convex.finite import FiniteProgram, MatrixPart, by_cones, by_interior
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.response_lines import (
    ResponseLines,
    ResponseProblem,
    UnreachableError,
    cheapest,
    most_accurate,
)
from inputdesign_cli.spectrum import Face, smat, svec, svec_length
from tests.support.convex_designs import pole_form

K = 5


def psd(rng, rank=2, scale=1.0):
    root = scale * rng.normal(size=(K, rank))
    return root @ root.T


def ellipsoid(rng):
    """An error no larger than a fraction of the distance to a pole."""
    return EllipsoidCut(pole_form(*(0.3 * rng.normal(size=(2, 2, K)))), 1.2)


CUTS = {
    "matrix": lambda rng: [MatrixCut(psd(rng, scale=0.5)) for _ in range(9)],
    "few": lambda rng: [MatrixCut(psd(rng, K))],
    "variance": lambda rng: [VarianceCut(0.4 * rng.normal(size=(K, 2))) for _ in range(4)],
    "inverse trace": lambda rng: [VarianceCut(np.eye(K))],
    "determinant": lambda rng: [DeterminantCut(0.8)],
    "trace": lambda rng: [TraceCut(psd(rng, K)), MatrixCut(psd(rng))],
    "ellipsoid": lambda rng: [ellipsoid(rng) for _ in range(4)],
    "mixed": lambda rng: [MatrixCut(psd(rng)), VarianceCut(np.eye(K)), ellipsoid(rng), DeterminantCut(0.3)],
}


def face_of(kind, rng):
    if kind == "nonnegative":
        number = 40
        return Face(np.eye(number), kind, number, np.zeros(number)), np.ones(number)
    order = 8
    return Face(np.eye(svec_length(order)), kind, order, np.eye(order)), svec(np.eye(order))


def random_program(rng, kind, cuts, goal):
    """Least cost, or ("factor") the least multiple s of a limit, with s times the constants of side cuts."""
    face, price = face_of(kind, rng)
    n = price.size
    # M(Q) = sum B_i Q B_i^T is positive, for matrices as for atoms.
    if kind == "nonnegative":
        gains = np.array([svec(psd(rng, 1)) for _ in range(n)]).T
    else:
        maps = rng.normal(size=(3, K, face.order)) / 2
        gains = np.array([svec(sum(B @ smat(unit) @ B.T for B in maps)) for unit in np.eye(n)]).T
    offset = svec(0.01 * np.eye(K))
    if goal == "cost":
        caps = -np.eye(n)[:1]
        return FiniteProgram(
            cost=price,
            face=face,
            matrices=[MatrixPart(gains, offset, cuts, [False] * len(cuts))],
            signs=np.zeros((0, n)),
            limits=caps,
            limit_offset=np.array([1.0]),
            unit=None,
            size=K,
        )
    side = [MatrixCut(0.02 * psd(rng)), VarianceCut(0.1 * rng.normal(size=(K, 2)))]
    part = MatrixPart(
        gains=np.hstack([gains, 0.02 * svec(np.eye(K))[:, None]]),
        offset=np.zeros_like(offset),
        cuts=[*cuts, *side],
        sides=[False] * len(cuts) + [True] * 2,
    )
    return FiniteProgram(
        cost=np.eye(n + 1)[-1],
        matrices=[part],
        signs=np.eye(n + 1)[-1:],
        limits=np.append(-price, 1.5)[None],
        limit_offset=np.zeros(1),
        face=face,
        unit=1.3,
        size=K,
    )


@pytest.mark.first(16)
@pytest.mark.parametrize("goal", ["cost", "factor"])
@pytest.mark.parametrize("kind", ["nonnegative", "psd"])
@pytest.mark.parametrize("name", CUTS)
def test_the_interior_point_method_agrees_with_clarabel(name, kind, goal):
    """The optimum, the inequalities that the cuts prove, and the multipliers of limits are compared."""
    rng = np.random.default_rng(3)
    program = random_program(rng, kind, CUTS[name](rng), goal)
    reference = by_cones(program, tolerance=1e-9)
    found, error = by_interior(program, tolerance=1e-9)
    assert error <= 1e-6
    optimum = program.cost @ reference.v
    assert program.cost @ found.v == pytest.approx(optimum, rel=1e-6, abs=1e-7)
    weight, required = (sum(part) for part in zip(*found.proofs[0], strict=True))
    other, also = (sum(part) for part in zip(*reference.proofs[0], strict=True))
    assert required == pytest.approx(also, rel=1e-3, abs=1e-5)
    np.testing.assert_allclose(weight, other, atol=2e-3 * np.abs(other).max() + 1e-5)
    np.testing.assert_allclose(found.limit_weights, reference.limit_weights, atol=1e-4)


@pytest.mark.parametrize("name", ["matrix", "determinant", "ellipsoid", "mixed"])
def test_multipliers_prove_the_optimum(name):
    """Weak duality by hand: tr(Y M) >= r for all cuts and a nonnegative reduced price bound the cost."""
    rng = np.random.default_rng(4)
    program = random_program(rng, "nonnegative", CUTS[name](rng), "cost")
    found, _ = by_interior(program, tolerance=1e-9)
    weight, required = (sum(part) for part in zip(*found.proofs[0], strict=True))
    part = program.matrices[0]
    reduced = program.cost - part.gains.T @ svec(weight) - program.limits.T @ found.limit_weights
    assert reduced.min() >= -1e-6
    proved = required - svec(weight) @ part.offset - found.limit_weights @ program.limit_offset
    assert proved == pytest.approx(program.cost @ found.v, rel=1e-6)


def test_both_methods_agree_on_block_diagonal_information():
    """Two plants side by side: the entries of M between them are zero."""
    rng = np.random.default_rng(5)
    program = random_program(rng, "nonnegative", [MatrixCut(np.diag([1.0, 2.0, 1.0, 0.5, 1.0]))], "cost")
    apart = np.ones((K, K))
    apart[:2, 2:] = apart[2:, :2] = 0.0
    kept = svec(apart) != 0
    whole = program.matrices[0]
    apart = dataclasses.replace(whole, gains=whole.gains * kept[:, None])
    split = dataclasses.replace(program, matrices=[apart])
    found, error = by_interior(split, tolerance=1e-9)
    assert error <= 1e-6
    reference = by_cones(split, tolerance=1e-9)
    assert split.cost @ found.v == pytest.approx(split.cost @ reference.v, rel=1e-7)


def random_problem(seed, *, floors):
    rng = np.random.default_rng(seed)
    n, caps = int(rng.integers(2, 12)), int(rng.integers(1, 4))
    needed, price = rng.uniform(0.1, 3.0, n), rng.uniform(0.0, 2.0, n)
    rows = rng.uniform(0.0, 2.0, (caps + floors, n))
    rows[:, rng.integers(n)] += 0.1
    used = rows @ needed
    # Proportional powers within the upper limits just miss or just meet the lower limits.
    bounds = [*(used[:caps] * rng.uniform(1.5, 4.0, caps)), *(used[caps:] * rng.uniform(0.5, 1.6, floors))]
    limits = [PowerLimit("output", float(b), i < caps, i) for i, b in enumerate(bounds)]
    return ResponseProblem(needed, price, tuple(limits), rows)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("floors", [0, 2])
@pytest.mark.parametrize("design", [cheapest, most_accurate])
def test_the_best_lines_agree_with_a_plain_program(seed, floors, design):
    cheap = design is cheapest
    problem = random_problem(seed if cheap else 100 + seed, floors=floors)
    found = design(problem)
    p, s = cp.Variable(problem.needed.size), 1.0 if cheap else cp.Variable()
    held = [p >= s * problem.needed]
    for limit, row in zip(problem.limits, problem.rows, strict=True):
        held.append(row @ p <= limit.bound if limit.upper else row @ p >= limit.bound)
    plain = cp.Problem(cp.Minimize(problem.price @ p) if cheap else cp.Maximize(s), held)
    plain.solve(solver=cp.CLARABEL)
    assert found.value == pytest.approx(plain.value, rel=1e-6)
    by_hand = problem.price @ found.powers if cheap else np.min(found.powers / problem.needed)
    assert found.value == pytest.approx(by_hand, rel=1e-12 if cheap else 1e-9)
    assert (found.bound <= found.value * (1 + 1e-12)) if cheap else (found.bound >= found.value * (1 - 1e-12))
    assert found.gap < 1e-8


def test_without_limits_every_line_just_meets_its_bound():
    lines = ResponseLines(
        np.ones((3, 1, 1)) + 0j, np.array([[0.5], [1.0], [2.0]]), np.array([0.1, 0.2, 0.1]).reshape(3, 1, 1)
    )
    needed = lines.needed(100)
    assert needed[:, 0] == pytest.approx([1.0, 0.5, 4.0])  # 2 Phi_v / (N r_adm^2)
    assert lines.ratios(lines.deviations(needed, 100)) == pytest.approx(1.0)
    problem = ResponseProblem(needed.ravel(), np.ones(3), (), np.zeros((0, 3)))
    assert cheapest(problem).powers == pytest.approx(needed.ravel())
    # The worst of several outputs sets the power of the lines of an input.
    admitted = np.array([[[0.1, 1.0], [0.2, 0.1]]])
    lines = ResponseLines(np.ones((1, 2, 2)) + 0j, np.array([[1.0, 4.0]]), admitted)
    needed = lines.needed(200)
    assert needed[0] == pytest.approx([2.0 / 200 / 0.01, 8.0 / 200 / 0.01])
    assert lines.ratios(lines.deviations(needed, 200)) == pytest.approx(1.0)


def test_tight_limits_report_a_factor_and_contradictory_limits_an_infinite_one():
    limit = PowerLimit("input", 1.0)
    problem = ResponseProblem(np.array([1.0, 3.0]), np.ones(2), (limit,), np.ones((1, 2)))
    with pytest.raises(UnreachableError) as caught:
        cheapest(problem)
    assert caught.value.factor == pytest.approx(2.0)  # a quarter of the power: twice the deviation
    assert caught.value.limits == (limit,)
    rows = np.array([[1.0, 1.0], [1.0, 1.0]])
    limits = (PowerLimit("input", 5.0), PowerLimit("output", 6.0, upper=False))
    problem = ResponseProblem(np.ones(2), np.ones(2), limits, rows)
    for solve in (cheapest, most_accurate):
        with pytest.raises(UnreachableError) as caught:
            solve(problem)
        assert np.isinf(caught.value.factor)
