"""A model in the words of a spec: its `plant` and `noise`; a new kind of model registers its own."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import singledispatch
from typing import Any

from inputdesign_cli import plant
from inputdesign_cli.arrays import Array, Rows

Plain = Any
"""A value as YAML has it: a number, a text, a list or a mapping."""
Blocks = dict[str, dict[str, Plain]]


@singledispatch
def blocks_of(model: plant.Model) -> Blocks:
    """Return the blocks `plant` and `noise` of a model; polynomials that are 1 are left out.

    Raises:
        TypeError: models of this kind have no words.
    """
    raise TypeError(f"{type(model).__name__} has no words in a spec")


@blocks_of.register
def _(model: plant.PolynomialModel) -> Blocks:
    single = model.outputs == model.inputs == 1
    everything: dict[str, tuple[Plain, bool]] = {
        "A": (_rows(model.A), _matter(model.A)),
        "B": (model.B[0][0].tolist() if single else _matrix(model.B), True),
        "F": (model.F[0][0].tolist() if single else _matrix(model.F), any(map(_matter, model.F))),
    }
    noise = {"C": (_rows(model.C), _matter(model.C)), "D": (_rows(model.D), _matter(model.D))}
    return {
        "plant": {name: value for name, (value, stated) in everything.items() if stated},
        "noise": {name: value for name, (value, stated) in noise.items() if stated} | _variance(model),
    }


@blocks_of.register
def _(model: plant.ContinuousModel) -> Blocks:
    below = _matrix(model.denominator, descending=True)
    i, j = model.active[0]
    matrix: dict[str, Plain] = {
        "numerator": _matrix(model.numerator, descending=True),
        "denominator": below[i][j] if model.common else below,
    }
    if model.delay:
        late = [[model.dead_time(o, n) for n in range(model.inputs)] for o in range(model.outputs)]
        matrix["delay"] = model.memory if model.common_delay else late
    return {"plant": {"continuous": matrix}, "noise": _variance(model)}


@blocks_of.register
def _(model: plant.SampledModel) -> Blocks:
    blocks = blocks_of(model.continuous_plant)
    return {**blocks, "plant": {**blocks["plant"], "sample": "zoh"}}


@blocks_of.register
def _(model: plant.StateSpaceModel) -> Blocks:
    return {"plant": {}, "noise": _variance(model)}  # `Reparametrised` has the words of the plant


@blocks_of.register
def _(model: plant.Coloured) -> Blocks:
    blocks = blocks_of(model.plant)
    own: dict[str, Plain] = {
        name: _rows(rows) for name, rows in (("C", model.C), ("D", model.D)) if _matter(rows)
    }
    inside = blocks["noise"].get("D")
    if inside is not None and "D" in own:  # for each output, one of the two is 1
        own["D"] = [one if len(one) > 1 else other for one, other in zip(own["D"], inside, strict=True)]
    if any(model.drift):
        own["drift"] = model.drift[0] if len(model.drift) == 1 else list(model.drift)
    return {**blocks, "noise": blocks["noise"] | own}


@blocks_of.register
def _(model: plant.Reparametrised) -> Blocks:
    words, blocks = model.words, blocks_of(model.coefficients)
    if words.plant is not None:
        written = copy.deepcopy(dict(words.plant))
        at = model.parametrisation
        values = dict(zip(at.labels, at.values.tolist(), strict=True))
        for label, place in words.places.items():
            *steps, last = place
            block: Plain = written
            for step in steps:
                block = block[step]
            block[last] = values[label]
        blocks["plant"] = written
    for section, known in words.known.items():
        if known:
            blocks[section]["known"] = list(known)
    return blocks


@singledispatch
def predictor_of(model: plant.Model) -> dict[str, list[Array]]:
    """Return the polynomials of the noise that must be stable, by letter: C and D; none of a plant in s."""
    return {}


@predictor_of.register
def _(model: plant.PolynomialModel) -> dict[str, list[Array]]:
    return {"C": list(model.C), "D": list(model.D)}


@predictor_of.register
def _(model: plant.Coloured) -> dict[str, list[Array]]:
    free = [d for d, held in zip(model.D, model.held, strict=True) if not held]
    return {**predictor_of(model.plant), "C": list(model.C), "D": free}


@predictor_of.register
def _(model: plant.Reparametrised) -> dict[str, list[Array]]:
    return predictor_of(model.coefficients)


def _variance(model: plant.Model) -> dict[str, Plain]:
    covariance = model.covariance
    return {"variance": float(covariance[0, 0]) if covariance.size == 1 else covariance.tolist()}


def _matter(polynomials: Sequence[Array]) -> bool:
    return any(p.size > 1 for p in polynomials)


def _rows(polynomials: Sequence[Array]) -> list[Plain]:
    """Return one polynomial common to all outputs as it is, or else a list with one for each output."""
    return polynomials[0].tolist() if len(polynomials) == 1 else [p.tolist() for p in polynomials]


def _matrix(rows: Rows, *, descending: bool = False) -> list[list[list[float]]]:
    return [[(p[::-1] if descending else p).tolist() for p in row] for row in rows]
