"""The confidence factor alpha: as stated, or calibrated to the scatter of simulated estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import ModelError, Requirement
from inputdesign_cli.accuracy.calibration import Calibration, Coverage, largest_error
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.errors import InaccurateError, InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.excitations import Excitation, Reapplied, Recorded
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.monte_carlo.study import tried_on
from inputdesign_cli.outcome.design import Coverage as Reported
from inputdesign_cli.outcome.shares import per_cent

SETTLED = 1e-3
_MOST_ROUNDS = 15
_STEP = 2.0  # the largest factor on alpha in one round
_SMALLER = 0.02  # step of log(alpha) where no design exists
# Seeds that no `simulation.seed` of a spec has.
_TO_CORRECT, _TO_CHECK = 2**60, 2**60 + 1
# The most samples in all runs: many long records take minutes, and asymptotic theory holds for them.
_MOST = 20_000_000
# Runs that share one realisation of the excitation if it is at least this long: long ones hardly differ.
_EACH, _LONG = 20, 100


@dataclass(frozen=True)
class SimulatedEstimates:
    """Holds estimates from `runs` records of an excitation on the nominal plant, in raw parameters.

    `of` states the excitation and the length of its records. `sets` of runs correct alpha; others check it.
    """

    nominal: Experiment
    runs: int
    step: float
    excitation: Excitation | None = None
    sets: int = 1

    def of(self, excitation: Excitation, samples: int, sets: int = 1) -> SimulatedEstimates | None:
        """Return estimates from records of this length; None if long records make asymptotic theory good."""
        if samples * self.runs > _MOST:
            return None
        nominal = self.nominal.with_samples(samples)
        return replace(self, nominal=nominal, excitation=excitation, sets=sets)

    def of_record(self, record: Array) -> SimulatedEstimates | None:
        """Return the estimates from one record (samples, r)."""
        return self.of(Recorded("design", record, self.step), len(record))

    def corrected(
        self, calibration: Calibration, errors: Sequence[ModelError], information: Array
    ) -> Calibration:
        """Return the calibration for records this short, or raise `confidence-not-settled`."""
        streams = [_TO_CORRECT, *range(_TO_CHECK + 1, _TO_CHECK + self.sets)]
        estimates = np.concatenate([self._estimates(stream) for stream in streams])
        found = calibration.corrected(errors, information, estimates)
        if not np.isfinite(found.excess):
            raise InaccurateError.because(
                "confidence-not-settled",
                f"of {self.runs} simulated experiments more than {100 * (1 - found.probability):.3g} % give "
                "no estimate: no alpha keeps the confidence that is asked for",
                hint="take more samples, or write runs: 0 beside exact, for asymptotic theory alone",
                key="accuracy.model_error.confidence",
            )
        return found

    def checked(self, coverage: Coverage, errors: Sequence[ModelError], within: float) -> Coverage:
        """Return the coverage with the share of fresh runs within r_adm times `within`."""
        largest = largest_error(errors, self._estimates(_TO_CHECK))
        return replace(coverage, runs=self.runs, kept=int(np.sum(largest <= within)))

    def _estimates(self, seed: int) -> Array:
        """Return the estimates (runs, k), NaN where the search did not settle."""
        seconds_left()
        assert self.excitation is not None
        each = _EACH if self.nominal.samples >= _LONG else 1
        again, model = Reapplied(self.excitation, each), self.nominal.model
        trials = tried_on(self.nominal, model, again, runs=self.runs, seed=seed, step=self.step)
        return np.where(trials.converged[:, None], trials.theta, np.nan)


@dataclass(frozen=True)
class Confidence:
    """Holds alpha of r_u and of the chi-squared distribution (`usual`), its calibration and coverage if any.

    The `simulator` makes the estimates that alpha is calibrated to; asymptotic theory decides without one.
    """

    alpha: float
    usual: float
    calibration: Calibration | None = None
    coverage: Coverage | None = None
    simulator: SimulatedEstimates | None = None

    def of(
        self,
        requirements: Sequence[Requirement],
        information: Array,
        simulated: SimulatedEstimates | None = None,
    ) -> Confidence:
        """Return alpha of an experiment of this information (k, k), in the requirements' coordinates."""
        errors, calibration = bounded_errors(requirements), self.calibration
        if calibration is None or not errors:
            return self
        if simulated is not None:
            calibration = simulated.corrected(calibration, errors, information)
        alpha, coverage = calibration.alpha(errors, information), calibration.coverage(errors, information)
        if simulated is not None:
            coverage = simulated.checked(coverage, errors, 1.0)
        return Confidence(alpha, self.usual, calibration, coverage)

    @property
    def reported(self) -> Reported | None:
        """Return the confidence as the outcome has it; None if nothing was calibrated."""
        if self.coverage is None or self.calibration is None:
            return None
        return replace(
            covered(self.coverage),
            asked=self.calibration.probability,
            chi_squared_alpha=self.usual,
            excess=self.calibration.excess if self.coverage.runs else None,
        )


def covered(coverage: Coverage) -> Reported:
    """Return the shares of estimates within r_adm with their 95 % limits: of draws and of runs."""
    draws, runs, exact, kept = coverage.draws, coverage.runs, coverage.exact, coverage.kept
    found = Reported(draws, exact / draws, binomial_limits(exact, draws), coverage.linear / draws)
    if not runs:
        return found
    return replace(found, runs=runs, kept=kept / runs, kept_limits=binomial_limits(kept, runs))


def beyond_chance(coverage: Coverage, probability: float) -> int:
    """Return -1 if fewer runs than asked keep r_adm, 1 if more, by more than chance, and else 0."""
    if not coverage.runs:
        return 0
    least, most = binomial_limits(coverage.kept, coverage.runs)
    return int(least > probability) - int(most < probability)


def bounded_errors(requirements: Sequence[Requirement]) -> list[ModelError]:
    """Return the requirements on a model error to first order."""
    return [requirement for requirement in requirements if isinstance(requirement, ModelError)]


def settled_alpha(needed: Callable[[float], float | None], start: float) -> float:
    """Return the alpha whose design needs just that alpha, or raise `infeasible` or `confidence-not-settled`.

    A design for a larger alpha is more accurate, and needs a smaller one. So log(needed / alpha) falls, and
    the secant method in log(alpha) finds its root. Where there is no design within the limits `needed` is
    None.
    """
    x, before, missing, refused = np.log(start), None, np.nan, False
    for _ in range(_MOST_ROUNDS):
        alpha = needed(float(np.exp(x)))
        if alpha is None:
            refused, before = True, None
            x -= _SMALLER
            continue
        missing = float(np.log(alpha) - x)
        if abs(missing) <= SETTLED:
            return float(np.exp(x))
        step = missing
        if before is not None and (slope := (missing - before[1]) / (x - before[0])) < 0.0:
            step = -missing / slope
        before = (x, missing)
        x += float(np.clip(step, -np.log(_STEP), np.log(_STEP)))
    if refused:
        raise InfeasibleError.because(
            "infeasible",
            "no design within the limits was found that keeps the exact confidence; that there is none is "
            "not proved",
            hint="loosen the limits, or ask for confidence: 0.95, for which `infeasible` is proved",
            key="limits",
        )
    raise InaccurateError.because(
        "confidence-not-settled",
        f"no alpha was found for which a design keeps the confidence asked for: after {_MOST_ROUNDS} "
        f"designs it still changes by {per_cent(abs(missing), 2)}",
        hint="ask for more draws (confidence: {exact: .., draws: 20000}), or for confidence: 0.95",
        key="accuracy.model_error.confidence",
    )
