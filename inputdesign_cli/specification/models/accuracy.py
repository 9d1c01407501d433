"""`accuracy:`, the demands on the model: requirements, criteria, or both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Annotated, Literal

from pydantic import Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.experiment import check_names
from inputdesign_cli.specification.models.loop import ClosedLoopError, Controller, LoopMargin
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Shorthand, Wording, optional
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.transfer import DiscreteTransfer, Transfer

DEFAULT_CONFIDENCE = 0.95
# The least expected number of draws on the rarer side of a probability.
_LEAST_RARE = 4
_PROBABILITY = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
_NO_TARGET = "every estimate has some error; remove the key for the least that limits.energy allows"

Deviations = Annotated[
    Mapping[str, fields.Positive],
    Field(min_length=1),
    Wording("a mapping", "write parameter names and numbers: {b1: 0.01}"),
]

# Every other key of `accuracy` is a requirement; the mean-squared error is one where it has a target.
_NO_REQUIREMENTS = ("criterion", "scale", "closed_loop_error", "mean_squared_error")


class Sensitivity(Section, one_of=(("numerator", "max_db"),)):
    """An admissible error that keeps |W S| <= 1, or |S| below a peak, for the sensitivity S of a loop."""

    numerator: fields.Numerator | None = optional("Numerator of W in q^-1.")
    denominator: fields.Denominator | None = optional("Denominator of W (default 1), or its factors.")
    max_db: fields.Positive | None = optional("Largest |S| in dB; stands for a constant W.")
    controller: Controller | None = optional("C of the loop to be kept (default: experiment.controller).")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that W has a numerator if it has a denominator."""
        if self.denominator is not None and self.numerator is None:
            message = "{key} stands without a numerator"
            yield PathDiagnostic("missing-key", message, 'add "numerator: [..]"', ("denominator",))

    @property
    def weight(self) -> DiscreteTransfer | None:
        """Return W as a transfer function; None when the peak is given."""
        if self.numerator is None:
            return None
        return DiscreteTransfer(numerator=self.numerator, denominator=self.denominator or (1.0,))


class Confidence(Section, one_of=(("ellipsoid", "exact"),)):
    """The probability that fixes r_u: of an ellipsoid of parameters, or of the error itself."""

    ellipsoid: fields.Fraction | None = optional("Probability that fixes alpha by chi-squared.")
    exact: fields.Fraction | None = optional("Probability that |G(theta) - G| <= r_adm at all frequencies.")
    draws: Annotated[fields.Count, SIZES["accuracy.model_error.confidence.draws"]] = Field(
        default=4000,
        description="Estimates drawn by asymptotic theory that fix alpha for exact, and as many that check.",
    )
    runs: Annotated[fields.Index, SIZES["accuracy.model_error.confidence.runs"]] = Field(
        default=4000,
        description="Simulated experiments that correct alpha for short records, and as many that check.",
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that there are enough draws and runs to estimate the probability."""
        rare = min(self.exact or 0.5, 1.0 - (self.exact or 0.5))
        least = math.ceil(_LEAST_RARE / rare - 1e-9)
        for key, count, none in (("draws", self.draws, ""), ("runs", self.runs, ", or 0 for none")):
            if count < least and not (none and count == 0):
                message = f"{{key}} is {count}: too few to estimate a probability of {self.exact or 0.5:g}"
                yield PathDiagnostic("out-of-range", message, f"write {least} or more{none}", (key,))


class ModelError(
    Section, one_of=(("relative", "absolute", "table", "sensitivity"),), not_both=(("confidence", "alpha"),)
):
    """r_u(w) <= r_adm(w) at every frequency of the band."""

    relative: fields.Positive | None = optional("r_adm = this fraction of |G|.")
    absolute: fields.Positive | None = optional("r_adm = this value at every frequency.")
    table: fields.FileName | None = optional("CSV file with columns frequency and r_adm.")
    sensitivity: Sensitivity | None = optional("r_adm from a bound on a sensitivity.")
    confidence: Annotated[Confidence, Shorthand("ellipsoid", _PROBABILITY)] | None = optional(
        "Probability that fixes alpha by chi-squared, or {exact: 0.95}: by simulated estimates."
    )
    alpha: fields.Positive | None = optional("Size of the confidence region, in place of confidence.")
    band: fields.Band | None = optional("Frequencies [low, high] (default: all).")
    weight: Transfer | None = optional("Weight on the model error (default 1).")
    norm: Literal["entry", "frobenius"] | None = optional(
        "entry: each entry of G for itself (default); frobenius: of all together, as for sensitivity."
    )
    region: Literal["first_order", "ellipsoid"] = Field(
        default="first_order", description="first_order: linearised; ellipsoid: every model of the ellipsoid."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that norm and region go with the bound and its probability."""
        if self.sensitivity is not None and self.norm == "entry":
            message = "{key} is entry, but a sensitivity depends on all entries of the error together"
            yield PathDiagnostic("conflicting-keys", message, "remove norm, or write frobenius", ("norm",))
        if self.region == "ellipsoid" and self.calibrated is not None:
            message = (
                "{key} is ellipsoid, but an exact confidence is that of the estimates, not of an ellipsoid"
            )
            yield PathDiagnostic("conflicting-keys", message, "remove region", ("region",))

    @property
    def calibrated(self) -> Confidence | None:
        """Return the exact confidence, where one is asked for."""
        stated = self.confidence
        return stated if stated is not None and stated.exact is not None else None

    @property
    def probability(self) -> float | None:
        """Return the confidence, 0.95 when neither it nor alpha is given; None when alpha is given."""
        if self.alpha is not None:
            return None
        stated = self.confidence
        return (stated and (stated.ellipsoid or stated.exact)) or DEFAULT_CONFIDENCE


class InformationTarget(Section):
    """The information matrix must exceed this one."""

    matrix: fields.SymmetricMatrix = Field(description="Symmetric matrix, a row per parameter.")
    parameters: fields.Names | None = optional("Names that order its rows (default: of the model).")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every row has a name."""
        yield from check_names(self.parameters, len(self.matrix), "matrix")


class Application(Section):
    """Application-oriented accuracy: M >= (chi2 gamma / 2) V'', V the degradation of the application."""

    parameters: fields.Names = Field(description="Names of the parameters, row by row.")
    hessian: fields.SemidefiniteMatrix = Field(description="V'' of the application cost.")
    gamma: fields.Positive = Field(description="Accuracy: V may reach 1/gamma.")
    confidence: fields.Fraction = Field(default=DEFAULT_CONFIDENCE, description="Probability (default 0.95).")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every row has a name."""
        yield from check_names(self.parameters, len(self.hessian), "hessian")


class WeightedVariance(Section):
    """|W|^2 Lambda^* P Lambda <= max at every frequency of the band."""

    weight: Transfer | None = optional("The weight W (default 1).")
    max: fields.Positive = Field(description="Largest admissible weighted variance.")
    band: fields.Band | None = optional("Frequencies [low, high] (default: all).")
    relative: fields.Flag = Field(default=False, description="Whether the variance is relative to |G|^2.")


class MeanSquaredError(Section):
    """Mean-squared error of an estimated quantity when some regressors are neglected."""

    estimated: fields.Numbers = Field(description="Weights of the estimated parameters in the quantity.")
    neglected: fields.Numbers | None = optional("Weights of the neglected ones (default 0).")
    neglected_norm: Annotated[
        fields.NonNegative, Wording("a number", "a norm is not negative; 0 stands for no bias at all")
    ] = Field(description="Bound on the norm of the neglected parameters.")
    target: Annotated[fields.Positive, Wording("a number", _NO_TARGET)] | None = optional(
        "Largest admissible error; absent: the least that limits.energy allows."
    )


class FrequencyResponse(Section, one_of=(("relative", "absolute", "table"), ("frequencies", "band"))):
    """The standard deviation of a nonparametric frequency response, line by line, for periodic excitation."""

    relative: fields.Positive | None = optional("r_adm = this fraction of |G|.")
    absolute: fields.Positive | None = optional("r_adm = this value at every line.")
    table: fields.FileName | None = optional("CSV file with columns frequency and r_adm.")
    frequencies: Annotated[fields.Frequencies, SIZES["accuracy.frequency_response.lines"]] | None = optional(
        "The lines, increasing; each moves to the nearest harmonic of the period."
    )
    band: fields.Band | None = optional("Or lines in [low, high], even in the logarithm.")
    lines: Annotated[fields.Count, SIZES["accuracy.frequency_response.lines"]] | None = optional(
        "Number of lines in the band (default: every harmonic of the period)."
    )
    period: Annotated[fields.Count, Field(ge=3), SIZES["signal.samples"]] | None = optional(
        "Samples of a period (default: the record in signal.periods equal ones, or in five)."
    )
    transient: Annotated[fields.Index, SIZES["signal.samples"]] = Field(
        default=1, description="Periods that are left to the transient and not counted (default 1)."
    )
    detection: Annotated[fields.AtLeastTwo, SIZES["accuracy.frequency_response.lines"]] | None = optional(
        "Only odd harmonics, without a random one of each such group: power at others is nonlinear."
    )
    noise: fields.FileName | None = optional(
        "CSV file with columns frequency and noise_spectrum (of explore) in place of the model."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that a number of lines has a band."""
        if self.lines is not None and self.band is None:
            message, hint = "{key} is of a band, and there is none", "add band: [low, high], or remove lines"
            yield PathDiagnostic("unsuitable-key", message, hint, ("lines",))


class Accuracy(Section, not_both=(("model_error", "loop"),)):
    """Requirements on the model; several may stand together. A criterion asks for the best instead."""

    model_error: ModelError | None = optional("Bound on the model error over frequency.")
    loop: LoopMargin | None = optional("Margin of a loop, kept with every plant within the model error.")
    information: Annotated[InformationTarget, Shorthand("matrix", {"type": "array"})] | None = optional(
        "Lower bound on the information matrix."
    )
    application: Application | None = optional("Application-oriented ellipsoid.")
    weighted_variance: WeightedVariance | None = optional("Bound on a weighted variance.")
    standard_deviation: Deviations | None = optional("Largest standard deviation of each named parameter.")
    frequency_response: FrequencyResponse | None = optional(
        "Bound on the standard deviation of a nonparametric frequency response."
    )
    criterion: Literal["D", "A", "E", "T"] | None = optional(
        "The best det, trace of inverse, smallest eigenvalue or trace of M within limits."
    )
    scale: Literal["absolute", "relative"] = Field(
        default="absolute", description="Of the parameters, or of their relative errors."
    )
    closed_loop_error: ClosedLoopError | None = optional("Error of the loop that is designed on the model.")
    mean_squared_error: MeanSquaredError | None = optional("Mean-squared error with neglected regressors.")

    @property
    def error(self) -> ModelError | None:
        """Return the bound on the model error, stated or derived from the margin of the loop."""
        if self.loop is None:
            return self.model_error
        confidence = None if self.loop.confidence is None else Confidence(ellipsoid=self.loop.confidence)
        return ModelError(
            sensitivity=Sensitivity(max_db=20.0 * math.log10(self.loop.peak)),
            confidence=confidence,
            band=self.loop.band,
        )

    @cached_property
    def requirements(self) -> tuple[str, ...]:
        """Return the keys of the requirements that are given, in the order of the contract."""
        names = (key for key in type(self).model_fields if key not in _NO_REQUIREMENTS)
        return self.stated(*names, *(("mean_squared_error",) if self._bounds_mean_square else ()))

    @cached_property
    def goals(self) -> tuple[str, ...]:
        """Return the keys that ask for the best that limits allow."""
        least = () if self._bounds_mean_square else ("mean_squared_error",)
        return self.stated("criterion", "closed_loop_error", *least)

    @property
    def _bounds_mean_square(self) -> bool:
        """Return whether a largest mean-squared error is given; without it, the least one is sought."""
        return self.mean_squared_error is not None and self.mean_squared_error.target is not None
