"""A Monte Carlo study: experiments from rest on the true system or the design model, and their estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification import BatchEstimate, Earlier, Estimate, Rival, fit_batch, identify
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.monte_carlo.trials import Trials
from inputdesign_cli.plant import Model

# Records of outputs that are simulated and identified in one pass.
_OUTPUTS_AT_ONCE = 100


@dataclass(frozen=True)
class Study:
    """Holds the experiment on the design model and on the true system.

    Attributes:
        nominal, true: the experiment on the design model and on the true system; the same object where
            they do not differ.
        step: time between samples in the unit of the experiment's frequencies.
    """

    nominal: Experiment
    true: Experiment
    runs: int
    seed: int
    step: float


@dataclass(frozen=True)
class Tried:
    """Holds the runs of one excitation on one system.

    Attributes:
        information: (k, k) in theory, or None if the true system has other parameters than the model.
    """

    name: str
    trials: Trials
    information: Array | None


def tried_on_truth(study: Study, excitation: Excitation, executor: Executor | None = None) -> Tried:
    """Try an excitation on the true system.

    Args:
        executor: where the batches of runs are computed (default: in this process); the result does not
            depend on it.
    """
    return _tried(study, study.true, excitation, executor)


def tried_on_model(study: Study, excitation: Excitation, executor: Executor | None = None) -> Tried | None:
    """Try the excitation on the design model; return None if that is the true system."""
    return None if study.true is study.nominal else _tried(study, study.nominal, excitation, executor)


def _tried(study: Study, experiment: Experiment, excitation: Excitation, executor: Executor | None) -> Tried:
    model = study.nominal.model
    run = partial(_run, experiment, model, excitation, study.step)
    # The same seed for every excitation: they meet the same noise.
    size = max(1, _OUTPUTS_AT_ONCE // model.outputs)
    parts = run_batches(run, runs=study.runs, size=size, seed=study.seed, executor=executor)
    same = experiment.model.names == model.names
    return Tried(excitation.name, Trials.joined(parts), excitation.information(experiment) if same else None)


def _run(
    true: Experiment, model: Model, excitation: Excitation, step: float, runs: int, rng: np.random.Generator
) -> Trials:
    """Simulate a batch of experiments from rest on the true system and identify each of them.

    The noise is drawn first, so that every excitation meets the same. Runs where the search does not
    settle are repeated from several starts. Prior information enters as an estimate from earlier data would:
    with an error of its own in each run.

    Args:
        model: the model whose structure is estimated; the search begins at its parameters.
    """
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
        tell(Counted(f"simulated runs: {len(u)}; searched from several starts", done, len(lost)))
        try:
            other = again(u[run], y[run])
        except SpecError:  # the noise of this run leaves some parameter without an estimate
            continue
        theta[run], noise[run], information[run] = other.theta, other.noise, other.information
        converged[run], steps[run] = other.search.converged, other.search.steps
    return BatchEstimate(theta, noise, information, converged, steps)


def _with_prior(found: BatchEstimate, prior: Array, centre: Array, rng: np.random.Generator) -> Array:
    """Combine estimates (runs, k) with earlier estimates.

    Args:
        prior: the information (k, k) of the earlier estimates, which may be singular.
        centre: the parameters (k,) about which they scatter.
    """
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
    true, model = replace(nominal, samples=len(record)), nominal.model
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
