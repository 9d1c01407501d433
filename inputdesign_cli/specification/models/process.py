"""Plants in s by gain, time constant or damping and natural frequency, and dead time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from inputdesign_cli.expressions import Expression
from inputdesign_cli.specification.models.fields import NonNegativeGrid, NumberGrid, PositiveGrid
from inputdesign_cli.specification.models.named import (
    EXPRESSIONS,
    CoefficientTerms,
    NamedParameter,
    Terms,
    expressed,
)
from inputdesign_cli.specification.models.section import PathDiagnostic, Section
from inputdesign_cli.specification.models.units import FREQUENCY, TIME
from inputdesign_cli.specification.models.values import PolynomialMatrix, depth
from inputdesign_cli.specification.yaml.plain import Plain

QUANTITIES = ("gain", "time_constant", "damping", "natural_frequency", "dead_time")
Grid = tuple[tuple[float, ...], ...]


class ProcessModel(Section, family="continuous", phrase="a process model"):
    """gain e^(-dead_time s) / (time_constant s + 1), or of second order by damping and natural_frequency.

    Each is a number, or with several channels rows (outputs) of columns (inputs) of numbers.
    """

    kind: ClassVar[Literal["process"]] = "process"

    gain: Annotated[NumberGrid, EXPRESSIONS] = Field(description="Static gain.", examples=[2.1])
    time_constant: Annotated[PositiveGrid, EXPRESSIONS, TIME] | None = Field(
        default=None, description="Time constant, in time_unit, of a plant of first order."
    )
    damping: Annotated[PositiveGrid, EXPRESSIONS] | None = Field(
        default=None, description="Damping ratio of a plant of second order."
    )
    natural_frequency: Annotated[PositiveGrid, EXPRESSIONS, FREQUENCY] | None = Field(
        default=None, description="Undamped natural frequency of a plant of second order, rad per time_unit."
    )
    dead_time: Annotated[NonNegativeGrid, EXPRESSIONS, TIME] | None = Field(
        default=None, description="Dead time, in time_unit; 0 where there is none."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """It is of first or second order, and all quantities have the shape of the gain."""
        if not self.stated("damping"):
            yield from self.exactly_one("time_constant", "natural_frequency")
        for one, other in (("damping", "natural_frequency"), ("natural_frequency", "damping")):
            if self.stated(one) and not self.stated(other) and not self.stated("time_constant"):
                message = f'{{key}} of second order needs "{other}"'
                yield PathDiagnostic("missing-key", message, f"add {other}", keys=(other,))
        if self.stated("time_constant") and self.stated("damping"):
            yield from self.at_most_one("time_constant", "damping")
        size = [len(row) for row in self.grid("gain")]
        for name in self.stated(*QUANTITIES):
            if [len(row) for row in self.grid(name)] != size or len(set(size)) > 1:
                hint = "write one number, or rows (outputs) of columns (inputs), for all of them alike"
                yield PathDiagnostic("wrong-shape", "{key} must have the shape of the gain", hint, (name,))

    def check_present(self, terms: CoefficientTerms) -> Iterator[PathDiagnostic]:
        """Some gain is present."""
        if not any(one.present for row in terms.numerator for entry in row for one in entry):
            message = "{key} is zero: the input has no effect"
            yield PathDiagnostic("zero-polynomial", message, "", ("continuous", "gain"))

    def grid(self, name: str) -> Grid:
        """Return a quantity as rows of columns."""
        value = self.at(name)
        return value if isinstance(value, tuple) else ((float(str(value)),),)

    @property
    def numerator_matrix(self) -> PolynomialMatrix:
        """The numerators as rows of columns, descending in s."""
        return self._numbers(0)

    @property
    def denominator_matrix(self) -> PolynomialMatrix:
        """The denominators in the same form."""
        return self._numbers(1)

    @property
    def common(self) -> bool:
        """Every entry has a denominator of its own."""
        return False

    @property
    def delays(self) -> Grid:
        """Dead times as rows of columns; 0 where there is none."""
        if self.dead_time is None:
            return tuple(tuple(0.0 for _ in row) for row in self.grid("gain"))
        return self.grid("dead_time")

    @property
    def common_delay(self) -> bool:
        """Every entry has a dead time of its own."""
        return False

    def own_parameters(self) -> tuple[NamedParameter, ...]:
        """Return the quantities, entry by entry, without entries of gain zero and dead times of zero."""
        single = depth(self.gain) == 0
        found = []
        for name in self.stated(*QUANTITIES):
            for i, row in enumerate(self.grid(name)):
                for j, value in enumerate(row):
                    if self.grid("gain")[i][j] == 0.0 or (name == "dead_time" and value == 0.0):
                        continue
                    label = name if single else f"{name}[{i + 1},{j + 1}]"
                    place = ("continuous", name) if single else ("continuous", name, i, j)
                    found.append(NamedParameter(label, self._symbol(name, i, j), value, place))
        return tuple(found)

    def terms(self, written: Mapping[str, Plain] | None = None) -> CoefficientTerms:
        """Return the coefficients as expressions in its quantities.

        Args:
            written: the section as written, if its values are expressions in named parameters.
        """

        def of(name: str, i: int, j: int) -> Expression:
            if written is None:
                return Expression(self._symbol(name, i, j))
            value = written[name]
            return expressed(value[i][j] if isinstance(value, list | tuple) else value)

        def there(name: str, i: int, j: int) -> bool:
            if not self.stated(name):
                return False
            return self.grid(name)[i][j] != 0.0 if written is None else of(name, i, j).present

        none, above, below, delays = Expression("0.0"), [], [], []
        for i, row in enumerate(self.grid("gain")):
            columns = range(len(row))
            entries = [self._entry(of, i, j) for j in columns]
            above.append(tuple(entries[j][0] if there("gain", i, j) else (none,) for j in columns))
            below.append(tuple(bottom for _, bottom in entries))
            delays.append(tuple(of("dead_time", i, j) if there("dead_time", i, j) else none for j in columns))
        return CoefficientTerms(tuple(above), tuple(below), tuple(delays))

    def _entry(self, of: Callable[[str, int, int], Expression], i: int, j: int) -> tuple[Terms, Terms]:
        """Numerator and denominator of an entry, descending in s."""
        one, two = Expression("1.0"), Expression("2.0")
        if self.time_constant is not None:
            return (of("gain", i, j),), (of("time_constant", i, j), one)
        gain, damping, w = (of(name, i, j) for name in ("gain", "damping", "natural_frequency"))
        return (gain * (w * w),), (one, two * damping * w, w * w)

    def _numbers(self, part: int) -> PolynomialMatrix:
        """The numerators (0) or the denominators (1) at the values of the quantities."""

        def of(name: str, i: int, j: int) -> Expression:
            return Expression(repr(self.grid(name)[i][j]))

        return tuple(
            tuple(
                tuple(term.at((), np.zeros(0))[0] for term in self._entry(of, i, j)[part])
                for j in range(len(row))
            )
            for i, row in enumerate(self.grid("gain"))
        )

    @staticmethod
    def _symbol(name: str, i: int, j: int) -> str:
        return f"{name}_{i + 1}_{j + 1}"
