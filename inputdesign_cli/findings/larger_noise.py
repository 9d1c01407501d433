"""The noise of the spec is refuted, and a larger one was estimated in its place."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

LARGER_NOISE = FindingKind(
    "noise-estimated-along",
    Severity.NOTE,
    "the noise has more structure than the spec says",
    "Residuals with the noise of the spec are not white. So C and D of small orders were estimated along. "
    "All tests, the covariance and the verdict are of this larger model.",
    "Take over `noise` of `model.yaml` into the spec, for the next design rests on it.",
)


def noise_probability(estimate: Estimate) -> float:
    """Return the probability of residuals as coloured, if the noise model were right."""
    return min(test.probability for test in estimate.tests.scores if test.fault == "noise")


def larger_noise(model: Model, probability: float | None) -> list[Finding]:
    """Return a finding if a larger noise was estimated; `probability` is that of the residuals before."""
    if probability is None:
        return []
    noise = blocks_of(model)["noise"]
    stated = ", ".join(f"{letter}: {noise[letter]}" for letter in ("C", "D") if letter in noise)
    return [
        LARGER_NOISE.found(
            f"the residuals are not white with the noise of the spec (probability {chance(probability)}): "
            f"{_orders(model)} estimated along, and everything here is of this model. Write noise as in "
            "model.yaml before the next design",
            where="noise",
            probability=probability,
            noise=stated,
        )
    ]


def _orders(model: Model) -> str:
    """Return a phrase with the estimated polynomials, for example `C of order 1 and D of order 2 were`."""
    noise = blocks_of(model)["noise"]
    orders = []
    for letter in ("C", "D"):
        rows = noise.get(letter, [1.0])
        order = max(len(row) for row in (rows if isinstance(rows[0], list) else [rows])) - 1
        orders += [f"{letter} of order {order}"] if order else []
    return f"{' and '.join(orders)} {'were' if len(orders) > 1 else 'was'}"
