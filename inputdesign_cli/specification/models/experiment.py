"""`noise:`, `experiment:` and `cost:`: what disturbs, how long, in which loop, at what price."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from inputdesign_cli.specification.models.controller import Controller
from inputdesign_cli.specification.models.fields import (
    Count,
    Names,
    Positive,
    StablePerOutput,
    WeightPerChannel,
)
from inputdesign_cli.specification.models.findings import Finding, Findings, fail
from inputdesign_cli.specification.models.plant import per_output
from inputdesign_cli.specification.models.polynomials import Polynomial
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.values import Matrix, matrix, number


def _variance(value: object) -> float | Matrix:
    if not isinstance(value, list | tuple):
        return number(value, above=0.0, hint="noise without power needs no experiment")
    rows = matrix(value)
    if smallest_eigenvalue(rows) <= 0.0:
        raise fail(
            "not-positive-definite",
            "{key} is not a covariance matrix: it must be positive definite",
            "each variance must be positive, and each covariance below the geometric mean of its variances",
        )
    return rows


def _information(value: object) -> str | Matrix:
    if isinstance(value, str) and value.strip():
        return value
    return semidefinite(value)


def semidefinite(value: object) -> Matrix:
    """A symmetric positive semidefinite matrix."""
    rows = matrix(value)
    if smallest_eigenvalue(rows) < -1e-9:
        raise fail(
            "not-positive-definite", "{key} must be positive semidefinite", "check the signs of its entries"
        )
    return rows


def smallest_eigenvalue(rows: Matrix) -> float:
    """The smallest eigenvalue of a symmetric matrix, relative to its largest entry (0 for a zero matrix)."""
    values = np.array(rows)
    scale = float(np.max(np.abs(values)))
    return float(np.linalg.eigvalsh(values / scale)[0]) if scale > 0 else 0.0


_MATRIX_SCHEMA = {"type": "array", "items": {"type": "array", "items": {"type": "number"}}}
Variance = Annotated[
    float | Matrix,
    PlainValidator(_variance),
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, _MATRIX_SCHEMA]}),
]
SemidefiniteMatrix = Annotated[Matrix, PlainValidator(semidefinite), WithJsonSchema(_MATRIX_SCHEMA)]
InformationSource = Annotated[
    str | Matrix,
    PlainValidator(_information),
    WithJsonSchema({"anyOf": [{"type": "string"}, _MATRIX_SCHEMA]}),
]


class NoiseShape(Section):
    """The filter C(q)/D(q) that colours the noise; one polynomial, or one per output."""

    C: StablePerOutput = Field(default=(1.0,), description="Monic, stable numerator in q^-1 (default 1).")
    D: StablePerOutput = Field(default=(1.0,), description="Monic, stable denominator in q^-1 (default 1).")

    def C_per_output(self, outputs: int) -> tuple[Polynomial, ...]:  # noqa: N802 (the paper's symbol)
        """One polynomial C for each output."""
        return per_output(self.C, outputs)

    @property
    def filters(self) -> tuple[str, ...]:
        """Which of C and D are not 1."""
        stated = {"C": per_output(self.C, 1), "D": per_output(self.D, 1)}
        return tuple(name for name, rows in stated.items() if any(any(p[1:]) for p in rows))

    def D_per_output(self, outputs: int) -> tuple[Polynomial, ...]:  # noqa: N802
        """One polynomial D for each output."""
        return per_output(self.D, outputs)


def covariance_of(variance: float | Matrix, outputs: int) -> np.ndarray:
    """The noise covariance as an array (outputs, outputs); a number stands for that multiple of I."""
    if isinstance(variance, tuple):
        return np.array(variance, dtype=float)
    return variance * np.eye(outputs)


class Noise(NoiseShape):
    """C(q)/D(q) e(t) with white e."""

    variance: Variance = Field(description="Variance of e, or its covariance matrix (outputs x outputs).")

    def covariance(self, outputs: int) -> np.ndarray:
        """The covariance of e as an array (outputs, outputs)."""
        return covariance_of(self.variance, outputs)


class SimulationNoise(NoiseShape):
    """The noise of a simulation: its variance, or its size relative to the outputs."""

    variance: Variance | None = Field(default=None, description="Variance of e, or its covariance matrix.")
    relative_std: Positive | None = Field(
        default=None, description="Standard deviation as a fraction of the smallest output rms."
    )

    @model_validator(mode="after")
    def _one(self) -> SimulationNoise:
        findings = Findings()
        exactly_one(findings, self, "variance", "relative_std")
        findings.stop()
        return self


class Prior(Section):
    """Information at hand before the experiment."""

    information: InformationSource = Field(
        description="Information matrix (inverse covariance) of the parameters, or the name of a data file."
    )
    parameters: Names | None = Field(
        default=None, description="Names that order the rows of the matrix (default: the order of the model)."
    )

    @model_validator(mode="after")
    def _sizes(self) -> Prior:
        findings = Findings()
        if isinstance(self.information, tuple):
            check_names(findings, self.parameters, len(self.information), "information")
        findings.stop()
        return self


class Experiment(Section):
    """How the data will be collected."""

    samples: Count = Field(default=1, description="Number of samples (default 1: criteria are per sample).")
    controller: Controller | None = Field(
        default=None,
        description="C of the loop u = r - C y, in q^-1; present: the experiment is in closed loop. With "
        "several channels numerator and denominator are rows (inputs) of columns (outputs).",
    )
    prior: Prior | None = Field(default=None, description="Information already at hand.")


class Cost(Section):
    """Weights of the powers that the design pays for; a number, or one per channel."""

    input_power: WeightPerChannel = Field(default=0.0, description="Weight of the power of u that r causes.")
    output_power: WeightPerChannel = Field(default=0.0, description="Weight of the power of y that r causes.")
    excitation_power: WeightPerChannel = Field(default=0.0, description="Weight of the power of r itself.")

    @model_validator(mode="after")
    def _some(self) -> Cost:
        weights = [self.input_power, self.output_power, self.excitation_power]
        if not any(w > 0 for given in weights for w in (given if isinstance(given, tuple) else (given,))):
            raise fail(
                "no-cost",
                "all weights of {key} are zero: every experiment would be free",
                "write input_power: 1",
            )
        return self


def exactly_one(findings: Findings, model: Section, *keys: str) -> None:
    """Exactly one of the keys is given."""
    given = [k for k in keys if getattr(model, k) is not None]
    alternatives = ", ".join(keys[:-1]) + " or " + keys[-1]
    if not given:
        needs = f"{{key}} needs one of {alternatives}"
        findings.append(Finding("missing-key", needs, "add one of them", keys=keys))
    for extra in given[1:]:
        findings.add(
            "conflicting-keys",
            f"{{key}} stands beside {given[0]}; give only one of {alternatives}",
            "remove one of the two",
            extra,
            at_key=True,
        )


def check_names(findings: Findings, names: tuple[str, ...] | None, size: int, matrix_key: str) -> None:
    """Parameter names are distinct and as many as the matrix has rows."""
    if names is None:
        return
    repeated = sorted({n for n in names if names.count(n) > 1})
    if repeated:
        findings.add("wrong-shape", f"{{key}} names {repeated[0]} more than once", "", "parameters")
    if len(names) != size:
        findings.add(
            "wrong-shape",
            f"{{key}} holds {len(names)} names, but {matrix_key} is {size} x {size}",
            "write one name per row, in the order of the rows",
            "parameters",
        )
