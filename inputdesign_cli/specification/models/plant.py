"""`plant:`, one of three kinds: polynomials in q^-1, a transfer matrix in s, a linear regression."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, model_validator

from inputdesign_cli.specification.models.fields import (
    ContinuousDenominator,
    Count,
    GainMatrix,
    Index,
    MonicPerOutput,
    Numbers,
    StableMatrix,
)
from inputdesign_cli.specification.models.findings import Findings
from inputdesign_cli.specification.models.polynomials import Polynomial, check_left_half_plane, product
from inputdesign_cli.specification.models.section import Section, needs_mapping, picker, tag
from inputdesign_cli.specification.models.transfer import check_proper
from inputdesign_cli.specification.models.values import PolynomialMatrix, depth

_POLYNOMIALS = "a plant of polynomials A, B, F"
_CONTINUOUS = "a continuous-time plant"
_REGRESSION = "a regression"
_PARAMETERS = "a list of true parameters"


class PolynomialPlant(Section, family="plant", phrase=_POLYNOMIALS):
    """A(q) y = B(q)/F(q) u + noise, coefficients in ascending powers of q^-1."""

    A: MonicPerOutput = Field(
        default=(1.0,), description="Monic; common to all outputs or a list with one per output (default 1)."
    )
    B: GainMatrix = Field(
        description="Leading zeros are the delay. MIMO: rows (outputs) of columns (inputs) of polynomials.",
        examples=[[0, 3.6]],
    )
    F: StableMatrix | None = Field(
        default=None, description="Monic and stable, in the shape of B (default 1)."
    )

    @model_validator(mode="after")
    def _shapes(self) -> PolynomialPlant:
        findings = Findings()
        _check_gain(findings, self.B_matrix, "B")
        if depth(self.A) == 2 and len(self.A) != self.outputs:
            findings.add(
                "wrong-shape",
                f"{{key}} holds {len(self.A)} polynomials for {_outputs(self.outputs)}",
                "write one polynomial for all outputs, or a list with one per output",
                "A",
            )
        if self.F is not None and (depth(self.F) != depth(self.B) or _size(self.F) != _size(self.B)):
            findings.add(
                "wrong-shape",
                "{key} must have the shape of B: " + _shape_words(self.B),
                "write [1] where an entry has no poles",
                "F",
            )
        findings.stop()
        return self

    @property
    def outputs(self) -> int:
        """The number of outputs."""
        return len(self.B_matrix)

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return len(self.B_matrix[0])

    @property
    def sampled(self) -> bool:
        """Whether the design runs in discrete time."""
        return True

    @property
    def B_matrix(self) -> PolynomialMatrix:  # noqa: N802 (the paper's symbol)
        """B as rows (outputs) of columns (inputs) of coefficients, also for one input and output."""
        return as_matrix(self.B)

    @property
    def F_matrix(self) -> PolynomialMatrix:  # noqa: N802
        """F in the same form; absent polynomials are 1."""
        if self.F is None:
            return tuple(tuple((1.0,) for _ in row) for row in self.B_matrix)
        return as_matrix(self.F)

    @property
    def A_per_output(self) -> tuple[Polynomial, ...]:  # noqa: N802
        """One polynomial A for each output."""
        return per_output(self.A, self.outputs)


class ContinuousMatrix(Section):
    """A transfer matrix in s, coefficients in descending powers."""

    numerator: GainMatrix = Field(description="Coefficients; a matrix is rows (outputs) of columns (inputs).")
    denominator: ContinuousDenominator = Field(
        description="One polynomial for all entries, a list of its factors, or one polynomial per entry."
    )

    @model_validator(mode="after")
    def _shapes(self) -> ContinuousMatrix:
        findings = Findings()
        numerators = as_matrix(self.numerator)
        check_shapes(findings, self.numerator, self.denominator)
        for path, factor in with_paths(self.denominator):
            if finding := check_left_half_plane(factor):
                findings.add(finding.code, finding.message, finding.hint, "denominator", *path)
        for i, row in enumerate(numerators):
            for j, entry in enumerate(row):
                where = (i, j) if depth(self.numerator) == 3 else ()
                check_proper(findings, entry, self.denominator_matrix[i][j], "numerator", *where)
        findings.stop()
        return self

    @property
    def numerator_matrix(self) -> PolynomialMatrix:
        """The numerators as rows (outputs) of columns (inputs)."""
        return as_matrix(self.numerator)

    @property
    def denominator_matrix(self) -> PolynomialMatrix:
        """The denominators in the same form, factors multiplied out."""
        return denominators_of(self.numerator, self.denominator)


class ContinuousPlant(Section, family="plant", phrase=_CONTINUOUS):
    """A continuous-time transfer matrix; without `sample` the design stays in continuous time."""

    continuous: ContinuousMatrix = Field(description="Transfer matrix in s; rows are outputs.")
    sample: Literal["zoh"] | None = Field(
        default=None,
        description="zoh: sampled at sample_time with a zero-order hold. Absent: continuous time.",
    )

    @property
    def outputs(self) -> int:
        """The number of outputs."""
        return len(self.continuous.numerator_matrix)

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return len(self.continuous.numerator_matrix[0])

    @property
    def sampled(self) -> bool:
        """Whether the design runs in discrete time."""
        return self.sample is not None


class RegressionSize(Section):
    """The numbers of regressors."""

    estimated: Count = Field(description="How many regressors the model has.")
    neglected: Index = Field(
        default=0, description="How many regressors act on the output but are not modelled."
    )


class RegressionPlant(Section, family="plant", phrase=_REGRESSION):
    """A linear regression of which some regressors are neglected."""

    regression: RegressionSize = Field(description="The numbers of estimated and neglected regressors.")

    @property
    def outputs(self) -> int:
        """A regression has one output."""
        return 1

    @property
    def inputs(self) -> int:
        """Every regressor counts as an input."""
        return self.regression.estimated + self.regression.neglected

    @property
    def sampled(self) -> bool:
        """A regression is a sequence of samples."""
        return True


class TrueParameters(Section, family="plant", phrase=_PARAMETERS):
    """The true parameters of a regression: the estimated ones, then the neglected ones."""

    parameters: Numbers = Field(description="True values of all regression parameters, estimated ones first.")


_EXAMPLE = "{B: [0, 1], F: [1, -0.5]}, {continuous: ..} or {regression: ..}"
_Polynomials = Annotated[PolynomialPlant, tag(_POLYNOMIALS)]
_Continuous = Annotated[ContinuousPlant, tag(_CONTINUOUS)]
_Regression = Annotated[RegressionPlant, tag(_REGRESSION)]


def _kind(value: dict[str, object]) -> str:
    return _REGRESSION if "regression" in value else _CONTINUOUS if "continuous" in value else _POLYNOMIALS


Plant = Annotated[
    _Polynomials | _Continuous | _Regression, Discriminator(picker(_kind)), needs_mapping(_EXAMPLE)
]
"""The nominal plant."""

TruePlant = Annotated[
    _Polynomials | _Continuous | _Regression | Annotated[TrueParameters, tag(_PARAMETERS)],
    Discriminator(picker(lambda v: _PARAMETERS if "parameters" in v else _kind(v))),
    needs_mapping(_EXAMPLE),
]
"""The plant of a simulation; of a regression only its parameters."""


def as_matrix(value: tuple) -> PolynomialMatrix:
    """One polynomial as a 1 x 1 matrix; a matrix as it is."""
    return value if depth(value) == 3 else ((value,),)


def per_output(value: tuple, outputs: int) -> tuple[Polynomial, ...]:
    """One polynomial repeated for every output; a list as it is."""
    return value if depth(value) == 2 else (value,) * outputs


def check_shapes(findings: Findings, numerator: tuple, denominator: tuple) -> None:
    """The numerator is not zero, and denominators for each entry have its shape; stops if not."""
    _check_gain(findings, as_matrix(numerator), "numerator")
    if depth(denominator) == 3 and _size(denominator) != _size(as_matrix(numerator)):
        findings.add(
            "wrong-shape",
            "{key} must have the shape of the numerator: " + _shape_words(numerator),
            "or write one polynomial, a denominator common to all entries",
            "denominator",
        )
        findings.stop()


def denominators_of(numerator: tuple, denominator: tuple) -> PolynomialMatrix:
    """Denominators as rows of columns, those that are common repeated and factors multiplied out."""
    if depth(denominator) == 3:
        return as_matrix(denominator)
    common = product(factor for _, factor in with_paths(denominator))
    return tuple(tuple(common for _ in row) for row in as_matrix(numerator))


def with_paths(value: tuple) -> list[tuple[tuple[int, ...], Polynomial]]:
    """Every polynomial of a nested value with the indices that lead to it."""
    if depth(value) == 1:
        return [((), value)]
    return [((i, *path), p) for i, part in enumerate(value) for path, p in with_paths(part)]


def _check_gain(findings: Findings, entries: PolynomialMatrix, name: str) -> None:
    if not any(any(p) for row in entries for p in row):
        findings.add(
            "zero-polynomial", "all coefficients of {key} are zero: the input has no effect", "", name
        )


def _size(value: tuple) -> tuple[int, int]:
    entries = as_matrix(value)
    return len(entries), len(entries[0])


def _shape_words(value: tuple) -> str:
    if depth(value) == 1:
        return "one list of coefficients"
    rows, columns = _size(value)
    return f"{rows} x {columns} lists of coefficients"


def _outputs(count: int) -> str:
    return "1 output" if count == 1 else f"{count} outputs"
