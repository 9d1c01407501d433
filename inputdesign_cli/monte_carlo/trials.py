"""The results of many runs of one excitation, and the errors of the estimated models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Absolute, Entry, ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import Model


@dataclass(frozen=True)
class PredictedError:
    """Holds the error over frequency that the design predicts: r_u and, if asked for, r_adm, (n,) each.

    `w` (n,) is in the unit of the experiment. Several entries of G stand one after the other, each over its
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
    """

    true: Experiment
    model: Model
    theta: Array
    converged: NDArray[np.bool_]
    power: dict[PowerKind, list[float]]
    total_power: dict[PowerKind, list[float]]
    first: Array

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
        true = self.true.model.plant_at(w)
        parts = []
        for theta in self.theta:
            off = np.abs(self.model.at(theta).plant_at(w) - true)
            if predicted.entries is None:
                parts.append(np.linalg.norm(off, axis=(1, 2))[where])
            else:
                parts.append(off[where, *predicted.entries.T])
        return np.array(parts)

    def bound(self, predicted: PredictedError, information: Array) -> Array:
        """Return r_u (n,) on the true system at the frequencies and entries of the prediction."""

        def at(w: Array, entry: Entry | None) -> Array:
            true, limit = self.true, Absolute(1.0)  # of r_adm, which is not stated
            error = ModelError(
                experiment=true, band=true.band, entry=entry, admissible=limit, alpha=predicted.alpha
            )
            return error.error_bound(information, w)

        if predicted.entries is None:
            return at(predicted.w, None)
        r_u = np.empty(predicted.w.size)
        for i, j in np.unique(predicted.entries, axis=0).tolist():
            own = np.all(predicted.entries == (i, j), axis=1)
            r_u[own] = at(predicted.w[own], (i, j))
        return r_u
