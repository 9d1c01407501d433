"""What the runs of a study say of an experiment: did it keep its promise, and does theory hold?"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import CloudCurves, ErrorBandPanel
from inputdesign_cli.specification import Spec

_QUANTILES = (0.05, 0.5, 0.95)
# A fraction on the true system this far below that on the design model is worth a note.
_GAP = 0.03
_PAIRS = 4
_CLOUD = 2000


@dataclass(frozen=True)
class PredictedError:
    """What the design promises over frequency: r_u and, if one is asked for, r_adm, (n,) each.

    `w` (n,) is in the unit of the experiment. Several entries of G stand one after the other, each over its
    own frequencies: `entries` holds the entry (output, input) of each value, (n, 2). Without it the promise
    is about the one entry of G, or the Frobenius norm of all.
    """

    w: Array
    r_u: Array
    r_adm: Array | None
    alpha: float
    entries: NDArray[np.int64] | None = None


@dataclass(frozen=True)
class Trials(ABC):
    """What many runs of one input gave.

    Attributes:
        true: the experiment on the true system.
        theta: (runs, k) estimates; `converged` (runs,).
        power: mean squares of what the excitation causes, channel by channel: input, output, excitation.
        total_power: mean squares of inputs and outputs, noise included.
        first: (samples,) or (samples, r), the excitation of the first run.
    """

    true: Any
    theta: Array
    converged: NDArray[np.bool_]
    power: dict[str, list[float]]
    total_power: dict[str, list[float]]
    first: Array

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The estimated parameters."""

    @property
    def truth(self) -> Array:
        """theta (k,) of the true system, which may have other parameters."""
        return np.asarray(self.true.model.theta)

    @property
    def same_structure(self) -> bool:
        """Whether the true system has the parameters of the model."""
        return bool(self.true.model.names == self.names)

    @abstractmethod
    def errors(self, promise: PredictedError) -> Array:
        """|G_hat - G_0| (runs, n) where the promise is made."""

    @abstractmethod
    def bound(self, promise: PredictedError, information: Array) -> Array:
        """r_u (n,) on the true system where the promise is made."""


def judged(
    trials: Trials,
    promise: PredictedError,
    information: Array | None,
    *,
    name: str,
    cost: float,
    unit: float,
) -> dict[str, Any]:
    """An entry of `simulation.inputs`.

    Args:
        information: (k, k) in theory, of the excitation on the true system; None where the true system has
            other parameters than the model.
        name: of the excitation.
        unit: frequencies of the experiment divided by this are in rad per time unit.
    """
    names = trials.names
    entry: dict[str, Any] = fractions(trials, promise, information, name=name)
    entry |= {
        "mean_estimate": dict(zip(names, trials.theta.mean(axis=0).tolist(), strict=True)),
        "cost": cost,
        "power": trials.power,
        "total_power": trials.total_power,
        "not_converged": int(np.sum(~trials.converged)),
    }
    if information is not None:
        entry["covariance_eigenvalues"] = whitened_eigenvalues(trials.theta, information)
        deviations = np.sqrt(np.diag(_inverse(information)))
        rms = np.sqrt(np.mean((trials.theta - trials.truth) ** 2, axis=0))
        entry["rms_over_theory"] = dict(zip(names, (rms / deviations).tolist(), strict=True))
        if promise.r_adm is not None:
            ratio = trials.bound(promise, information) / promise.r_adm
            worst = int(np.argmax(ratio))
            entry["theory_on_truth"] = {
                "worst_ratio": float(ratio[worst]),
                "frequency": float(promise.w[worst] / unit),
            }
    if promise.r_adm is not None:
        beyond = trials.errors(promise) / promise.r_adm
        failed = beyond.max(axis=1) > 1.0
        if np.any(failed):
            where = promise.w[np.argmax(beyond[failed], axis=1)] / unit
            entry["violations"] = {
                "runs": int(failed.sum()),
                "frequency_quantiles": np.quantile(where, _QUANTILES),
                "largest_ratio": float(beyond.max()),
            }
    return entry


def fractions(
    trials: Trials, promise: PredictedError, information: Array | None, *, name: str
) -> dict[str, Any]:
    """Fractions of the runs whose error stays within bounds at all frequencies, with 95 % limits."""
    errors = trials.errors(promise)
    runs = len(errors)
    bounds = {} if promise.r_adm is None else {"r_adm": promise.r_adm}
    if name == "design":
        bounds["promised_r_u"] = promise.r_u
    if information is not None:
        bounds["r_u"] = trials.bound(promise, information)
    entry: dict[str, Any] = {}
    for kind, bound in bounds.items():
        inside = int(np.sum(np.all(errors <= bound, axis=1)))
        entry[f"within_{kind}"] = inside / runs
        entry[f"within_{kind}_limits"] = list(binomial_limits(inside, runs))
    return entry


def _inverse(information: Array) -> Array:
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))


def gap_notes(spec: Spec, inputs: Mapping[str, Any]) -> list[str]:
    """The gap between what the design promises on its own model and what the true system gives."""
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
        unit = f"rad/{spec.time_unit}"
        theory = entry.get("theory_on_truth")
        if theory is not None:
            text += (
                f". On the true system r_u reaches {theory['worst_ratio']:.2f} r_adm "
                f"(at {theory['frequency']:.3g} {unit})"
            )
        if "violations" in entry:
            low, middle, high = entry["violations"]["frequency_quantiles"]
            text += f"; 9 in 10 violations lie at {low:.3g} to {high:.3g} {unit}, median {middle:.3g}"
        return [text]
    return []


def error_bands(
    errors: Array,
    *,
    frequency: Array,
    r_u: Array | None,
    r_adm: Array | None,
    entry: tuple[int, int] | None = None,
) -> ErrorBandPanel:
    """Quantiles of the errors (runs, n) of one entry of G over frequency (n,)."""
    return ErrorBandPanel(
        frequency=frequency,
        quantiles={q: np.quantile(errors, q, axis=0) for q in _QUANTILES},
        r_u=r_u,
        r_adm=r_adm,
        entry=entry,
    )


def cloud(trials: Trials, information: Array | None) -> CloudCurves | None:
    """The estimates in some planes; None without a theory, or for a single parameter."""
    size = len(trials.names)
    if information is None or size < 2:
        return None
    pairs = sorted({round(i) for i in np.linspace(0, size - 2, _PAIRS)})
    return CloudCurves(
        names=trials.names,
        pairs=tuple((i, i + 1) for i in pairs),
        theta=trials.theta[:_CLOUD],
        centre=trials.truth,
        covariance=_inverse(information),
    )
