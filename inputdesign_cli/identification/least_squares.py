"""ARX models of many records at once by linear least squares, [ljung-1999] Section 4.2.

The estimate is that of `fit_batch` with the covariance of e known, in a tenth of the time or less.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import PolynomialModel


def is_arx(model: PolynomialModel) -> bool:
    """Return whether least squares is the prediction-error estimate: C, D and F are 1."""
    each = [*model.C, *model.D, *(f for row in model.F for f in row)]
    return not any(np.any(p[1:]) for p in each)


def least_squares(model: PolynomialModel, u: Array, y: Array) -> Array:
    """Return theta (runs, k), outputs weighted with the inverse covariance of e.

    Args:
        model: an ARX model of which the structure and the covariance are meant.
        u, y: (runs, samples, r), (runs, samples, p).
    """
    k, samples = model.theta.size, y.shape[1]
    longest = max(parameter.power for parameter in model.parameters)
    # Output by output the regressors (runs, samples - longest), and whose they are.
    regressors: list[list[tuple[Array, int]]] = [[] for _ in range(model.outputs)]
    for index, parameter in enumerate(model.parameters):
        span = slice(longest - parameter.power, samples - parameter.power)
        if parameter.letter == "b":
            ((i, j),) = parameter.places
            regressors[i].append((u[:, span, j], index))
        else:
            for i in {output for output, _ in parameter.places}:
                regressors[i].append((-y[:, span, i], index))
    inverse = np.linalg.inv(model.covariance)
    normal, right = np.zeros((len(y), k, k)), np.zeros((len(y), k))
    for i, left in enumerate(regressors):
        for j in map(int, np.flatnonzero(inverse[i])):
            for signal, index in left:
                right[:, index] += inverse[i, j] * _dot(signal, y[:, longest:, j])
                for other, column in regressors[j]:
                    if i != j or column >= index:
                        product = inverse[i, j] * _dot(signal, other)
                        normal[:, index, column] += product
                        if i == j and column > index:
                            normal[:, column, index] += product
    return np.asarray(np.linalg.solve(normal, right[:, :, None])[:, :, 0], dtype=float)


def estimated_polynomials(model: PolynomialModel, theta: Array) -> tuple[Array, Array]:
    """Return A (runs, p, l) and B (runs, p, r, m) of estimates (runs, k), ascending in q^-1."""
    A = np.zeros((len(theta), model.outputs, max(a.size for a in model.A)))
    A[:, :, 0] = 1.0
    B = np.zeros((len(theta), model.outputs, model.inputs, max(b.size for row in model.B for b in row)))
    for index, parameter in enumerate(model.parameters):
        for i, j in parameter.places:
            if parameter.letter == "b":
                B[:, i, j, parameter.power] = theta[:, index]
            else:
                A[:, i, parameter.power] = theta[:, index]
    return A, B


def _dot(left: Array, right: Array) -> Array:
    return np.asarray(np.einsum("rt,rt->r", left, right))
