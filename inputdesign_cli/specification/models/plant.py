"""`plant:`, one of three kinds: polynomials in q^-1, a transfer matrix in s, a linear regression."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import (
    Count,
    GainMatrix,
    Index,
    MonicPerOutput,
    Numbers,
    StableMatrix,
)
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.section import Section, pick
from inputdesign_cli.specification.models.shapes import (
    as_matrix,
    check_gain,
    check_per_output,
    shape_words,
    size_of,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.transfer import ContinuousMatrix
from inputdesign_cli.specification.models.values import PolynomialMatrix, depth


class PolynomialPlant(Section, family="plant", phrase="a plant of polynomials A, B, F"):
    """A(q) y = B(q)/F(q) u + noise, coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["polynomial"]] = "polynomial"
    sampled: ClassVar[bool] = True

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

    def check(self) -> Iterator[PathDiagnostic]:
        """B is not zero, and A and F have its shape."""
        yield from check_gain(self.B_matrix, "B")
        yield from check_per_output(self.A, self.outputs, "A")
        if self.F is not None and (depth(self.F) != depth(self.B) or size_of(self.F) != size_of(self.B)):
            yield PathDiagnostic(
                "wrong-shape",
                "{key} must have the shape of B: " + shape_words(self.B),
                "write [1] where an entry has no poles",
                ("F",),
            )

    @property
    def outputs(self) -> int:
        """The number of outputs."""
        return len(self.B_matrix)

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return len(self.B_matrix[0])

    @property
    def B_matrix(self) -> PolynomialMatrix:  # noqa: N802 (the paper's symbol)
        """B as rows (outputs) of columns (inputs) of coefficients, also for one input and output."""
        return as_matrix(self.B)

    @property
    def F_matrix(self) -> PolynomialMatrix:  # noqa: N802
        """F in the same form; absent polynomials are 1."""
        ones = tuple(tuple((1.0,) for _ in row) for row in self.B_matrix)
        return ones if self.F is None else as_matrix(self.F)


class ContinuousPlant(Section, family="plant", phrase="a continuous-time plant"):
    """A continuous-time transfer matrix; without `sample` the design stays in continuous time."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

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

    estimated: Annotated[Count, SIZES["plant.regression"]] = Field(
        description="How many regressors the model has."
    )
    neglected: Annotated[Index, SIZES["plant.regression"]] = Field(
        default=0, description="How many regressors act on the output but are not modelled."
    )


class RegressionPlant(Section, family="plant", phrase="a regression"):
    """A linear regression of which some regressors are neglected."""

    kind: ClassVar[Literal["regression"]] = "regression"
    sampled: ClassVar[bool] = True
    outputs: ClassVar[int] = 1

    regression: RegressionSize = Field(description="The numbers of estimated and neglected regressors.")

    @property
    def inputs(self) -> int:
        """Every regressor counts as an input."""
        return self.regression.estimated + self.regression.neglected


class TrueParameters(Section, family="plant", phrase="a list of true parameters"):
    """The true parameters of a regression: the estimated ones, then the neglected ones."""

    kind: ClassVar[Literal["parameters"]] = "parameters"

    parameters: Numbers = Field(description="True values of all regression parameters, estimated ones first.")


_FORMS = Wording("a mapping of keys", "write {B: [0, 1], F: [1, -0.5]}, {continuous: ..} or {regression: ..}")


def _kind(value: dict[str, object]) -> str:
    if "regression" in value:
        return RegressionPlant.phrase
    return (ContinuousPlant if "continuous" in value else PolynomialPlant).phrase


Plant = Annotated[PolynomialPlant | ContinuousPlant | RegressionPlant, pick(_kind), _FORMS]
"""The nominal plant."""

TruePlant = Annotated[
    PolynomialPlant | ContinuousPlant | RegressionPlant | TrueParameters,
    pick(lambda v: TrueParameters.phrase if "parameters" in v else _kind(v)),
    _FORMS,
]
"""The plant of a simulation; of a regression only its parameters."""
