"""`plant:`, one of four kinds: polynomials in q^-1, a transfer matrix in s, states, a linear regression."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, ModelWrapValidatorHandler, PrivateAttr, model_validator

from inputdesign_cli.expressions import Expression
from inputdesign_cli.specification.models import fields, named, transfer
from inputdesign_cli.specification.models.continuous import Continuous
from inputdesign_cli.specification.models.section import (
    PathDiagnostic,
    Section,
    Wording,
    carry,
    optional,
    pick,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.yaml.plain import Plain


class NamedPlant(Section):
    """A plant whose coefficients may be expressions in named parameters."""

    TAKE_EXPRESSIONS: ClassVar[tuple[str, ...]] = ()

    parameters: Annotated[Mapping[str, fields.Number], SIZES["plant.parameters"]] | None = Field(
        default=None,
        min_length=1,
        description="Named parameters and their values; coefficients may be expressions in them.",
        examples=[{"K": 2.1, "T": 180}],
    )
    known: fields.Names | None = optional("Names of parameters that are not estimated.", examples=[["b1"]])

    _written: dict[str, Plain] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _checked(cls, data: Plain, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Validate the values of the expressions, keep the section as it was written, and check both."""
        if not isinstance(data, dict):
            return handler(data)
        numbers = dict(data)
        if isinstance(data.get("parameters"), dict):
            values = named.values_of(data["parameters"])
            if len(values) > SIZES["plant.parameters"].most:
                return handler(numbers)
            found = list(named.check_names(values))
            stated = [key for key in cls.TAKE_EXPRESSIONS if key in data]
            used: set[str] = set()
            numbers |= {key: named.worth(data[key], values, (key,), found, used) for key in stated}
            for name in () if found else [name for name in values if name not in used]:
                message, path = f"nothing depends on the parameter {name}", ("parameters", name)
                hint = "write it into a coefficient, or remove it"
                found.append(PathDiagnostic("unused-parameter", message, hint, path, at_key=True))
            if found:
                raise carry(*found)
        made = handler(numbers)
        made._written = dict(data)
        if wrong := tuple(made.check()):
            raise carry(*wrong)
        return made

    @property
    def written(self) -> dict[str, Plain]:
        """Return the section as it was written, with its expressions."""
        return self._written

    @property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of outputs and inputs."""
        raise NotImplementedError

    def expression(self, letter: str, row: int, column: int, power: int = 0) -> Expression:
        """Return a parameter of the model as an expression in the named parameters."""
        raise NotImplementedError

    @cached_property
    def outputs(self) -> int:
        """Return the number of outputs."""
        return self.shape[0]

    @cached_property
    def inputs(self) -> int:
        """Return the number of inputs."""
        return self.shape[1]

    @property
    def named_parameters(self) -> tuple[named.NamedParameter, ...]:
        """Return the named parameters; empty if the coefficients are the parameters."""
        stated = self.parameters or {}
        return tuple(named.NamedParameter(k, k, value, ("parameters", k)) for k, value in stated.items())


_Row = Annotated[fields.Several[fields.Number], SIZES["states"]]
Rows = Annotated[
    fields.Several[_Row],
    SIZES["states"],
    fields.nested(2, "a matrix", "write rows: [[0, 1], [0, -2]]"),
    AfterValidator(fields.same_columns),
    Wording("a matrix", "write rows: [[0, 1], [0, -2]]"),
    named.EXPRESSIONS,
]
"""A matrix of numbers and expressions."""


class StateSpace(Section):
    """dx/dt = A x + B u(t - delay), y = C x + D u(t - delay); or x(t + 1) = .. with `time: discrete`.

    With K the noise enters the states: x(t + 1) = A x + B u + K e, y = C x + D u + e, in samples.
    """

    A: Rows = Field(description="States by states.", examples=[[[0, 1], [0, "-1/T"]]])
    B: Rows = Field(description="States by inputs.", examples=[[[0], ["k/T"]]])
    C: Rows = Field(description="Outputs by states.", examples=[[[1, 0]]])
    D: Rows | None = optional("Outputs by inputs (default 0).")
    K: Rows | None = optional(
        "Gain of the one-step predictor of the sampled model, states by outputs (default 0)."
    )
    delay: Annotated[fields.NonNegative, named.EXPRESSIONS] = Field(
        default=0.0, description="Dead time of the inputs, in time_unit; in continuous time."
    )
    time: Literal["continuous", "discrete"] = Field(
        default="continuous", description="Whether A and B give derivatives of the states or next samples."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the matrices fit each other."""
        n, r, p = len(self.A), len(self.B[0]), len(self.C)
        sizes: tuple[tuple[str, fields.Matrix | None, tuple[int, int], str], ...] = (
            ("A", self.A, (n, n), "states by states"),
            ("B", self.B, (n, r), "states by inputs"),
            ("C", self.C, (p, n), "outputs by states"),
            ("D", self.D, (p, r), "outputs by inputs"),
            ("K", self.K, (n, p), "states by outputs"),
        )
        for key, entries, wanted, words in sizes:
            if entries is not None and (found := (len(entries), len(entries[0]))) != wanted:
                message = f"{{key}} is {found[0]} x {found[1]}, and must be {wanted[0]} x {wanted[1]}"
                yield PathDiagnostic("wrong-shape", message, f"it has {words}", (key,))


class PolynomialPlant(NamedPlant, family="plant", phrase="a plant of polynomials A, B, F"):
    """A(q) y = B(q)/F(q) u + noise, coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["polynomial"]] = "polynomial"
    sampled: ClassVar[bool] = True
    TAKE_EXPRESSIONS: ClassVar[tuple[str, ...]] = ("A", "B", "F")
    ELSEWHERE: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("delay", "dead_time"),
        "the leading zeros of B are the delay: B: [0, 0, 0, 1] is one of three samples",
    )

    A: Annotated[fields.MonicPerOutput, named.EXPRESSIONS] = Field(
        default=(1.0,), description="Monic; common to all outputs or a list with one per output (default 1)."
    )
    B: Annotated[fields.GainMatrix, named.EXPRESSIONS] = Field(
        description="Leading zeros are the delay. MIMO: rows (outputs) of columns (inputs) of polynomials.",
        examples=[[0, 3.6]],
    )
    F: Annotated[fields.StableMatrix, named.EXPRESSIONS] | None = optional(
        "Monic, stable, shaped as B (default 1)."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that A and F have the shape of B, of which some coefficient is present."""
        yield from transfer.check_per_output(self.A, self.outputs, "A")
        if self.F is not None and fields.shape_words(self.F) != fields.shape_words(self.B):
            message = "{key} must have the shape of B: " + fields.shape_words(self.B)
            yield PathDiagnostic("wrong-shape", message, "write [1] where an entry has no poles", ("F",))
        yield from transfer.check_gain(fields.as_matrix(named.expressed(self.written["B"])), "B")

    @property
    def delays(self) -> tuple[tuple[int, ...], ...]:
        """Return the power of the first present coefficient of B, entry by entry; the length if none is."""
        rows = fields.as_matrix(named.expressed(self.written.get("B", self.B)))
        return tuple(tuple(named.leading(entry) for entry in row) for row in rows)

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of outputs and inputs."""
        return fields.size_of(self.B)

    def expression(self, letter: str, row: int, column: int, power: int = 0) -> Expression:
        """Return a coefficient of an entry of A, B or F as an expression in the named parameters."""
        written = named.expressed(self.written[letter.upper()])
        if letter == "a":
            return (written[row] if fields.depth(written) == 2 else written)[power]
        return fields.as_matrix(written)[row][column][power]

    @property
    def B_matrix(self) -> fields.PolynomialMatrix:  # noqa: N802 (the paper's symbol)
        """Return B as rows (outputs) of columns (inputs) of coefficients, also for one input and output."""
        return fields.as_matrix(self.B)

    @property
    def F_matrix(self) -> fields.PolynomialMatrix:  # noqa: N802 (likewise)
        """Return F as rows of columns of coefficients; absent polynomials are 1."""
        ones = tuple(tuple((1.0,) for _ in row) for row in self.B_matrix)
        return ones if self.F is None else fields.as_matrix(self.F)


class ContinuousPlant(NamedPlant, family="plant", phrase="a continuous-time plant"):
    """A continuous-time transfer matrix; without `sample` the design stays in continuous time."""

    kind: ClassVar[Literal["continuous"]] = "continuous"
    TAKE_EXPRESSIONS: ClassVar[tuple[str, ...]] = ("continuous",)

    continuous: Continuous = Field(
        description="Transfer matrix in s, rows are outputs; or gain, time constant and dead time."
    )
    sample: Literal["zoh"] | None = optional("zoh: a zero-order hold. Absent: continuous time.")

    @property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of outputs and inputs."""
        return fields.size_of(self.continuous.numerator_matrix)

    @property
    def sampled(self) -> bool:
        """Return whether the design runs in discrete time."""
        return self.sample is not None

    @property
    def named_parameters(self) -> tuple[named.NamedParameter, ...]:
        """Return the stated parameters, or the quantities of a process model."""
        if self.parameters is None and self.continuous.kind == "process":
            return self.continuous.own_parameters()
        return super().named_parameters

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that some coefficient of a numerator is present, and that every entry is proper."""
        path = ("continuous", "gain" if self.continuous.kind == "process" else "numerator")
        yield from transfer.check_gain(self.terms.numerator, *path)
        if self.continuous.kind == "rational":
            below, levels = self.continuous.denominator_matrix, fields.depth(self.continuous.numerator)
            yield from transfer.check_proper(self.terms.numerator, below, levels, *path)

    def expression(self, letter: str, row: int, column: int, power: int = 0) -> Expression:
        """Return a coefficient of an entry, monic below, or its dead time, in the named parameters."""
        if letter == "delay":
            return self.terms.delay[row][column]
        below = self.terms.denominator[row][column]
        entry = self.terms.numerator[row][column] if letter == "b" else below
        return entry[-1 - power] / below[0]

    @cached_property
    def terms(self) -> named.CoefficientTerms:
        """Return the coefficients as expressions in named parameters, or in quantities of a process."""
        if self.parameters is None and self.continuous.kind == "process":
            return self.continuous.terms(self.continuous.own_words())
        return self.continuous.terms(self.written["continuous"])


class StateSpacePlant(NamedPlant, family="plant", phrase="a state-space plant"):
    """Matrices of numbers and expressions in named parameters."""

    kind: ClassVar[Literal["state_space"]] = "state_space"
    sampled: ClassVar[bool] = True
    TAKE_EXPRESSIONS: ClassVar[tuple[str, ...]] = ("state_space",)

    state_space: StateSpace = Field(description="A, B, C, D, and K of the noise.")
    sample: Literal["zoh"] | None = optional("zoh: matrices in continuous time are sampled.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that some parameter is named, and that sampling and dead time go with `time`."""
        if self.parameters is None:
            message = "{key} needs parameters: numbers in its matrices are not estimated"
            hint = "write parameters: {k: 2.0}, and k in the matrices"
            yield PathDiagnostic("missing-key", message, hint, keys=("parameters",))
        continuous = self.state_space.time == "continuous"
        if continuous and self.sample is None:
            message = "{key} in continuous time must say how it is sampled"
            yield PathDiagnostic("missing-key", message, "add sample: zoh", keys=("sample",))
        elif not continuous and self.sample is not None:
            message = "{key} is for matrices in continuous time, and time is discrete here"
            yield PathDiagnostic("unsuitable-key", message, "remove it", ("sample",), at_key=True)
        if not continuous and self.expression("delay", 0, 0).present:
            message = "{key} is in continuous time, but time is discrete here"
            path = ("state_space", "delay")
            yield PathDiagnostic("unsuitable-key", message, "write the delay as states", path)

    @property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of outputs and inputs."""
        return len(self.state_space.C), len(self.state_space.B[0])

    def expression(self, letter: str, row: int, column: int, power: int = 0) -> Expression:
        """Return an entry of a matrix, or the dead time, as an expression in the named parameters."""
        written = self.written["state_space"]
        value = written.get("delay", 0.0) if letter == "delay" else written[letter][row][column]
        return named.expressed(value)


class RegressionSize(Section):
    """The numbers of regressors."""

    estimated: Annotated[fields.Count, SIZES["plant.regression"]] = Field(
        description="How many regressors the model has."
    )
    neglected: Annotated[fields.Index, SIZES["plant.regression"]] = Field(
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
        """Return the number of regressors: every regressor counts as an input."""
        return self.regression.estimated + self.regression.neglected


class TrueParameters(Section, family="plant", phrase="a list of true parameters"):
    """The true parameters of a regression: the estimated ones, then the neglected ones."""

    kind: ClassVar[Literal["parameters"]] = "parameters"

    parameters: fields.Numbers = Field(description="True values of all parameters, estimated ones first.")


_FORMS = Wording(
    "a mapping of keys",
    "write {B: [0, 1], F: [1, -0.5]}, {continuous: ..}, {state_space: ..} or {regression: ..}",
)


def _kind(value: dict[str, object]) -> str:
    if "regression" in value:
        return RegressionPlant.phrase
    if "state_space" in value:
        return StateSpacePlant.phrase
    return (ContinuousPlant if "continuous" in value else PolynomialPlant).phrase


Plant = Annotated[PolynomialPlant | ContinuousPlant | StateSpacePlant | RegressionPlant, pick(_kind), _FORMS]
"""The nominal plant."""

TruePlant = Annotated[
    PolynomialPlant | ContinuousPlant | StateSpacePlant | RegressionPlant | TrueParameters,
    pick(lambda v: TrueParameters.phrase if set(v) == {"parameters"} else _kind(v)),
    _FORMS,
]
"""The plant of a simulation; for a regression it may be the parameters alone."""
