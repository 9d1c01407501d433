"""One input tried many times: simulate the true loop, identify each record, compare with theory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification import (
    BatchEstimate,
    ChannelBatch,
    ChannelEstimate,
    Estimate,
    Structure,
    fit_batch,
    identify,
)
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.evaluation import PredictedError, Trials
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.single import input_and_output

AnyTrials = TypeVar("AnyTrials", bound=Trials)
# Complex numbers of frequency responses held at a time.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class PolynomialTrials(Trials):
    """Runs with one input and one output; `structure` is what was estimated."""

    structure: Structure

    @property
    def names(self) -> tuple[str, ...]:
        return self.structure.names

    def errors(self, promise: PredictedError) -> Array:
        """|G_hat - G_0| (runs, n) at the frequencies of the promise (n,)."""
        w = promise.w
        true = self.true.model.plant_at(w)
        size = max(1, _CHUNK // w.size)
        parts = [
            np.abs(self.structure.responses(self.theta[i : i + size], w) - true)
            for i in range(0, len(self.theta), size)
        ]
        return np.concatenate(parts)

    def bound(self, promise: PredictedError, information: Array) -> Array:
        """r_u (n,) on the true system."""
        return error_bound(self.true, information, promise.alpha, promise.w)


@dataclass(frozen=True)
class TrialJob:
    """What all batches of one study share.

    Attributes:
        true: the true system and the length of its experiment.
        structure: of what is estimated.
        start: (k,) where the search begins, the model that the design was made on.
    """

    true: Experiment
    structure: Structure
    start: Array
    excitation: Excitation


def joined(parts: Sequence[AnyTrials]) -> AnyTrials:
    """All batches of one study as one; mean squares are weighted by the number of runs."""
    weights = [len(part.theta) for part in parts]

    def averaged(entries: Sequence[dict[str, list[float]]]) -> dict[str, list[float]]:
        return {
            name: np.average([entry[name] for entry in entries], axis=0, weights=weights).tolist()
            for name in entries[0]
        }

    return replace(
        parts[0],
        theta=np.concatenate([part.theta for part in parts]),
        converged=np.concatenate([part.converged for part in parts]),
        power=averaged([part.power for part in parts]),
        total_power=averaged([part.total_power for part in parts]),
    )


def run_job(job: TrialJob, runs: int, rng: np.random.Generator) -> PolynomialTrials:
    """Simulate a batch of experiments from rest on the true system and identify each of them.

    Runs where the search does not settle are repeated from several starts. Prior information of the true
    experiment enters as an estimate from earlier data would: with an error of its own in each run.
    """
    true, structure, start, excitation = job.true, job.structure, job.start, job.excitation
    r = excitation.draw(runs, true.samples, rng)
    u_x, y_x = input_and_output(true, r)
    u_e, y_e = _noise(true, runs, rng)
    u, y = u_x + u_e, y_x + y_e
    found = fit_batch(structure, u, y, start=start)
    theta, converged = settled(
        found,
        lambda run: identify(structure, u[run], y[run], start=start),
        prior=true.prior if true.model.names == structure.names else None,
        truth=true.model.theta,
        rng=rng,
    )
    mean_squares = {
        "input": [float(np.mean(u_x**2))],
        "output": [float(np.mean(y_x**2))],
        "excitation": [float(np.mean(r**2))],
    }
    total = {"input": [float(np.mean(u**2))], "output": [float(np.mean(y**2))]}
    return PolynomialTrials(
        true, theta, converged, mean_squares, total, first=np.array(r[0]), structure=structure
    )


def _noise(true: Experiment, runs: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """What e causes at input and output, (runs, samples) each, from rest."""
    model, controller = true.model, true.loop.controller
    e = np.sqrt(model.variance) * rng.standard_normal((runs, true.samples))
    if controller is None:
        v = scipy.signal.lfilter(model.C, np.convolve(model.A, model.D), e, axis=1)
        return np.zeros_like(v), v
    denominator = np.convolve(model.D, true.loop.characteristic)
    forward = np.convolve(model.F, model.C)
    y = scipy.signal.lfilter(np.convolve(forward, controller.denominator_polynomial), denominator, e, axis=1)
    u = scipy.signal.lfilter(-np.convolve(forward, controller.numerator), denominator, e, axis=1)
    return u, y


def settled(
    found: BatchEstimate | ChannelBatch,
    again: Callable[[int], Estimate | ChannelEstimate],
    *,
    prior: Array | None,
    truth: Array,
    rng: np.random.Generator,
) -> tuple[Array, NDArray[np.bool_]]:
    """Estimates (runs, k) and whether they converged (runs,).

    Args:
        again: estimates a run from several starts, for those where the search of the batch did not settle.
        prior: (k, k) enters as an estimate from earlier data would: with an error of its own in each run.
        truth: (k,), about which the earlier estimates scatter.
    """
    theta, information, converged = found.theta, found.information, found.converged.copy()
    for run in np.flatnonzero(~converged):
        try:
            other = again(int(run))
        except SpecError:  # the noise of this run leaves some parameter without an estimate
            continue
        theta[run], information[run], converged[run] = other.theta, other.information, other.converged
    if prior is not None:
        theta = _with_prior(theta, information, prior, truth, rng)
    return theta, converged


def _with_prior(
    theta: Array, information: Array, prior: Array, centre: Array, rng: np.random.Generator
) -> Array:
    """Estimates (runs, k) combined with earlier ones of information `prior`, which may be singular."""
    values, vectors = np.linalg.eigh(prior)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    earlier = prior @ centre + rng.standard_normal(theta.shape) @ root.T
    own = np.einsum("rij,rj->ri", information, theta)
    return np.linalg.solve(information + prior, (own + earlier)[:, :, None])[:, :, 0]
