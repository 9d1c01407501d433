"""The dense interior-point method against Clarabel on random finite programs of every kind."""

import dataclasses

import numpy as np
import pytest

from inputdesign_cli.accuracy.cuts import DeterminantCut, EllipsoidCut, MatrixCut, TraceCut, VarianceCut
from inputdesign_cli.design.convex.finite import FiniteProgram, MatrixPart, by_cones, by_interior
from inputdesign_cli.spectrum import Face, svec, svec_length

K = 5


def psd(rng, rank=2, scale=1.0):
    root = scale * rng.normal(size=(K, rank))
    return root @ root.T


def ellipsoid(rng):
    """An error no larger than a fraction of the distance to a pole."""
    Z, C = 0.3 * rng.normal(size=(2, 2, K))
    form = np.zeros((K + 1, K + 1))
    form[:K, :K] = Z.T @ Z - C.T @ C
    form[:K, K] = form[K, :K] = -C[0]
    form[K, K] = -1.0
    return EllipsoidCut(form, 1.2)


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
        units = np.zeros((n, face.order, face.order))
        for column, unit in enumerate(units):
            vector = np.eye(n)[column]
            unit[:] = matrix_of(vector, face.order)
        gains = np.array([svec(sum(B @ unit @ B.T for B in maps)) for unit in units]).T
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


def matrix_of(vector, order):
    found = np.zeros((order, order))
    columns, rows = np.tril_indices(order)
    found[rows, columns] = found[columns, rows] = vector / np.where(rows == columns, 1.0, np.sqrt(2.0))
    return found


@pytest.mark.first(16)
@pytest.mark.parametrize("goal", ["cost", "factor"])
@pytest.mark.parametrize("kind", ["nonnegative", "psd"])
@pytest.mark.parametrize("name", CUTS)
def test_both_methods_agree(name, kind, goal):
    """The optimum, the multipliers of cuts (as what they prove) and those of limits."""
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


def test_information_in_blocks_is_the_same_program():
    """Two plants side by side: entries of M between them are left out, and change nothing."""
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
