"""The confidence factor alpha for which the model error itself keeps a probability, by simulation.

The chi-squared quantile makes |G(theta) - G| <= r_u hold at all frequencies for every theta of an ellipsoid
of that probability, and to first order only. Most estimates outside of that ellipsoid keep below r_adm as
well: an ellipsoid has more dimensions than a frequency response has directions that matter. Here estimates
are drawn from their asymptotic distribution, and the largest |G(theta) - G| / r_adm over the band is computed
for each with the exact G. alpha is set so that the largest r_u / r_adm equals the quantile of these maxima.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy.model_error import ModelError
from inputdesign_cli.accuracy.requirement import Requirement, inverse_factor
from inputdesign_cli.arrays import Array

_POINTS, _AT_ONCE = 800, 256  # most frequencies of the grid; draws computed together


@dataclass(frozen=True)
class Coverage:
    """Holds the number of fresh draws below r_adm in the whole band: by the exact G, and to first order.

    `kept` of `runs` estimates of simulated records do so, where there are any.
    """

    draws: int
    exact: int
    linear: int
    runs: int = 0
    kept: int = 0


@dataclass(frozen=True)
class Calibration:
    """Requires max over w of |G(theta) - G| / r_adm <= 1 with this probability.

    The same `draws` serve every information matrix, so that alpha is a smooth function of it. A new set of
    equally many draws estimates the coverage.

    Attributes:
        excess: the quantile for estimates from simulated records over the quantile for asymptotic draws.
    """

    probability: float
    draws: int
    seed: int = 0
    excess: float = 1.0

    def alpha(self, errors: Sequence[ModelError], information: Array) -> float:
        """Return the calibrated alpha for the information (k, k), in the errors' coordinates."""
        reached = self.excess * self._drawn(errors, information)
        return errors[0].alpha * reached / max(error.worst(information).ratio for error in errors)

    def corrected(self, errors: Sequence[ModelError], information: Array, estimates: Array) -> Calibration:
        """Return the calibration with `excess` measured on estimates from simulated records.

        Args:
            information: (k, k) of these records, in the coordinates of the errors.
            estimates: (n, k) in raw parameters, NaN where there is none.
        """
        found = self._quantile(largest_error(errors, estimates))
        return replace(self, excess=found / self._drawn(errors, information))

    def coverage(self, errors: Sequence[ModelError], information: Array, within: float = 1.0) -> Coverage:
        """Count fresh draws with errors of at most `within` r_adm; a best-accuracy design sets its ratio."""
        steps = self._steps(information, fresh=True)
        exact, linear = largest_error(errors, _raw(errors, steps)), _to_first_order(errors, steps)
        return Coverage(self.draws, int(np.sum(exact <= within)), int(np.sum(linear <= within)))

    def _steps(self, information: Array, *, fresh: bool) -> Array:
        """Return theta minus its nominal value, of covariance M^-1, (draws, k)."""
        normal = np.random.default_rng([self.seed, fresh]).standard_normal((self.draws, len(information)))
        return np.asarray(normal @ inverse_factor(information))

    def _drawn(self, errors: Sequence[ModelError], information: Array) -> float:
        """Return the quantile of the draws."""
        return self._quantile(largest_error(errors, _raw(errors, self._steps(information, fresh=False))))

    def _quantile(self, largest: Array) -> float:
        return float(np.quantile(largest, self.probability, method="higher"))


def largest_error(errors: Sequence[ModelError], estimates: Array) -> Array:
    """Return the largest |G(theta) - G| / r_adm over frequencies and errors (n,); infinite without a value.

    Args:
        estimates: (n, k) in raw parameters.
    """
    model, w = errors[0].experiment.model, _frequencies(errors)
    bounds = [_admissible(error, w) for error in errors]
    nominal = model.plant_at(w)
    largest = np.full(len(estimates), np.inf)
    for i in np.flatnonzero(np.isfinite(estimates).all(axis=1)).tolist():
        off = model.at(estimates[i]).plant_at(w) - nominal
        ratios = [
            np.linalg.norm(error.concerned(off), axis=1) / r_adm
            for error, r_adm in zip(errors, bounds, strict=True)
        ]
        if np.all(np.isfinite(ratios)):
            largest[i] = np.max(ratios)
    return largest


def _raw(errors: Sequence[ModelError], steps: Array) -> Array:
    """Return the parameters at steps in the coordinates of the errors, (n, k)."""
    experiment = errors[0].experiment
    return np.asarray(experiment.model.theta + experiment.raw_steps(steps))


def _to_first_order(errors: Sequence[ModelError], steps: Array) -> Array:
    """Return the largest error of each draw by the gradient of G, (draws,)."""
    w, largest = _frequencies(errors), np.zeros(len(steps))
    for error in errors:
        rows = error.plant_rows(w) / _admissible(error, w)[:, None, None]
        for part in np.array_split(np.arange(len(steps)), -(-len(steps) // _AT_ONCE)):
            ratio = np.linalg.norm(rows @ steps[part].T, axis=1)
            largest[part] = np.maximum(largest[part], ratio.max(axis=0))
    return largest


def _frequencies(errors: Sequence[ModelError]) -> Array:
    """Return the grids of all errors, thinned out: a maximum over draws needs no polish."""
    w = np.unique(np.concatenate([error.grid for error in errors]))
    return w[:: -(-len(w) // _POINTS)]


def _admissible(error: ModelError, w: Array) -> Array:
    """Return r_adm at `w`, without bound outside of the band."""
    lo, hi = error.band
    inside, found = (w >= lo) & (w <= hi), np.full(w.size, np.inf)
    found[inside] = error.admissible.at(w[inside])
    return found


def with_alpha(requirements: Iterable[Requirement], alpha: float) -> list[Requirement]:
    """Return the requirements, with this alpha in all requirements on the model error."""
    return [replace(r, alpha=alpha) if isinstance(r, ModelError) else r for r in requirements]
