"""The one comparator of results with golden values, shared by `idesign check` and the tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import inputdesign_cli
from inputdesign_cli.errors import IdesignError, InaccurateError, InfeasibleError
from inputdesign_cli.runs.golden_file import Golden, GoldenRun, Quantity, load_golden

__all__ = ["Golden", "GoldenRun", "Quantity", "Row", "compare", "execute", "load_golden"]

Result = Mapping[str, Any]


@dataclass(frozen=True)
class Row:
    """One line of the comparison; `computed` is None where there is no such number, and `note` says why."""

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
        return self.deviation is not None and abs(self.deviation) <= self.quantity.tolerance

    def as_dict(self) -> dict[str, Any]:
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


def execute(golden: Golden, run: GoldenRun) -> Result | IdesignError:
    """The result of one run of a golden file, or the error that stands for it if there is no design.

    Raises
    ------
    SpecError, DataError
        The spec that the golden file names is not good: nothing can be compared.
    """
    spec = inputdesign_cli.load_spec(golden.spec_of(run), list(run.overrides))
    try:
        result: Result = getattr(inputdesign_cli, run.command)(spec).result
    except (InfeasibleError, InaccurateError) as error:
        return error
    return result


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
    value: Any = result
    for step in quantity.steps:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            return None, f"the result has no {quantity.path}"
    try:
        return float(value), ""
    except (TypeError, ValueError):
        return None, f"{quantity.path} is not a number"
