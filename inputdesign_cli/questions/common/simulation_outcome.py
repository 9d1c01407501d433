"""What `result.json` says of a Monte Carlo study: are predictions kept, and does theory hold?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.information import PowerKind
from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues, wishart_range
from inputdesign_cli.monte_carlo.study import Study, Tried
from inputdesign_cli.monte_carlo.trials import PredictedError
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.simulation_curves import QUANTILES

# A fraction on the true system this far below that on the design model is worth a note.
_GAP = 0.03


def study_entry(study: Study, inputs: Mapping[str, Json], *, excitation: str) -> dict[str, Json]:
    """`simulation` of `result.json`.

    Args:
        inputs: what each excitation gave, see `input_entry`.
        excitation: whether each run realises the spectrum anew (`new`), or applies the one `record`.
    """
    model, size = study.true.model, len(study.nominal.model.names)
    rng = np.random.default_rng(study.seed)
    return {
        "runs": study.runs,
        "seed": study.seed,
        "samples": study.true.samples,
        "excitation": excitation,
        "true_parameters": dict(zip(model.names, model.theta.tolist(), strict=True)),
        "true_variance": float(model.covariance[0, 0]) if model.outputs == 1 else model.covariance,
        "wishart_range": list(wishart_range(size, study.runs, rng)) if study.runs > 1 else [],
        "inputs": inputs,
    }


def input_entry(
    units: Units, tried: Tried, predicted: PredictedError, errors: Array, cost: Mapping[PowerKind, Weight]
) -> dict[str, Json]:
    """What one excitation gave on the true system.

    Args:
        errors: of the runs, see `Trials.errors`.
        cost: weights of the powers of an excitation.
    """
    trials, information = tried.trials, tried.information
    names, r_adm = trials.names, predicted.r_adm
    entry = fractions(tried, predicted, errors) | {
        "mean_estimate": dict(zip(names, trials.theta.mean(axis=0).tolist(), strict=True)),
        "cost": weighted_sum(cost, trials.power),
        "power": trials.power,
        "total_power": trials.total_power,
        "not_converged": int(np.sum(~trials.converged)),
    }
    if information is not None:
        entry["covariance_eigenvalues"] = whitened_eigenvalues(trials.theta, information)
        deviations = np.sqrt(np.diag(covariance_in_theory(information)))
        rms = np.sqrt(np.mean((trials.theta - trials.truth) ** 2, axis=0))
        entry["rms_over_theory"] = dict(zip(names, (rms / deviations).tolist(), strict=True))
        if r_adm is not None:
            ratio = trials.bound(predicted, information) / r_adm
            worst = int(np.argmax(ratio))
            entry["theory_on_truth"] = {
                "worst_ratio": float(ratio[worst]),
                "frequency": float(predicted.w[worst] / units.frequency),
            }
    if r_adm is not None:
        beyond = errors / r_adm
        failed = beyond.max(axis=1) > 1.0
        if np.any(failed):
            where = predicted.w[np.argmax(beyond[failed], axis=1)] / units.frequency
            entry["violations"] = {
                "runs": int(failed.sum()),
                "frequency_quantiles": np.quantile(where, QUANTILES),
                "largest_ratio": float(beyond.max()),
            }
    return entry


def fractions(tried: Tried, predicted: PredictedError, errors: Array) -> dict[str, Json]:
    """Fractions of the runs whose error stays within bounds at all frequencies, with 95 % limits."""
    bounds = {} if predicted.r_adm is None else {"r_adm": predicted.r_adm}
    if tried.name == "design":
        bounds["promised_r_u"] = predicted.r_u
    if tried.information is not None:
        bounds["r_u"] = tried.trials.bound(predicted, tried.information)
    entry: dict[str, Json] = {}
    for kind, bound in bounds.items():
        inside = int(np.sum(np.all(errors <= bound, axis=1)))
        entry[f"within_{kind}"] = inside / len(errors)
        entry[f"within_{kind}_limits"] = list(binomial_limits(inside, len(errors)))
    return entry


def covariance_in_theory(information: Array) -> Array:
    """M^-1 (k, k) by way of unit diagonal."""
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))


def confidence_notes(result: Mapping[str, Json], inputs: Mapping[str, Json]) -> list[str]:
    """Whether the runs keep less than the exact confidence that was asked for."""
    told = result.get("model_error", {}).get("confidence", {})
    asked = told.get("asked")
    entry = inputs.get("design", {})
    limits = entry.get("within_r_adm_limits")
    if asked is None or limits is None or "on_design_model" in entry or limits[1] >= asked:
        return []
    why = (
        "alpha was calibrated by simulated experiments, and chance had a part in it: ask for more of them "
        "(runs)"
        if "runs" in told
        else "estimates of records this short scatter more than the asymptotic theory that sizes r_u: leave "
        "out runs: 0, ask for a little more, or take more samples"
    )
    kept = f"{100 * entry['within_r_adm']:.1f} % of the runs stay within r_adm"
    return [f"{kept}, where exact: {asked:g} was asked for: {why}"]


def searched_notes(searched: Mapping[str, int]) -> list[str]:
    """That the runs tell of one minimum only, where records leave others."""
    if not searched:
        return []
    runs = searched["runs"]
    return [
        "the runs of simulate begin their estimates at the nominal parameters, and so tell of the minimum "
        f"there alone: with the search of identify {searched['elsewhere']} of {runs} records end at other "
        f"parameters, and {searched['rivals']} of {runs} would be undecided"
    ]


def gap_notes(units: Units, inputs: Mapping[str, Json]) -> list[str]:
    """The gap between what the design predicts on its own model and what the true system gives."""
    for name, entry in inputs.items():
        modelled = entry.get("on_design_model", {}).get("within_r_adm")
        found = entry.get("within_r_adm")
        if modelled is None or found is None or modelled - found < _GAP:
            continue
        text = (
            f"{name.replace('_', ' ')}: {100 * found:.0f} % of the runs stay within r_adm on the true "
            f"system, but {100 * modelled:.0f} % where the true system is the design model: the experiment "
            "was designed on an initial estimate that is not the truth"
        )
        theory = entry.get("theory_on_truth")
        if theory is not None:
            text += (
                f". On the true system r_u reaches {theory['worst_ratio']:.2f} r_adm "
                f"(at {theory['frequency']:.3g} {units.per_time})"
            )
        if "violations" in entry:
            low, middle, high = entry["violations"]["frequency_quantiles"]
            text += (
                f"; 9 in 10 violations lie at {low:.3g} to {high:.3g} {units.per_time}, median {middle:.3g}"
            )
        return [text]
    return []
