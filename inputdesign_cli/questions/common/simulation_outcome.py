"""What the outcome says of a Monte Carlo study: are predictions kept, and does theory hold?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.information import PowerKind
from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues, wishart_range
from inputdesign_cli.monte_carlo.study import Study, Tried
from inputdesign_cli.monte_carlo.trials import PredictedError, Trials
from inputdesign_cli.outcome import Powers, Simulation
from inputdesign_cli.outcome.simulation import OnDesignModel, RatioAt, TriedInput, Violations
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.simulation_curves import QUANTILES


def study_outcome(study: Study, inputs: Mapping[str, TriedInput], *, excitation: str) -> Simulation:
    """Return `simulation` of the outcome.

    Args:
        inputs: what each excitation gave.
        excitation: whether each run realises the spectrum anew (`new`), or applies the one `record`.
    """
    model, size = study.true.model, len(study.nominal.model.names)
    rng = np.random.default_rng(study.seed)
    several = tuple(map(tuple, model.covariance.tolist()))
    return Simulation(
        runs=study.runs,
        seed=study.seed,
        inputs=inputs,
        samples=study.true.samples,
        excitation=excitation,
        true_parameters=dict(zip(model.names, model.theta.tolist(), strict=True)),
        true_variance=float(model.covariance[0, 0]) if model.outputs == 1 else several,
        wishart_range=tuple(wishart_range(size, study.runs, rng)) if study.runs > 1 else (),
    )


def tried_input(
    units: Units,
    tried: Tried,
    predicted: PredictedError,
    errors: Array,
    cost: Mapping[PowerKind, Weight],
    modelled: Tried | None,
) -> TriedInput:
    """Return what one excitation gave on the true system.

    Args:
        predicted: what is compared with them.
        errors: of the runs, see `Trials.errors`.
        modelled: runs in which the true system is the design model, if the two differ.
    """
    trials, information, r_adm = tried.trials, tried.information, predicted.r_adm
    within = _fractions(tried, predicted, errors)
    entry = TriedInput(
        within_r_adm=within.within_r_adm,
        within_r_adm_limits=within.within_r_adm_limits,
        within_promised_r_u=within.within_promised_r_u,
        within_promised_r_u_limits=within.within_promised_r_u_limits,
        within_r_u=within.within_r_u,
        within_r_u_limits=within.within_r_u_limits,
        mean_estimate=_named(trials, trials.theta.mean(axis=0)),
        cost=weighted_sum(cost, trials.power),
        power=Powers.of(trials.power),
        total_power=Powers.of(trials.total_power),
        not_converged=int(np.sum(~trials.converged)),
    )
    if modelled is not None:
        on_model = _fractions(modelled, predicted, modelled.trials.errors(predicted))
        entry = replace(entry, on_design_model=on_model)
    if information is not None:
        deviations = np.sqrt(np.diag(covariance_in_theory(information)))
        rms = np.sqrt(np.mean((trials.theta - trials.truth) ** 2, axis=0))
        entry = replace(
            entry,
            covariance_eigenvalues=whitened_eigenvalues(trials.theta, information),
            rms_over_theory=_named(trials, rms / deviations),
        )
    if information is not None and r_adm is not None:
        ratio = trials.bound(predicted, information) / r_adm
        worst = int(np.argmax(ratio))
        at = RatioAt(float(ratio[worst]), float(predicted.w[worst] / units.frequency))
        entry = replace(entry, theory_on_truth=at)
    if r_adm is not None:
        beyond = errors / r_adm
        failed = beyond.max(axis=1) > 1.0
        if np.any(failed):
            where = predicted.w[np.argmax(beyond[failed], axis=1)] / units.frequency
            quantiles = np.quantile(where, QUANTILES)
            missed = Violations(int(failed.sum()), quantiles, float(beyond.max()))
            entry = replace(entry, violations=missed)
    return entry


def _named(trials: Trials, values: Array) -> dict[str, float]:
    return dict(zip(trials.names, values.tolist(), strict=True))


def _fractions(tried: Tried, predicted: PredictedError, errors: Array) -> OnDesignModel:
    """Return fractions of the runs whose error stays within bounds at all frequencies, with 95 % limits."""

    def within(bound: Array | None) -> tuple[float | None, tuple[float, float] | None]:
        if bound is None:
            return None, None
        inside = int(np.sum(np.all(errors <= bound, axis=1)))
        return inside / len(errors), binomial_limits(inside, len(errors))

    own = None if tried.information is None else tried.trials.bound(predicted, tried.information)
    promised = predicted.r_u if tried.name == "design" else None
    return OnDesignModel(*within(predicted.r_adm), *within(own), *within(promised))


def covariance_in_theory(information: Array) -> Array:
    """Return M^-1 (k, k) by way of unit diagonal."""
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))
