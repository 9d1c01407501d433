"""The distillation column and random data that the tests of this folder share."""

import numpy as np
from inputdesign_cli.design.loop_error.transfer import sampled

from inputdesign_cli.design.loop_error import (
    ClosedLoopProblem,
    MatrixPlant,
    MatrixTransfer,
    ModelReference,
    PowerLimit,
)

POLE = np.exp(-2 / 75)
GAINS = np.array([[0.878, -0.864], [1.082, -1.096]])
TOTAL = (PowerLimit("input", 2.0),)


def column(*, limits=TOTAL, white_noise=False, variance=1e-10):
    """Errata: exact G_d of the gains; H = 1e-5/(z-a), or without its pole."""
    B = (1 - POLE) * GAINS
    plant = MatrixPlant.build(
        A=[[1.0, -POLE]],
        B=[[[0.0, b] for b in row] for row in B],
        C=[[1.0, -POLE]] * 2 if white_noise else [[1.0]],
        covariance=variance * np.eye(2),
    )
    above, below = sampled([1.0], [75.0, 1.0], 2.0)
    law = ModelReference(MatrixTransfer.diagonal(above, below, 2))
    return ClosedLoopProblem(plant, law, limits, np.ones(2))


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
    return MatrixPlant.build(A=A, B=B, C=C, covariance=X @ X.T + np.eye(n))
