"""Plants with several channels that the tests share."""

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, PolynomialModel


def arrays(rows):
    return tuple(tuple(np.array(entry, dtype=float) for entry in row) for row in rows)


def descending(rows):
    return arrays([[entry[::-1] for entry in row] for row in rows])


def two_by_two() -> ContinuousModel:
    """The nominal plant of the spectral design paper."""
    return ContinuousModel.monic(
        descending([[[3.125], [3.188]], [[5.313], [1.563]]]),
        descending([[[1, 1.5, 1.563], [1, 2, 1.063]], [[1, 0.5, 1.063], [1, 1, 0.312]]]),
        np.eye(2),
    )


def paper_experiment(power: float = 1000.0) -> Experiment:
    """It on the half band [0, 2], whitened."""
    return Experiment(two_by_two(), 1, (0.0, 2.0)).whitened(power)


def arx(seed: int = 0, *, per_output: bool = True) -> PolynomialModel:
    """A 2 x 2 ARX plant with ten parameters and correlated noise."""
    rng = np.random.default_rng(seed)
    one = np.ones(1)
    B = arrays([[[0.0, *rng.normal(size=2)] for _ in range(2)] for _ in range(2)])
    A = (np.array([1.0, -0.7]), np.array([1.0, 0.4])) if per_output else (np.array([1.0, -0.9, 0.5]),)
    ones = ((one, one), (one, one))
    return PolynomialModel(B, A, ones, (one,), (one,), np.array([[1.0, 0.4], [0.4, 0.5]]))


def box_jenkins(seed: int = 1) -> PolynomialModel:
    """Two outputs, three inputs, every polynomial present, one entry of B zero."""
    rng = np.random.default_rng(seed)
    B = [[[0.0, *rng.normal(size=2)] for _ in range(3)] for _ in range(2)]
    B[0][2] = [0.0]
    F = [[[1.0, rng.uniform(-0.8, 0.8)] for _ in range(3)] for _ in range(2)]
    noise = rng.normal(size=(2, 2))
    return PolynomialModel(
        arrays(B),
        (np.array([1.0, 0.2]),),
        arrays(F),
        (np.array([1.0, 0.5]), np.array([1.0, -0.3])),
        (np.array([1.0, -0.6]),),
        noise @ noise.T + np.eye(2),
    )
