"""`plant: {state_space: ..}`: matrices of numbers and expressions, in continuous time or of samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import NonNegative, Number, Several, nested
from inputdesign_cli.specification.models.named import EXPRESSIONS
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.units import TIME
from inputdesign_cli.specification.models.values import Matrix, same_columns

_Row = Annotated[Several[Number], SIZES["states"]]
Rows = Annotated[
    Several[_Row],
    SIZES["states"],
    nested(2, "a matrix", "write rows: [[0, 1], [0, -2]]"),
    AfterValidator(same_columns),
    Wording("a matrix", "write rows: [[0, 1], [0, -2]]"),
    EXPRESSIONS,
]
"""A matrix of numbers and expressions."""


class StateSpace(Section):
    """dx/dt = A x + B u(t - delay), y = C x + D u(t - delay); or x(t + 1) = .. with `time: discrete`.

    With K the noise enters the states: x(t + 1) = A x + B u + K e, y = C x + D u + e, in samples.
    """

    A: Rows = Field(description="States by states.", examples=[[[0, 1], [0, "-1/T"]]])
    B: Rows = Field(description="States by inputs.", examples=[[[0], ["k/T"]]])
    C: Rows = Field(description="Outputs by states.", examples=[[[1, 0]]])
    D: Rows | None = Field(default=None, description="Outputs by inputs (default 0).")
    K: Rows | None = Field(
        default=None,
        description="Gain of the one-step predictor, states by outputs, of the sampled model (default 0: the "
        "noise is added to the outputs).",
    )
    delay: Annotated[NonNegative, EXPRESSIONS, TIME] = Field(
        default=0.0, description="Dead time of the inputs, in time_unit; in continuous time."
    )
    time: Literal["continuous", "discrete"] = Field(
        default="continuous", description="Whether A and B are those of derivatives, or of samples."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """The matrices fit each other."""
        n, r, p = len(self.A), len(self.B[0]), len(self.C)
        sizes: tuple[tuple[str, Matrix | None, int, int, str], ...] = (
            ("A", self.A, n, n, "states by states"),
            ("B", self.B, n, r, "states by inputs"),
            ("C", self.C, p, n, "outputs by states"),
            ("D", self.D, p, r, "outputs by inputs"),
            ("K", self.K, n, p, "states by outputs"),
        )
        for key, matrix, rows, columns, words in sizes:
            if matrix is not None and (len(matrix), len(matrix[0])) != (rows, columns):
                message = f"{{key}} is {len(matrix)} x {len(matrix[0])}, and must be {rows} x {columns}"
                yield PathDiagnostic("wrong-shape", message, f"it has {words}", (key,))
