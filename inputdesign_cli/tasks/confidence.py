"""The confidence factor alpha: as stated, or calibrated to what estimates really do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import ModelError, Requirement
from inputdesign_cli.accuracy.calibration import Calibration, Coverage
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Json

SETTLED = 1e-3
_MOST_ROUNDS = 15
_STEP = 2.0  # the most that one round changes alpha by


@dataclass(frozen=True)
class Confidence:
    """alpha of r_u; where it was calibrated, the chi-squared one (`usual`) and what fresh draws say."""

    alpha: float
    usual: float
    probability: float | None = None
    coverage: Coverage | None = None

    @classmethod
    def of(
        cls,
        calibration: Calibration | None,
        requirements: Sequence[Requirement],
        information: Array,
        usual: float,
    ) -> Confidence:
        """The alpha of an experiment of this information (k, k), in the coordinates of the requirements."""
        errors = bounded_errors(requirements)
        if calibration is None or not errors:
            return cls(usual, usual)
        alpha = calibration.alpha(errors, information)
        return cls(alpha, usual, calibration.probability, calibration.coverage(errors, information))

    @property
    def entry(self) -> dict[str, Json]:
        """`model_error.confidence` of the result; empty where nothing was calibrated."""
        told = self.coverage
        if told is None:
            return {}
        return {"confidence": {"asked": self.probability, "chi_squared_alpha": self.usual, **covered(told)}}


def covered(coverage: Coverage) -> dict[str, Json]:
    """The shares of simulated estimates within r_adm, that by the exact G with its 95 % limits."""
    draws = coverage.draws
    return {
        "draws": draws,
        "exact": coverage.exact / draws,
        "exact_limits": list(binomial_limits(coverage.exact, draws)),
        "linear": coverage.linear / draws,
    }


def bounded_errors(requirements: Sequence[Requirement]) -> list[ModelError]:
    """The requirements on a model error to first order."""
    return [requirement for requirement in requirements if isinstance(requirement, ModelError)]


def settled_alpha(needed: Callable[[float], float], start: float) -> float:
    """The alpha whose design needs just that alpha.

    A design for a larger alpha is more accurate, and needs a smaller one: log(needed / alpha) falls, and the
    secant method in log(alpha) finds its root.

    Args:
        needed: the calibrated alpha of the design for an alpha.

    Raises:
        InaccurateError: `confidence-not-settled`.
    """
    x, before = np.log(start), None
    for _ in range(_MOST_ROUNDS):
        missing = float(np.log(needed(float(np.exp(x)))) - x)
        if abs(missing) <= SETTLED:
            return float(np.exp(x))
        step = missing
        if before is not None and (slope := (missing - before[1]) / (x - before[0])) < 0.0:
            step = -missing / slope
        before = (x, missing)
        x += float(np.clip(step, -np.log(_STEP), np.log(_STEP)))
    raise InaccurateError.because(
        "confidence-not-settled",
        f"no alpha was found for which a design keeps the confidence asked for: after {_MOST_ROUNDS} "
        f"designs it still changes by {100 * abs(missing):.2g} %",
        hint="ask for more draws (confidence: {exact: .., draws: 20000}), or for confidence: 0.95",
        key="accuracy.model_error.confidence",
    )
