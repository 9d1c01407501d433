"""How sure single parameters of an estimate are, how its records begin, and what it cannot be asked."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.findings.remedies import quantities
from inputdesign_cli.identification import Estimate
from inputdesign_cli.identification.stability import without_integrators
from inputdesign_cli.outcome.model_words import predictor_of
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import roots_in_z

# A first residual beyond this number of standard deviations is reported.
_SEEN_AT_ONCE = 3.0
_NORMAL = 1.96  # 95 % of a Gaussian estimate

START = FindingKind(
    "start-estimated",
    Severity.NOTE,
    "the start of a record was estimated along",
    "A record does not begin at rest about zero, or may not. The level of each output and the state at the "
    "start are estimated along, which costs some accuracy.",
    "Where the plant was at rest before, `--operating-point` with the levels gives a more certain estimate.",
)
ON_CIRCLE = FindingKind(
    "noise-on-the-circle",
    Severity.DOUBT,
    "a polynomial of the noise has a root on the unit circle",
    "As far as these samples show, a root of C, D or F lies on the unit circle. The covariance is not to be "
    "trusted there, and a design would count on noise that vanishes or never fades.",
    "Take more data, or a lower order.",
)
NEAR_ZERO = FindingKind(
    "parameter-near-zero",
    Severity.NOTE,
    "zero lies within a standard deviation of a parameter",
    "The data do not distinguish the parameter from zero.",
    "Lower the order of a polynomial. Of a physical quantity take more data, or list what is known in "
    "`plant.known`.",
)
BAND_LIMITED = FindingKind(
    "input-taken-as-band-limited",
    Severity.NOTE,
    "the input was taken as band-limited",
    "The plant is in continuous time and tests refute the model. The input was taken for the band-limited "
    "interpolation of its samples.",
    "If the input is held between the samples, write `plant.sample: zoh`.",
)
UNASKED = FindingKind(
    "no-accuracy-here",
    Severity.UNDECIDED,
    "the question cannot be asked of the estimate",
    "What the spec asks has no answer at the estimate, for instance because the loop is unstable there. "
    "There is no error bound r_u, and no verdict.",
    "See the message: mend the spec, or take data that give another estimate.",
    "unasked",
)


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
    records = "the record does" if single else "the records do"
    seen = (
        f"a first residual of {first:.3g} where the noise has {noise:.3g}"
        if np.max(ratio) > _SEEN_AT_ONCE
        else "the first residuals together are larger than noise would make them"
    )
    return [
        START.found(
            f"{records} not begin at rest about zero ({seen}): {along}. Where the plant was at rest before, "
            "--operating-point with the levels of inputs and outputs then makes the estimate more certain",
            where=f"y{output + 1}",
            first_residual=first,
            noise=noise,
        )
    ]


def on_the_circle(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding where a polynomial of the predictor has a root on the unit circle."""
    samples = len(estimate.errors)
    letters = [
        letter
        for letter, polynomials in predictor_of(model).items()
        if any(np.any(np.abs(roots_in_z(without_integrators(p))) > 1.0 - 1.0 / samples) for p in polynomials)
    ]
    if not letters:
        return []
    return [
        ON_CIRCLE.found(
            f"{' and '.join(letters)} has a root on the unit circle, as far as {samples} samples can tell: "
            "the covariance is not to be trusted there, and a design on this model would count on noise that "
            "vanishes or never fades; take more data, or a lower order",
            where=" and ".join(letters),
            samples=samples,
        )
    ]


def near_zero(model: Model, estimate: Estimate) -> list[Finding]:
    """Return findings on parameters that may be zero: coefficients have orders, quantities do not."""
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = np.flatnonzero(deviations > np.abs(estimate.theta))
    quantity, found = quantities(model), []
    for physical, advice in (
        (True, "the data hardly tell of it; take more of them, or list what is known in plant.known"),
        (False, "an order may be too high"),
    ):
        listed = ", ".join(estimate.names[k] for k in vague if quantity[k] == physical)
        if listed:
            message = f"zero lies within a standard deviation of {listed}: {advice}"
            found.append(NEAR_ZERO.found(message, where=listed))
    for k in vague:
        if model.dead_times[k]:
            most = float(estimate.theta[k] + _NORMAL * deviations[k])
            name = estimate.names[k]
            message = f"{name} of a dead time cannot be told from zero: {most:.3g} at most (95 %)"
            found.append(NEAR_ZERO.found(message, where=name, at_most=most))
    return found


def band_limited(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding where the input between samples may explain why tests refute a continuous model."""
    if not model.continuous or not estimate.tests.failed:
        return []
    return [
        BAND_LIMITED.found(
            "the input was taken for the band-limited interpolation of its samples; where it is held "
            "between them, write plant.sample: zoh",
            where="plant.sample",
        )
    ]


def unasked(why: str) -> list[Finding]:
    """Return the finding that what is asked has no answer at the estimate, and why."""
    return [UNASKED.found(f"there is no r_u for this estimate: {why}")] if why else []
