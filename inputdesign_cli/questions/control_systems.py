"""Turn models into systems of python-control; a new kind of model registers its own."""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli import plant
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec

if TYPE_CHECKING:
    import control


@singledispatch
def system_of(model: plant.Model, sample_time: float) -> control.lti.LTI:
    """Return G of a model as a system; that of a sampled model is in discrete time.

    Raises:
        SpecError: `not-supported` for dead times in s, which python-control does not have.
    """
    raise TypeError(f"{type(model).__name__} is no system of python-control")


@system_of.register(plant.PolynomialModel)
def _(model: plant.PolynomialModel, sample_time: float) -> control.lti.LTI:
    places = [(model.A[0 if len(model.A) == 1 else i], i) for i in range(model.outputs)]
    rows = [[(model.B[i][j], np.convolve(a, model.F[i][j])) for j in range(model.inputs)] for a, i in places]
    return _discrete(rows, sample_time)


@system_of.register(plant.SampledModel)
def _(model: plant.SampledModel, sample_time: float) -> control.lti.LTI:
    plant, nothing = model.continuous_plant, (np.zeros(1), np.ones(1))
    rows = [[nothing for _ in range(model.inputs)] for _ in range(model.outputs)]
    for i, j in plant.active:
        rows[i][j] = plant.held(i, j, model.sample_time).sampled
    return _discrete(rows, sample_time)


@system_of.register(plant.ContinuousModel)
def _(model: plant.ContinuousModel, sample_time: float) -> control.lti.LTI:
    import control

    if model.memory:
        raise bad_spec(
            "not-supported",
            "python-control has no dead times in continuous time",
            hint="write plant.sample: zoh: sampled, they are exact",
            key="plant.continuous",
        )
    above, below = (
        [[entry[::-1].tolist() for entry in row] for row in rows]
        for rows in (model.numerator, model.denominator)
    )
    return control.TransferFunction(above, below)


@system_of.register(plant.StateSpaceModel)
def _(model: plant.StateSpaceModel, sample_time: float) -> control.lti.LTI:
    import control

    return control.StateSpace(*model.realisation, sample_time)


@system_of.register(plant.Coloured)
@system_of.register(plant.Reparametrised)
def _(model: plant.Coloured | plant.Reparametrised, sample_time: float) -> control.lti.LTI:
    return system_of(model.plant if isinstance(model, plant.Coloured) else model.coefficients, sample_time)


def _discrete(rows: list[list[tuple[Array, Array]]], sample_time: float) -> control.lti.LTI:
    """Return the system of entries in q^-1, ascending: in z both polynomials have the same length."""
    import control

    lengths = [[max(top.size, bottom.size) for top, bottom in row] for row in rows]
    above, below = (
        [
            [np.pad(entry[part], (0, n - entry[part].size)).tolist() for entry, n in zip(*pair, strict=True)]
            for pair in zip(rows, lengths, strict=True)
        ]
        for part in (0, 1)
    )
    return control.TransferFunction(above, below, sample_time)
