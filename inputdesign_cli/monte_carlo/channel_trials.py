"""One input of several channels tried many times: simulate the true system, identify each record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Absolute, EntryError, NormError
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.monte_carlo.channel_excitations import ChannelExcitation
from inputdesign_cli.monte_carlo.evaluation import PredictedError, Trials
from inputdesign_cli.monte_carlo.trials import settled
from inputdesign_cli.plant import ChannelModel
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.tasks.channel_estimation import estimated, estimated_runs, moved, simulated


@dataclass(frozen=True)
class ChannelTrials(Trials):
    """Runs with several channels or in s; the structure of `model` was estimated."""

    model: ChannelModel

    @property
    def names(self) -> tuple[str, ...]:
        return self.model.names

    def errors(self, promise: PredictedError) -> Array:
        """|G_hat - G_0| (runs, n) at the frequencies and entries of the promise, or its Frobenius norm."""
        w, where = np.unique(promise.w, return_inverse=True)
        true = self.true.model.plant_at(w)
        parts = []
        for theta in self.theta:
            off = np.abs(moved(self.model, theta, self.model.covariance).plant_at(w) - true)
            if promise.entries is None:
                parts.append(np.linalg.norm(off, axis=(1, 2))[where])
            else:
                parts.append(off[where, *promise.entries.T])
        return np.array(parts)

    def bound(self, promise: PredictedError, information: Array) -> Array:
        """r_u (n,) on the true system at the frequencies and entries of the promise."""
        if promise.entries is None:
            norm = NormError(self.true, Absolute(1.0), promise.alpha, self.true.band)
            return norm.error_bound(information, promise.w)
        r_u = np.empty(promise.w.size)
        for i, j in np.unique(promise.entries, axis=0):
            own = np.all(promise.entries == (i, j), axis=1)
            entry = EntryError(
                self.true, Absolute(1.0), promise.alpha, self.true.band, output=int(i), input=int(j)
            )
            r_u[own] = entry.error_bound(information, promise.w[own])
        return r_u


@dataclass(frozen=True)
class ChannelTrialJob:
    """What all batches of one study share.

    Attributes:
        true: the true system and the length of its experiment.
        model: of which the structure is estimated; the search begins at its parameters.
        step: time between samples in the unit of the experiment's frequencies.
    """

    true: ChannelExperiment
    model: ChannelModel
    excitation: ChannelExcitation
    step: float


def run_channel_job(job: ChannelTrialJob, runs: int, rng: np.random.Generator) -> ChannelTrials:
    """Simulate a batch of experiments from rest on the true system and identify each of them.

    The noise is drawn first, so that it is the same for every input. Runs where the search does not settle
    are repeated from several starts. Prior information enters as an estimate from earlier data would: with
    an error of its own in each run.
    """
    true, system, start = job.true, job.true.model, job.model.theta
    e = rng.standard_normal((runs, true.samples, system.outputs)) @ np.linalg.cholesky(system.covariance).T
    r = job.excitation.draw(runs, true.samples, rng)
    if true.loop is None:
        u_r, u = r, r
        y_r, y_e = simulated(system, r, e, job.step)
    else:
        (y_r, u_r), (y_e, u_e) = true.loop.signals(r, 0.0 * e), true.loop.signals(0.0 * r, e)
        u = u_r + u_e
    y = y_r + y_e
    found = estimated_runs(job.model, u, y, job.step, start)
    theta, converged = settled(
        found,
        lambda run: estimated(job.model, u[run], y[run], job.step, start, feedback=true.loop is not None),
        prior=true.prior if system.names == job.model.names else None,
        truth=system.theta,
        rng=rng,
    )
    caused = {"input": u_r, "output": y_r, "excitation": r}
    power = {kind: _mean_squares(signal) for kind, signal in caused.items()}
    total = {"input": _mean_squares(u), "output": _mean_squares(y)}
    return ChannelTrials(true, theta, converged, power, total, first=np.array(r[0]), model=job.model)


def _mean_squares(x: Array) -> list[float]:
    """Channel by channel over all runs (runs, samples, channels)."""
    return [float(value) for value in np.mean(x**2, axis=(0, 1))]
