"""How an estimate was found, how certain its parameters are, and whether its accuracy can be evaluated."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.finding import DOUBT, NOTE, UNDECIDED, Finding, FindingKind, finding
from inputdesign_cli.identification import Estimate
from inputdesign_cli.identification.stability import without_integrators
from inputdesign_cli.outcome.model_words import blocks_of, predictor_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import roots_in_z

# An estimate nearer than this share of a standard deviation to the end of an expression was stopped there.
_ASIDE = 0.001
# A first residual beyond this number of standard deviations is reported.
_SEEN_AT_ONCE = 3.0


def unsettled(model: Model, estimate: Estimate) -> list[Finding]:
    """Return findings on a search for `model` that did not settle, or that an expression's end stopped."""
    return [*_not_settled(estimate), *stopped_at_ends(model, estimate)]


@finding(
    UNDECIDED,
    "search-not-settled",
    "Lower the orders, which may be too high for these data, or start nearer to the plant.",
    "unsettled",
)
def _not_settled(kind: FindingKind, estimate: Estimate) -> list[Finding]:
    """The search for the estimate did not converge. It may have stopped far from the minimum."""
    search = estimate.search
    fact = f"{search.steps} steps from the best of {search.starts} starts"
    return kind.when(not search.converged, fact, steps=search.steps, starts=search.starts)


@finding(
    UNDECIDED,
    "stopped-at-an-end",
    "Rewrite the expression in `plant` so that it has a value beyond this point.",
    "unsettled",
)
def stopped_at_ends(kind: FindingKind, model: Model, estimate: Estimate) -> list[Finding]:
    """A parameter stopped where its expression has no value any more, like the root of a negative number.

    The data may ask for a value beyond it, so that the estimate is not the best one.
    """
    found = []
    deviations = np.sqrt(np.diag(estimate.covariance))
    for k in np.flatnonzero(~model.dead_times).tolist():
        step = _ASIDE * deviations[k] * np.eye(1, deviations.size, k)[0]
        flaws = (model.at(model.theta + way * step).flaw for way in (-1.0, 1.0))
        flaw, value = next(filter(None, flaws), None), float(model.theta[k])
        if flaw is not None:
            fact = f"the search stopped at {model.names[k]} = {value:.6g}, beyond which {flaw}"
            found.append(kind.found(fact, where=model.names[k], value=value))
    return found


@finding(
    NOTE, "short-record", "Take a longer record for smaller ones. Accuracy is judged by simulated estimates."
)
def scattered(kind: FindingKind, factor: float, of_noise: float, runs: int) -> list[Finding]:
    """The errors of the estimate are larger than first-order theory states, as the record is short.

    Records of the estimated model were simulated and estimated again. The factor is how much farther those
    estimates scatter.
    """
    fact = (
        f"{factor:.3g} times for the plant, {of_noise:.3g} times for the noise, by {runs} simulated records"
    )
    return [kind.found(fact, factor=factor, of_noise=of_noise, runs=runs)]


@finding(
    NOTE,
    "start-estimated",
    "If the plant was at rest before, `identify` and `assess` are more accurate with its exact levels as "
    "--operating-point.",
)
def started(kind: FindingKind, estimate: Estimate, *, levels: bool) -> list[Finding]:
    """The initial state of a record was estimated too. To estimate it, and the levels, costs accuracy.

    Args:
        levels: whether the user gave the level of an output.
    """
    if not estimate.start.free:
        return []
    remedy = kind.remedy
    if levels:
        remedy = "The record does not begin at rest, or levels of --operating-point are not exact."
    if not estimate.start.rest_refuted:
        return [] if levels else [kind.found("whether it begins at rest was not asked")]
    ratio = np.abs(estimate.start.first) / np.sqrt(np.diag(estimate.noise))
    which, output = np.unravel_index(np.argmax(ratio), ratio.shape)
    first, noise = float(estimate.start.first[which, output]), float(np.sqrt(estimate.noise[output, output]))
    fact = "the first residuals together are larger than the noise explains"
    if np.max(ratio) > _SEEN_AT_ONCE:
        fact = f"a first residual is {first:.3g}, and the noise {noise:.3g}"
    where = f"y{output + 1}"
    return [kind.found(fact, where=where, remedy=remedy, first_residual=first, noise=noise)]


@finding(DOUBT, "noise-on-the-circle", "Take more data, or a lower order.")
def on_the_circle(kind: FindingKind, model: Model, estimate: Estimate) -> list[Finding]:
    """The noise hardly fades in this record, or is a difference of white noise. Deviations are unreliable.

    D, or C, has a root on the unit circle.
    """
    samples = len(estimate.errors)
    letters = " and ".join(
        letter
        for letter, polynomials in predictor_of(model).items()
        if any(np.any(np.abs(roots_in_z(without_integrators(p))) > 1.0 - 1.0 / samples) for p in polynomials)
    )
    fact = f"{letters} has a root on the unit circle, as far as {samples} samples can show"
    return kind.when(letters, fact, where=letters, samples=samples)


@finding(
    NOTE,
    "parameter-near-zero",
    "Lower the order of a polynomial. For a physical quantity take more data, or list it in `plant.known` "
    "if it is known.",
)
def near_zero(kind: FindingKind, estimate: Estimate) -> list[Finding]:
    """A parameter may be zero. Zero lies within one standard deviation of its estimate."""
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = np.flatnonzero(deviations > np.abs(estimate.theta)).tolist()
    listed = ", ".join(f"{estimate.names[k]} +- {deviations[k]:.2g}" for k in vague)
    return kind.when(listed, listed, where=", ".join(estimate.names[k] for k in vague))


@finding(NOTE, "input-taken-as-band-limited", "If the input is held in between, write `plant.sample: zoh`.")
def band_limited(kind: FindingKind, model: Model, estimate: Estimate) -> list[Finding]:
    """The input was taken as band-limited. The plant is in continuous time, and tests refute the model."""
    return kind.when(model.continuous and estimate.tests.failed, where="plant.sample")


@finding(
    UNDECIDED,
    "no-accuracy-here",
    "Correct the spec, or take new data: nothing can be asked of this estimate.",
    "unasked",
)
def unasked(kind: FindingKind, why: str) -> list[Finding]:
    """The requirement cannot be evaluated at the estimate. There is no error bound r_u, and no verdict."""
    return kind.when(why, f"there is no r_u: {why}")


def noise_probability(estimate: Estimate) -> float:
    """Return the probability that residuals are as coloured by chance if the noise model is right."""
    return min(test.probability for test in estimate.tests.scores if test.fault == "noise")


@finding(
    NOTE, "noise-estimated-along", "Before another design, copy `noise` from `model.yaml` into the spec."
)
def larger_noise(kind: FindingKind, model: Model, probability: float | None) -> list[Finding]:
    """The noise has more structure than the spec says. Small orders of C and D were estimated too.

    Tests, covariance and verdict hold for this larger model.

    Args:
        probability: probability of the residuals with the noise of the spec; None if it was not enlarged.
    """
    if probability is None:
        return []
    noise = {letter: rows for letter, rows in blocks_of(model)["noise"].items() if letter in ("C", "D")}
    stated = " and ".join(
        f"{letter} of order {max(len(row) for row in (rows if isinstance(rows[0], list) else [rows])) - 1}"
        for letter, rows in noise.items()
    )
    fact = (
        f"{stated}, since residuals with that of the spec were not white (probability {chance(probability)})"
    )
    return [kind.found(fact, where="noise", probability=probability, noise=stated)]
