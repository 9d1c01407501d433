"""Which estimator belongs to which kind of model with several channels, or in s: the one place that knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from inputdesign_cli.identification import (
    ChannelBatch,
    ChannelEstimate,
    fit_channel_batch,
    fit_transfer_matrices,
    identify_channels,
    identify_transfer_matrix,
    simulate_transfer_matrix,
)
from inputdesign_cli.plant import (
    ChannelModel,
    ContinuousChannels,
    PolynomialChannels,
    SampledChannels,
    caused_by_inputs,
    caused_by_noise,
)
from inputdesign_cli.plant.channels import Rows
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification.models.shapes import with_paths
from inputdesign_cli.tasks.result.estimates import Blocks


def estimated(
    model: ChannelModel, u: Array, y: Array, step: float, start: Array, *, feedback: bool
) -> ChannelEstimate:
    """The structure of `model` estimated from u (samples, r), y (samples, p) and a start (k,).

    `step` is the time between samples of a plant in continuous time, see `record_step`. With `feedback` u(t)
    answers y(t).

    Raises:
        SpecError: the data do not determine the parameters.
    """
    if isinstance(model, PolynomialChannels):
        return identify_channels(model, u, y, start=start, feedback=feedback)
    plant, interval, hold = _in_s(model, step)
    return identify_transfer_matrix(plant, u, y, interval, hold=hold, start=start, feedback=feedback)


def estimated_runs(model: ChannelModel, u: Array, y: Array, step: float, start: Array) -> ChannelBatch:
    """The same of many records, u (runs, samples, r) and y (runs, samples, p), in one pass."""
    if isinstance(model, PolynomialChannels):
        return fit_channel_batch(model, u, y, start=start)
    plant, interval, hold = _in_s(model, step)
    return fit_transfer_matrices(plant, u, y, interval, hold=hold, start=start)


def simulated(model: ChannelModel, u: Array, e: Array, step: float) -> tuple[Array, Array]:
    """What u (runs, samples, r) and the white noise e (runs, samples, p) cause at the outputs, from rest."""
    if isinstance(model, PolynomialChannels):
        return caused_by_inputs(model, u), caused_by_noise(model, e)
    plant, interval, hold = _in_s(model, step)
    return simulate_transfer_matrix(plant, u, interval, hold=hold), e


def moved(model: ChannelModel, theta: Array, covariance: Array) -> ChannelModel:
    """`model` with other parameters (k,) and another covariance of e (p, p)."""
    if isinstance(model, SampledChannels):
        return replace(model, continuous_plant=model.continuous_plant.at(theta, covariance))
    assert isinstance(model, PolynomialChannels | ContinuousChannels)
    return model.at(theta, covariance)


def _in_s(model: ChannelModel, step: float) -> tuple[ContinuousChannels, float, bool]:
    """The plant in s, the time between samples, and whether its input is held there."""
    if isinstance(model, SampledChannels):
        return model.continuous_plant, model.sample_time, True
    assert isinstance(model, ContinuousChannels)
    return model, step, False


def blocks_of(model: ChannelModel) -> Blocks:
    """`plant` and `noise` of a model in the words of the spec; polynomials that are 1 are left out."""
    covariance = model.covariance
    variance = float(covariance[0, 0]) if covariance.size == 1 else covariance.tolist()
    if not isinstance(model, PolynomialChannels):
        plant, _, held = _in_s(model, 1.0)
        below = _descending(plant.denominator)
        i, j = plant.active[0]
        matrix = {
            "numerator": _descending(plant.numerator),
            "denominator": below[i][j] if plant.common else below,
        }
        return {
            "plant": {"continuous": matrix} | ({"sample": "zoh"} if held else {}),
            "noise": {"variance": variance},
        }
    polynomials = {"A": _rows(model.A), "B": _matrix(model.B), "F": _matrix(model.F)}
    noise = {"C": _rows(model.C), "D": _rows(model.D)}

    def plain(polynomials: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: value
            for name, value in polynomials.items()
            if name == "B" or any(len(p) > 1 for _, p in with_paths(value))
        }

    return {"plant": plain(polynomials), "noise": {**plain(noise), "variance": variance}}


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


def _descending(rows: Rows) -> list:
    return [[p[::-1].tolist() for p in row] for row in rows]
