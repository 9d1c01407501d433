"""Models of single outputs as one model of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.explore.candidates import Candidate
from inputdesign_cli.explore.processes import process_models
from inputdesign_cli.plant import Model, PolynomialModel


def joined(taken: Sequence[Candidate], inputs: int, moving: Sequence[int]) -> Model:
    """The models of single outputs, of structures of one kind, as one model.

    Args:
        inputs: of the whole; those that are `moving` are those of the single models. Plants in s have all.
    """
    processes = [(c.orders, c.theta) for c in taken if c.orders.physical is True]
    if processes:
        shapes, thetas = zip(*processes, strict=True)
        return process_models(shapes, thetas, np.eye(len(shapes)))
    single = rows([c.orders.model().at(c.theta) for c in taken if c.orders.physical is False])
    return embedded(single, inputs, moving)


def rows(models: Sequence[PolynomialModel]) -> PolynomialModel:
    """Models of one output each, of the same inputs, as one model."""
    return PolynomialModel(
        tuple(model.B[0] for model in models),
        tuple(model.A[0] for model in models),
        tuple(model.F[0] for model in models),
        tuple(model.C[0] for model in models),
        tuple(model.D[0] for model in models),
        np.diag([float(model.covariance[0, 0]) for model in models]),
    )


def embedded(model: PolynomialModel, inputs: int, moving: Sequence[int]) -> PolynomialModel:
    """The same model among `inputs` inputs, of which those that are not `moving` have no effect."""
    if len(moving) == inputs:
        return model
    B = [[np.zeros(1)] * inputs for _ in range(model.outputs)]
    F = [[np.ones(1)] * inputs for _ in range(model.outputs)]
    delays = [[1] * inputs for _ in range(model.outputs)]  # of what is absent, the length of B
    for i in range(model.outputs):
        for k, j in enumerate(moving):
            B[i][j], F[i][j], delays[i][j] = model.B[i][k], model.F[i][k], model.first[i][k]
    return replace(model, B=tuple(map(tuple, B)), F=tuple(map(tuple, F)), delays=tuple(map(tuple, delays)))
