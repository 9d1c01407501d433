"""Which estimator belongs to which kind of model with several channels, or in s: the one place that knows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from inputdesign_cli.assemble.estimates import Blocks
from inputdesign_cli.identification import (
    ChannelBatch,
    ChannelEstimate,
    fit_channel_batch,
    identify_channels,
)
from inputdesign_cli.plant import ChannelModel, PolynomialChannels
from inputdesign_cli.plant.channels import Rows
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.plant import with_paths


def check_estimable(spec: Spec, model: ChannelModel) -> None:
    """Whether there is an estimator for the kind of `model`.

    Raises:
        SpecError: `not-supported` for plants in s.
    """
    if not isinstance(model, PolynomialChannels):
        raise spec.complain(
            "not-supported",
            "this version does not identify plants in s",
            hint="write the plant as polynomials A, B, F in q^-1",
            key="plant",
        )


def estimated(model: ChannelModel, u: Array, y: Array, start: Array) -> ChannelEstimate:
    """The structure of `model` estimated from u (samples, r), y (samples, p) and a start (k,)."""
    assert isinstance(model, PolynomialChannels)
    return identify_channels(model, u, y, start=start)


def estimated_runs(model: ChannelModel, u: Array, y: Array, start: Array) -> ChannelBatch:
    """The same of many records, u (runs, samples, r) and y (runs, samples, p), in one pass."""
    assert isinstance(model, PolynomialChannels)
    return fit_channel_batch(model, u, y, start=start)


def moved(model: ChannelModel, theta: Array, covariance: Array) -> ChannelModel:
    """`model` with other parameters (k,) and another covariance of e (p, p)."""
    assert isinstance(model, PolynomialChannels)
    return model.at(theta, covariance)


def blocks_of(model: ChannelModel) -> Blocks:
    """`plant` and `noise` of a model in the words of the spec; polynomials that are 1 are left out."""
    assert isinstance(model, PolynomialChannels)
    plant = {"A": _rows(model.A), "B": _matrix(model.B), "F": _matrix(model.F)}
    noise = {"C": _rows(model.C), "D": _rows(model.D)}

    def plain(polynomials: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: value
            for name, value in polynomials.items()
            if name == "B" or any(len(p) > 1 for _, p in with_paths(value))
        }

    covariance = model.covariance
    variance = float(covariance[0, 0]) if covariance.size == 1 else covariance.tolist()
    return {"plant": plain(plant), "noise": {**plain(noise), "variance": variance}}


def predictor_of(model: ChannelModel) -> dict[str, list[Array]]:
    """The polynomials of a model that must be stable: C, D and F; none of a plant in s."""
    if not isinstance(model, PolynomialChannels):
        return {}
    return {"C": list(model.C), "D": list(model.D), "F": [p for row in model.F for p in row]}


def _rows(polynomials: tuple[Array, ...]) -> list:
    """One polynomial common to all outputs as it is; a list of those of each output."""
    return polynomials[0].tolist() if len(polynomials) == 1 else [p.tolist() for p in polynomials]


def _matrix(rows: Rows) -> list:
    return [[p.tolist() for p in row] for row in rows]
