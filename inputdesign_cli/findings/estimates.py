"""How an estimate was found, how sure its parameters are, and what it cannot be asked."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.finding import Finding, doubt, note, unsure
from inputdesign_cli.findings.refuted_structure import quantities
from inputdesign_cli.identification import Estimate
from inputdesign_cli.identification.stability import without_integrators
from inputdesign_cli.outcome.model_words import blocks_of, predictor_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import roots_in_z

# Of a standard deviation: nearer to where an expression ends, an estimate was stopped there.
_ASIDE = 0.001
# A first residual beyond this number of standard deviations is reported.
_SEEN_AT_ONCE = 3.0
_NORMAL = 1.96  # 95 % of a Gaussian estimate

NOT_SETTLED = unsure(
    "search-not-settled",
    "The search for the estimate did not converge. It still moved at its last step, perhaps far from the "
    "minimum.",
    "Lower the orders, which may be too high for these data, or start nearer to the plant.",
    "unsettled",
)
STOPPED = unsure(
    "stopped-at-an-end",
    "The search stopped at the boundary of an expression. Beyond the estimate an expression of the spec is "
    "not defined. The likeliest parameters may lie there, and the standard deviation is unreliable.",
    "Rewrite it so that it is defined for every possible plant.",
    "unsettled",
)
START = note(
    "start-estimated",
    "The initial state of a record was estimated too. The record may not begin at rest about zero. Output "
    "levels and initial state cost some accuracy.",
    "If the plant was at rest before, `--operating-point` with the levels gives a more accurate estimate.",
)
ON_CIRCLE = doubt(
    "noise-on-the-circle",
    "A noise polynomial has a root on the unit circle. The covariance is unreliable, and a design would "
    "assume noise that vanishes or never decays.",
    "Take more data, or a lower order.",
)
NEAR_ZERO = note(
    "parameter-near-zero",
    "A parameter may be zero. Zero lies within one standard deviation of its estimate.",
    "Lower the order of a polynomial. For a physical quantity take more data, or list it in `plant.known` "
    "if it is known.",
)
BAND_LIMITED = note(
    "input-taken-as-band-limited",
    "The input was taken as band-limited. The plant is in continuous time, and tests refute the model.",
    "If the input is held between the samples, write `plant.sample: zoh`.",
)
UNASKED = unsure(
    "no-accuracy-here",
    "The requirement cannot be evaluated at the estimate. The loop may be unstable there, for instance. "
    "There is no error bound r_u, and no verdict.",
    "See the message: correct the spec, or take data that give another estimate.",
    "unasked",
)
LARGER_NOISE = note(
    "noise-estimated-along",
    "The noise has more structure than the spec says. Small orders of C and D were estimated too. Tests, "
    "covariance and verdict hold for this larger model.",
    "Copy `noise` from `model.yaml` into the spec, because the next design depends on it.",
)


def unsettled(model: Model, estimate: Estimate) -> list[Finding]:
    """Return findings on a search for `model` that did not settle, or that an expression's end stopped."""
    search = estimate.search
    begun = "its only start" if search.starts == 1 else f"the best of {search.starts} starts"
    message = (
        f"the search did not settle after {search.steps} steps from {begun}: the estimate may be far from "
        "the minimum; the orders may be too high for these data"
    )
    found = [NOT_SETTLED.found(message, steps=search.steps, starts=search.starts)]
    return [*([] if search.converged else found), *stopped_at_ends(model, estimate)]


def stopped_at_ends(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding for each parameter that the search left where an expression ends."""
    found = []
    deviations = np.sqrt(np.diag(estimate.covariance))
    for k in np.flatnonzero(~model.dead_times).tolist():
        step = _ASIDE * deviations[k] * np.eye(1, deviations.size, k)[0]
        flaws = (model.at(model.theta + way * step).flaw for way in (-1.0, 1.0))
        flaw, value = next(filter(None, flaws), None), float(model.theta[k])
        if flaw is not None:
            message = (
                f"the search stopped at {model.names[k]} = {value:.6g}, beyond which {flaw}: the likeliest "
                "parameters may lie there, and its deviation is not to be trusted; write the expression so "
                "that it is defined wherever the plant may be"
            )
            found.append(STOPPED.found(message, where=model.names[k], value=value))
    return found


def started(estimate: Estimate) -> list[Finding]:
    """Return a finding where levels and starts of the records were estimated, with the largest residual."""
    if not estimate.start.free:
        return []
    along = "the level of every output and the state at the start were estimated along"
    single = len(estimate.start.first) == 1
    if not estimate.start.rest_refuted:
        begins = "the record begins" if single else "the records begin"
        return [START.found(f"whether {begins} at rest was not asked: {along}")]
    ratio = np.abs(estimate.start.first) / np.sqrt(np.diag(estimate.noise))
    which, output = np.unravel_index(np.argmax(ratio), ratio.shape)
    first, noise = float(estimate.start.first[which, output]), float(np.sqrt(estimate.noise[output, output]))
    seen = (
        f"a first residual of {first:.3g} where the noise has {noise:.3g}"
        if np.max(ratio) > _SEEN_AT_ONCE
        else "the first residuals together are larger than noise would make them"
    )
    message = (
        f"the record{' does' if single else 's do'} not begin at rest about zero ({seen}): {along}. Where "
        "the plant was at rest before, --operating-point with the levels of inputs and outputs then makes "
        "the estimate more certain"
    )
    return [START.found(message, where=f"y{output + 1}", first_residual=first, noise=noise)]


def on_the_circle(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding where a polynomial of the predictor has a root on the unit circle."""
    samples = len(estimate.errors)
    letters = " and ".join(
        letter
        for letter, polynomials in predictor_of(model).items()
        if any(np.any(np.abs(roots_in_z(without_integrators(p))) > 1.0 - 1.0 / samples) for p in polynomials)
    )
    message = (
        f"{letters} has a root on the unit circle, as far as {samples} samples can show: the covariance is "
        "not to be trusted there, and a design on this model would count on noise that vanishes or never "
        "fades; take more data, or a lower order"
    )
    return [ON_CIRCLE.found(message, where=letters, samples=samples)] if letters else []


def near_zero(model: Model, estimate: Estimate) -> list[Finding]:
    """Return findings on parameters that may be zero: coefficients have orders, quantities do not."""
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = np.flatnonzero(deviations > np.abs(estimate.theta))
    quantity, found = quantities(model), []
    for physical, advice in (
        (True, "the data hardly determine it; take more of them, or list what is known in plant.known"),
        (False, "an order may be too high"),
    ):
        listed = ", ".join(estimate.names[k] for k in vague if quantity[k] == physical)
        if listed:
            message = f"zero lies within a standard deviation of {listed}: {advice}"
            found.append(NEAR_ZERO.found(message, where=listed))
    for k in vague[model.dead_times[vague]]:
        most, name = float(estimate.theta[k] + _NORMAL * deviations[k]), estimate.names[k]
        message = f"{name} of a dead time cannot be distinguished from zero: {most:.3g} at most (95 %)"
        found.append(NEAR_ZERO.found(message, where=name, at_most=most))
    return found


def band_limited(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding where the input between samples may explain why tests refute a continuous model."""
    message = (
        "the input was taken for the band-limited interpolation of its samples; where it is held between "
        "them, write plant.sample: zoh"
    )
    refuted = model.continuous and estimate.tests.failed
    return [BAND_LIMITED.found(message, where="plant.sample")] if refuted else []


def unasked(why: str) -> list[Finding]:
    """Return the finding that what is asked has no answer at the estimate, and why."""
    return [UNASKED.found(f"there is no r_u for this estimate: {why}")] if why else []


def noise_probability(estimate: Estimate) -> float:
    """Return the probability of residuals as coloured, if the noise model were right."""
    return min(test.probability for test in estimate.tests.scores if test.fault == "noise")


def larger_noise(model: Model, probability: float | None) -> list[Finding]:
    """Return a finding if a larger noise was estimated; `probability` is that of the residuals before."""
    if probability is None:
        return []
    noise = {letter: rows for letter, rows in blocks_of(model)["noise"].items() if letter in ("C", "D")}
    orders = [
        f"{letter} of order {max(len(row) for row in (rows if isinstance(rows[0], list) else [rows])) - 1}"
        for letter, rows in noise.items()
    ]
    message = (
        f"the residuals are not white with the noise of the spec (probability {chance(probability)}): "
        f"{' and '.join(orders)} {'were' if len(orders) > 1 else 'was'} estimated along, and everything "
        "here is of this model. Write noise as in model.yaml before the next design"
    )
    stated = ", ".join(f"{letter}: {rows}" for letter, rows in noise.items())
    return [LARGER_NOISE.found(message, where="noise", probability=probability, noise=stated)]
