"""The one comparator of results with golden values, shared by `idesign check` and the tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome.golden_file import Golden, Quantity
from inputdesign_cli.outcome.results import Json, Result


@dataclass(frozen=True)
class Row:
    """One line of the comparison; without a `computed` number, `note` says why it is None."""

    golden: str
    run: str
    quantity: Quantity
    computed: float | None
    note: str = ""

    @property
    def deviation(self) -> float | None:
        """Computed minus expected."""
        return None if self.computed is None else self.computed - self.quantity.expected

    @property
    def passed(self) -> bool:
        """Whether it was computed and lies within its tolerance."""
        return self.deviation is not None and abs(self.deviation) <= self.quantity.tolerance

    def as_dict(self) -> dict[str, Json]:
        """The row in JSON's types."""
        return {
            "golden": self.golden,
            "run": self.run,
            "quantity": self.quantity.name,
            "path": self.quantity.path,
            "computed": self.computed,
            "expected": self.quantity.expected,
            "deviation": self.deviation,
            "tolerance": self.quantity.tolerance,
            "why": self.quantity.why,
            "source": self.quantity.source,
            "passed": self.passed,
            "note": self.note,
        }


def compare(golden: Golden, results: Mapping[str, Result | IdesignError]) -> list[Row]:
    """One row a quantity; `results` goes by the names of the runs. A run without a result fails its rows."""
    rows = []
    for run in golden.runs:
        result = results.get(run.name)
        for quantity in run.quantities:
            computed, note = _look_up(result, quantity)
            rows.append(Row(golden.file.stem, run.name, quantity, computed, note))
    return rows


def _look_up(result: Result | IdesignError | None, quantity: Quantity) -> tuple[float | None, str]:
    if result is None:
        return None, "the run has no result"
    if isinstance(result, IdesignError):
        return None, str(result)
    value: Json = result
    for step in quantity.steps:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            return None, f"the result has no {quantity.path}"
    try:
        return float(value), ""
    except (TypeError, ValueError):
        return None, f"{quantity.path} is not a number"
