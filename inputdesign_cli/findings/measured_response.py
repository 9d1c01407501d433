"""The frequency response that the data have without a model, beside that of the model."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.outcome import MeasuredLines

# At how many of the frequencies no model is right any more.
_MOST_FAR = 0.1
BY_U = (
    "the frequency response without a model is from u to y in a loop: where the noise is strong it is drawn "
    "towards -1/C; record the reference as column r, and it is estimated from r"
)

WITHOUT_MODEL = FindingKind(
    "response-without-model",
    Severity.NOTE,
    "the frequency response without a model",
    "`frequency_response.csv` has G as the data have it without a model, with discs of 95 %. A right model "
    "lies outside of them at about 5 % of the frequencies.",
    "Compare it with the model in `frequency_response.png`.",
)
BIASED = FindingKind(
    "response-biased-by-loop",
    Severity.DOUBT,
    "the response without a model is drawn towards -1/C",
    "The data come from a loop, and no reference is recorded. Where the noise is strong, the ratio of y to "
    "u is that of the inverse controller.",
    "Record the reference as column r.",
)
CONTRADICTED = FindingKind(
    "response-contradicts-model",
    Severity.DOUBT,
    "the data contradict G of the model",
    "G without a model lies outside of the discs of 95 %, and farther than a fifth of |G| beyond them, at "
    "many frequencies.",
    "See whether the data come from a loop, the plant is linear, and all inputs are recorded.",
)


def response_note(of: MeasuredLines) -> list[Finding]:
    """Return what a user should know of a frequency response without a model."""
    usual = "" if of.caveat else " (a right model: at about 5 %)"
    entries = "" if of.entries == 1 else f", counted over {of.entries} entries of G"
    outside = of.model_outside or 0.0
    found = WITHOUT_MODEL.found(
        "frequency_response.csv has what the data say of G without a model"
        f"{', by the reference' if of.excitation == 'r' else ''}, with discs of 95 %: the model is "
        f"outside at {100 * outside:.0f} % of {of.frequencies} frequencies{entries}{usual}",
        where="frequency_response.csv",
        model_outside=outside,
    )
    return [found, *([BIASED.found(of.caveat, where="r")] if of.caveat else [])]


def contradicted(of: MeasuredLines) -> list[Finding]:
    """Return a finding where data and model differ in G, if both are of one plant: in open loop."""
    far = of.model_far_outside or 0.0
    if of.caveat or far < _MOST_FAR:
        return []
    return [
        CONTRADICTED.found(
            "what the data say of G without a model contradicts it: the model is farther off than the discs "
            f"of 95 %, and by a fifth of |G| besides, at {100 * far:.0f} % of the frequencies "
            "(frequency_response.png): the data may come from a loop that was not seen, the plant may not be "
            "linear, or something else moves it along with the inputs",
            where="frequency_response.csv",
            model_far_outside=far,
        )
    ]
