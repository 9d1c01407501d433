"""`plant.continuous:` by gain, time constant and dead time, or as a transfer matrix in s with dead times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from inputdesign_cli.expressions import Expression, product_of
from inputdesign_cli.specification.models import fields, named, transfer
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.yaml.plain import Plain

QUANTITIES = ("gain", "time_constant", "damping", "natural_frequency", "dead_time")
Grid = tuple[tuple[float, ...], ...]


class ProcessModel(Section, family="continuous", phrase="a process model"):
    """gain e^(-dead_time s) / (time_constant s + 1), or of second order by damping and natural_frequency.

    Each is a number, or with several channels rows (outputs) of columns (inputs) of numbers.
    """

    kind: ClassVar[Literal["process"]] = "process"
    # Every entry has a denominator and a dead time of its own.
    common: ClassVar[bool] = False
    common_delay: ClassVar[bool] = False

    gain: Annotated[fields.NumberGrid, named.EXPRESSIONS] = Field(description="Static gain.", examples=[2.1])
    time_constant: Annotated[fields.PositiveGrid, named.EXPRESSIONS] | None = optional(
        "Time constant, in time_unit, of a plant of first order."
    )
    damping: Annotated[fields.PositiveGrid, named.EXPRESSIONS] | None = optional("Damping (second order).")
    natural_frequency: Annotated[fields.PositiveGrid, named.EXPRESSIONS] | None = optional(
        "Undamped natural frequency of a plant of second order, rad per time_unit."
    )
    dead_time: Annotated[fields.NonNegativeGrid, named.EXPRESSIONS] | None = optional(
        "Dead time, in time_unit; 0 where there is none."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the model is of first or second order and all quantities have the shape of the gain."""
        second = ("damping", "natural_frequency")
        missing = tuple(key for key in second if not self.stated(key))
        if missing and not self.stated("time_constant"):
            message = "{key} needs time_constant, or damping and natural_frequency"
            yield PathDiagnostic("missing-key", message, f"add {missing[0]}", keys=missing)
        for key in second:
            yield from self.choose(("time_constant", key))
        size = [len(row) for row in self.grid("gain")]
        for name in self.stated(*QUANTITIES):
            if [len(row) for row in self.grid(name)] != size or len(set(size)) > 1:
                hint = "write one number, or rows (outputs) of columns (inputs), for all of them alike"
                yield PathDiagnostic("wrong-shape", "{key} must have the shape of the gain", hint, (name,))

    def grid(self, name: str) -> Grid:
        """Return a quantity as rows of columns; a dead time that is not stated is zero."""
        value = self.at(name)
        if value is None:
            return tuple(tuple(0.0 for _ in row) for row in self.grid("gain"))
        return value if isinstance(value, tuple) else ((float(str(value)),),)

    @property
    def numerator_matrix(self) -> fields.PolynomialMatrix:
        """Return the numerators as rows of columns, descending in s."""
        return _values(self.terms({name: self.grid(name) for name in QUANTITIES}).numerator)

    @property
    def denominator_matrix(self) -> fields.PolynomialMatrix:
        """Return the denominators as rows of columns, descending in s."""
        return _values(self.terms({name: self.grid(name) for name in QUANTITIES}).denominator)

    @property
    def delays(self) -> Grid:
        """Return dead times as rows of columns; 0 where there is none."""
        return self.grid("dead_time")

    def own_parameters(self) -> tuple[named.NamedParameter, ...]:
        """Return the quantities, entry by entry, without entries of gain zero and dead times of zero."""
        single = fields.depth(self.gain) == 0
        found = []
        for name in self.stated(*QUANTITIES):
            for (i, j), value in np.ndenumerate(self.grid(name)):
                if self.grid("gain")[i][j] == 0.0 or (name == "dead_time" and value == 0.0):
                    continue
                label = name if single else f"{name}[{i + 1},{j + 1}]"
                place = ("continuous", name) if single else ("continuous", name, i, j)
                found.append(named.NamedParameter(label, f"{name}_{i + 1}_{j + 1}", float(value), place))
        return tuple(found)

    def own_words(self) -> dict[str, Plain]:
        """Return the quantities as written with a symbol in place of each number that is not zero."""
        return {
            name: [
                [f"{name}_{i + 1}_{j + 1}" if value else value for j, value in enumerate(row)]
                for i, row in enumerate(self.grid(name))
            ]
            for name in self.stated(*QUANTITIES)
        }

    def terms(self, written: Mapping[str, Plain]) -> named.CoefficientTerms:
        """Return the coefficients, descending in s, as expressions in the quantities as written."""
        one, two, none = (Expression(number) for number in ("1.0", "2.0", "0.0"))

        def of(name: str, i: int, j: int) -> Expression:
            value = written[name] if self.stated(name) else 0.0
            return named.expressed(value[i][j] if isinstance(value, list | tuple) else value)

        def entry(i: int, j: int) -> tuple[named.Terms, named.Terms, Expression]:
            gain, delay = of("gain", i, j), of("dead_time", i, j)
            if self.time_constant is not None:
                return (gain,), (of("time_constant", i, j), one), delay
            damping, w = of("damping", i, j), of("natural_frequency", i, j)
            return (gain * (w * w) if gain.present else none,), (one, two * damping * w, w * w), delay

        rows = [[entry(i, j) for j in range(len(row))] for i, row in enumerate(self.grid("gain"))]
        return named.CoefficientTerms(
            tuple(tuple(above for above, _, _ in row) for row in rows),
            tuple(tuple(below for _, below, _ in row) for row in rows),
            tuple(tuple(delay for _, _, delay in row) for row in rows),
        )


def _values(rows: named.TermMatrix) -> fields.PolynomialMatrix:
    return tuple(tuple(tuple(one.at((), np.zeros(0))[0] for one in entry) for entry in row) for row in rows)


class DelayedMatrix(transfer.TransferMatrix, family="continuous", phrase="a transfer matrix in s"):
    """A transfer matrix in s of a plant, with dead times and integrators."""

    kind: ClassVar[Literal["rational"]] = "rational"

    numerator: Annotated[fields.GainMatrix, named.EXPRESSIONS] = Field(
        description="Coefficients; a matrix is rows (outputs) of columns (inputs)."
    )
    denominator: Annotated[fields.ContinuousDenominator, named.EXPRESSIONS] = Field(
        description="One polynomial for all entries, a list of its factors, or one polynomial per entry."
    )
    delay: Annotated[fields.NonNegativeGrid, named.EXPRESSIONS] | None = optional(
        "Dead time in time_unit: a number, common to all entries, or rows of columns.", examples=[25]
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the shapes agree and that poles lie in the left half plane or at zero."""
        yield from transfer.check_shapes(self.numerator, self.denominator)
        yield from transfer.check_each(self.denominator, fields.check_no_growth_in_s, "denominator")
        sizes = [len(row) for row in self.delay] if isinstance(self.delay, tuple) else None
        if sizes is not None and sizes != [len(row) for row in self.numerator_matrix]:
            message = "{key} must have a dead time for each entry: rows (outputs) of columns (inputs)"
            yield PathDiagnostic("wrong-shape", message, "write 0 where there is none", ("delay",))

    @property
    def common(self) -> bool:
        """Return whether all entries share one denominator."""
        return fields.depth(self.denominator) != 3

    @property
    def common_delay(self) -> bool:
        """Return whether all entries share one dead time."""
        return not isinstance(self.delay, tuple)

    @property
    def delays(self) -> tuple[tuple[float, ...], ...]:
        """Return dead times as rows of columns; 0 where there is none."""
        if isinstance(self.delay, tuple):
            return self.delay
        return tuple(tuple(self.delay or 0.0 for _ in row) for row in self.numerator_matrix)

    def terms(self, written: Mapping[str, Plain]) -> named.CoefficientTerms:
        """Return the coefficients as expressions, from the section as it was written."""
        above, below, delay = (
            named.expressed(written.get(key, 0.0)) for key in ("numerator", "denominator", "delay")
        )
        rows = fields.as_matrix(above)
        denominators: named.TermMatrix
        if fields.depth(below) == 3:
            denominators = fields.as_matrix(below)
        else:
            common = product_of(below if fields.depth(below) == 2 else [below])
            denominators = tuple(tuple(common for _ in row) for row in rows)
        delays = delay if isinstance(delay, tuple) else tuple(tuple(delay for _ in row) for row in rows)
        return named.CoefficientTerms(rows, denominators, delays)


Continuous = Annotated[
    DelayedMatrix | ProcessModel,
    pick(
        lambda v: (DelayedMatrix if v.keys().isdisjoint(ProcessModel.model_fields) else ProcessModel).phrase
    ),
    Wording(
        "a mapping of keys", "write {numerator: [..], denominator: [..]}, or {gain: .., time_constant: ..}"
    ),
]
"""The transfer matrix in s, in one of two forms."""
