"""A Monte Carlo study: experiments from rest on the true system or the design model, and their estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Absolute, ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.plant import Model

if TYPE_CHECKING:
    from inputdesign_cli.identification import BatchEstimate, Earlier, Estimate

# Records of outputs that are simulated and identified in one pass.
_OUTPUTS_AT_ONCE = 100


@dataclass(frozen=True)
class PredictedError:
    """Holds the error over frequency that the design predicts: r_u and, if asked for, r_adm, (n,) each.

    `w` (n,) is in the unit of the experiment. Several entries of G follow each other, each over its
    own frequencies: `entries` holds the entry (output, input) of each value, (n, 2). Without it the
    prediction is about the one entry of G, or the Frobenius norm of all.
    """

    w: Array
    r_u: Array
    r_adm: Array | None
    alpha: float
    entries: NDArray[np.int64] | None = None


@dataclass(frozen=True)
class Trials:
    """Holds the results of many runs of one excitation.

    Attributes:
        true: the experiment on the true system.
        model: the model whose structure was estimated.
        theta: (runs, k) estimates; `converged` (runs,).
        power: mean squares that the excitation causes, channel by channel: input, output, excitation.
        total_power: mean squares of inputs and outputs, noise included.
        first: (samples, r), the excitation of the first run.
        information: (k, k) in theory, or None if the true system has other parameters than the model.
    """

    true: Experiment
    model: Model
    theta: Array
    converged: NDArray[np.bool_]
    power: dict[PowerKind, list[float]]
    total_power: dict[PowerKind, list[float]]
    first: Array
    name: str = ""  # name of the excitation
    information: Array | None = None

    @classmethod
    def joined(cls, parts: Sequence[Trials]) -> Trials:
        """Join all batches of one study; mean squares are weighted by the number of runs."""
        weights = [len(part.theta) for part in parts]

        def averaged(entries: Sequence[dict[PowerKind, list[float]]]) -> dict[PowerKind, list[float]]:
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

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the estimated parameters."""
        return self.model.names

    @property
    def truth(self) -> Array:
        """Return theta (k,) of the true system, which may have other parameters."""
        return self.true.model.theta

    def errors(self, predicted: PredictedError) -> Array:
        """Return |G_hat - G_0| (runs, n) at the predicted frequencies and entries, or its Frobenius norm."""
        w, where = np.unique(predicted.w, return_inverse=True)
        true, entries = self.true.model.plant_at(w), predicted.entries
        apart = (np.abs(self.model.at(theta).plant_at(w) - true) for theta in self.theta)
        if entries is None:
            return np.array([np.linalg.norm(off, axis=(1, 2))[where] for off in apart])
        return np.array([off[where, *entries.T] for off in apart])

    def bound(self, predicted: PredictedError, information: Array) -> Array:
        """Return r_u (n,) on the true system at the frequencies and entries of the prediction."""
        w, entries, r_u = predicted.w, predicted.entries, np.empty(predicted.w.size)
        whole = ModelError(
            experiment=self.true,
            band=self.true.band,
            entry=None,
            admissible=Absolute(1.0),  # a placeholder, as r_adm is not used
            alpha=predicted.alpha,
        )
        if entries is None:
            return whole.error_bound(information, w)
        for i, j in np.unique(entries, axis=0).tolist():
            own = np.all(entries == (i, j), axis=1)
            r_u[own] = replace(whole, entry=(i, j)).error_bound(information, w[own])
        return r_u


def tried_on(
    system: Experiment,
    model: Model,
    excitation: Excitation,
    *,
    runs: int,
    seed: Seed,
    step: float,
    executor: Executor | None = None,
) -> Trials:
    """Try an excitation on a system: the true one, or the design model.

    Args:
        model: the model whose structure is estimated.
        seed: all excitations of a study share it, so that they have the same noise.
        step: time between samples in the unit of the experiment's frequencies.
        executor: where the batches of runs are computed (default: in this process); the result does not
            depend on it.
    """
    run, size = partial(_run, system, model, excitation, step), max(1, _OUTPUTS_AT_ONCE // model.outputs)
    parts = run_batches(run, runs=runs, size=size, seed=seed, executor=executor)
    information = excitation.information(system) if system.model.names == model.names else None
    return replace(Trials.joined(parts), name=excitation.name, information=information)


def _run(
    true: Experiment, model: Model, excitation: Excitation, step: float, runs: int, rng: np.random.Generator
) -> Trials:
    """Simulate a batch of experiments from rest on the true system and identify each of them.

    The noise is drawn first, so that all excitations have the same noise. Runs where the search does not
    settle are repeated from several starts. Prior information enters as an estimate from earlier data, with
    an independent error in each run. The search begins at the parameters of `model`.
    """
    from inputdesign_cli.identification import fit_batch, identify  # only now: designs do not need it

    system = true.model
    e = _noise(true, runs, rng)
    r = excitation.draw(runs, true.samples, rng)
    (u_r, u), (y_r, y) = responses(true, r, e, step)
    found = fit_batch(model, u, y, step, start=model.theta)
    again = partial(identify, model, step=step, start=model.theta, feedback=true.loop is not None, rest=True)
    found = _again_where_lost(again, u, y, found)
    theta = found.theta
    if true.prior is not None and system.names == model.names:
        theta = _with_prior(found, true.prior, system.theta, rng)
    caused: dict[PowerKind, Array] = {"input": u_r, "output": y_r, "excitation": r}
    everything: dict[PowerKind, Array] = {"input": u, "output": y}
    power, total = (
        {kind: np.mean(signal**2, axis=(0, 1)).tolist() for kind, signal in signals.items()}
        for signals in (caused, everything)
    )
    return Trials(true, model, theta, found.converged, power, total, first=np.array(r[0]))


def _noise(true: Experiment, runs: int, rng: np.random.Generator) -> Array:
    """Draw e (runs, samples, p) of a system."""
    system = true.model
    white = rng.standard_normal((runs, true.samples, system.outputs))
    return np.asarray(white @ np.linalg.cholesky(system.covariance).T)


def responses(true: Experiment, r: Array, e: Array, step: float) -> tuple[tuple[Array, Array], ...]:
    """Return u (runs, samples, r) and y (runs, samples, p) from rest: due to r alone, and to r and e."""
    if true.loop is None:
        y_r, y_e = true.model.simulate(r, e, step)
        return (r, r), (y_r, y_r + y_e)
    (y_r, u_r), (y_e, u_e) = true.loop.signals(r, 0.0 * e), true.loop.signals(0.0 * r, e)
    return (u_r, u_r + u_e), (y_r, y_r + y_e)


def _again_where_lost(
    again: Callable[[Array, Array], Estimate], u: Array, y: Array, found: BatchEstimate
) -> BatchEstimate:
    """Return the estimates, each run whose search did not settle estimated anew from several starts."""
    theta, noise, information = found.theta.copy(), found.noise.copy(), found.information.copy()
    converged, steps = found.converged.copy(), found.steps.copy()
    lost = np.flatnonzero(~converged).tolist()
    for done, run in enumerate(lost):
        report_progress(Counted(f"simulated runs: {len(u)}; searched from several starts", done, len(lost)))
        try:
            other = again(u[run], y[run])
        except SpecError:  # with this noise, some parameter has no estimate
            continue
        theta[run], noise[run], information[run] = other.theta, other.noise, other.information
        converged[run], steps[run] = other.search.converged, other.search.steps
    return replace(found, theta=theta, noise=noise, information=information, converged=converged, steps=steps)


def _with_prior(found: BatchEstimate, prior: Array, centre: Array, rng: np.random.Generator) -> Array:
    """Combine estimates (runs, k) with earlier ones about `centre`, whose information may be singular."""
    values, vectors = np.linalg.eigh(prior)
    root: NDArray[np.float64] = vectors * np.sqrt(np.maximum(values, 0.0))
    earlier = prior @ centre + rng.standard_normal(found.theta.shape) @ root.T
    own = np.einsum("rij,rj->ri", found.information, found.theta)
    return np.linalg.solve(found.information + prior, (own + earlier)[:, :, None])[:, :, 0]


def searched_run(
    nominal: Experiment, record: Array, step: float, rng: np.random.Generator, earlier: Earlier | None
) -> tuple[Estimate, bool]:
    """Return the minima that the search of `identify` finds, and whether the nominal plant's is the best.

    The estimate is the minimum that is nearest to the nominal parameters; its rivals are the others. Their
    excess is negative where they explain the record better.

    Args:
        nominal: the experiment, in raw parameters.
        record: (n, r), the excitation.
        step: time between samples in the unit of the experiment's frequencies.
        earlier: the earlier estimates that are combined with the record.

    Raises:
        SpecError: see `identify`.
    """
    from inputdesign_cli.identification import Rival, identify

    true, model = nominal.with_samples(len(record)), nominal.model
    (_, u), (_, y) = responses(true, record[None], _noise(true, 1, rng), step)
    found = identify(
        model, u[0], y[0], step, start=model.theta, feedback=true.loop is not None, rest=True, earlier=earlier
    )
    minima = (Rival(found.theta, 0.0), *found.search.rivals)
    away = [float(np.sum((found.factor.T @ (one.theta - model.theta)) ** 2)) for one in minima]
    number = int(np.argmin(away))
    home = minima[number]
    others = tuple(Rival(one.theta, one.excess - home.excess) for n, one in enumerate(minima) if n != number)
    return replace(found, theta=home.theta).with_rivals(others), number == 0
