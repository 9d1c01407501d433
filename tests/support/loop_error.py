"""The distillation column and random data that the tests of this folder share."""

import numpy as np

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.laws import ModelReference
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.plant import TransferMatrix, zero_order_hold

POLE = np.exp(-2 / 75)
GAINS = np.array([[0.878, -0.864], [1.082, -1.096]])
TOTAL = (PowerLimit("input", 2.0),)


def column(*, limits=TOTAL, white_noise=False, variance=1e-10):
    """The column of docs/errata.md: exact G_d of the gains; H = 1e-5/(z-a), or without its pole."""
    B = (1 - POLE) * GAINS
    plant = matrix_plant(
        A=[[1.0, -POLE]],
        B=[[[0.0, b] for b in row] for row in B],
        C=[[1.0, -POLE]] * 2 if white_noise else [[1.0]],
        covariance=variance * np.eye(2),
    )
    law = ModelReference(TransferMatrix.diagonal(zero_order_hold([1.0], [75.0, 1.0], 2.0), 2))
    return LoopErrorProblem(plant, law, limits, np.ones(2))


def matrix_plant(*, B, covariance, A=((1.0,),), F=None, C=((1.0,),), D=((1.0,),)):
    """A plant from plain numbers; A, C and D hold one polynomial for all outputs or one for each."""
    A, C, D = (tuple(np.asarray(p, dtype=float) for p in rows) for rows in (A, C, D))
    F = F or [[[1.0] for _ in row] for row in B]
    B, F = (tuple(tuple(np.asarray(p, dtype=float) for p in row) for row in rows) for rows in (B, F))
    return MatrixPlant(B=B, A=A, F=F, C=C, D=D, covariance=np.asarray(covariance, dtype=float))


def full_plant():
    """Every polynomial has parameters; two outputs, two inputs."""
    return matrix_plant(
        A=[[1, -0.5], [1, 0.3, 0.1]],
        B=[[[0, 1.0, 0.2], [0, 0.1]], [[0, 0, 0.3], [0, 1.5]]],
        F=[[[1, -0.2], [1]], [[1, 0.1, 0.2], [1, 0.4]]],
        C=[[1, 0.3], [1]],
        D=[[1], [1, -0.6]],
        covariance=[[1.0, 0.2], [0.2, 0.5]],
    )


def random_complex(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def random_hermitian(rng, K, n):
    X = random_complex(rng, K, n, n)
    return X @ np.conj(np.swapaxes(X, 1, 2)) + 0.1 * np.eye(n)


def adjoint(X):
    return np.conj(np.swapaxes(X, -1, -2))


def random_plant(rng, n, *, delay=1, radius=0.9):
    """ARX-like matrices with stable A per output and minimum-phase B of a strong diagonal."""
    A = [np.poly(rng.uniform(-radius, radius, 2)).tolist() for _ in range(n)]
    B = []
    for i in range(n):
        row = []
        for j in range(n):
            lead = 2.0 + rng.random() if i == j else 0.3 * rng.standard_normal()
            row.append([0.0] * delay + [lead, 0.3 * rng.standard_normal()])
        B.append(row)
    C = [np.poly(rng.uniform(-0.7, 0.7, 1)).tolist() for _ in range(n)]
    X = rng.standard_normal((n, n))
    return matrix_plant(A=A, B=B, C=C, covariance=X @ X.T + np.eye(n))
