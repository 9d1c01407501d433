"""Golden files: their format, and how `idesign check` and the tests compare results with them.

A golden file holds runs, and each run the quantities to find in its result:

    title: First-order example
    runs:
      - name: white
        spec: ../specs/first_order.yaml      # relative to the golden file
        command: solve                       # the default; or analyse, simulate
        overrides: ["spectrum={type: white}"]   # as `--set` takes them
        quantities:
          - path: objective.value            # into result.json; list items as [0]
            label: input power               # the default is the path
            expected: 1.705495
            absolute: 1.0e-6                 # or relative: the largest deviation that passes
            why: two units of the last digit that the source gives
            source: independent solution
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ValidationError

from inputdesign_cli.errors import IdesignError, Location, SpecError
from inputdesign_cli.outcome.results import Result
from inputdesign_cli.specification.models.fields import FileName, Number, Positive, Several, Text
from inputdesign_cli.specification.models.pydantic_errors import translate
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, fail
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.places import parse_key
from inputdesign_cli.specification.yaml.reader import read

_OF_SPECS = {"plant", "noise", "experiment", "accuracy"}  # keys of a spec, not of a golden file
_PATH = re.compile(r"[^.\[\]\s]+(\[\d+\])*(\.[^.\[\]\s]+(\[\d+\])*)*")


def _result_path(path: str) -> str:
    if not _PATH.fullmatch(path):
        hint = "write objective.value or power.input[0]"
        raise fail("golden-path", f"{path!r} is no path into a result", hint)
    return path


class Quantity(Section):
    """Holds a number of a result: its place, the expected value, the tolerance and its reason."""

    path: Annotated[Text, AfterValidator(_result_path)]
    expected: Number
    absolute: Positive | None = None
    relative: Positive | None = None
    why: Text
    source: Text
    label: Text = ""

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that there is one tolerance, and that it is above 0."""
        if (self.absolute is None) == (self.relative is None):
            message, hint = "{key} needs one tolerance", "give either absolute or relative"
            yield PathDiagnostic("golden-tolerance", message, hint)
        elif self.absolute is None and self.expected == 0.0:
            message = "{key} of 0 is no tolerance"
            yield PathDiagnostic("golden-tolerance", message, "give absolute", ("relative",))

    @property
    def tolerance(self) -> float:
        """Return the largest deviation that passes, in the quantity's own unit."""
        return self.absolute if self.absolute is not None else (self.relative or 0.0) * abs(self.expected)

    @property
    def name(self) -> str:
        """Return the label, or the path in its place."""
        return self.label or self.path


class GoldenRun(Section):
    """Describes a run of a spec, with the numbers to check. `spec` is relative to the golden file."""

    name: Text
    spec: FileName
    command: Literal["solve", "analyse", "simulate"] = "solve"
    overrides: tuple[Text, ...] = ()
    quantities: Several[Quantity]


class _Content(Section):
    title: Text = ""
    runs: Several[GoldenRun]

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the names of the runs differ."""
        names = [run.name for run in self.runs]
        for i, name in enumerate(names):
            if name in names[:i]:
                message = f"two runs have the name {name!r}"
                yield PathDiagnostic("golden-name", message, path=("runs", i, "name"))


@dataclass(frozen=True)
class Golden:
    """Holds the content of one golden file."""

    file: Path
    title: str
    runs: tuple[GoldenRun, ...]

    def spec_of(self, run: GoldenRun) -> Path:
        """Return the spec of a run, relative to the current folder."""
        return self.file.parent / run.spec


def load_golden(path: Path) -> Golden:
    """Read a golden file.

    Raises:
        SpecError: `golden-is-spec`, it is a spec; or everything that is wrong with the file at once, with the
            codes of a spec's diagnostics and `golden-path`, `golden-tolerance`, `golden-name`.
    """
    tree = read(read_text(path), str(path))
    if isinstance(tree.data, dict) and "runs" not in tree.data and _OF_SPECS & tree.data.keys():
        raise SpecError.because(
            "golden-is-spec",
            f"{path} is a spec: check compares runs with the values that a golden file expects",
            f"`idesign validate {path}` checks the spec, `idesign solve {path}` runs it; a golden file names "
            "it under runs, beside quantities with path, expected, a tolerance, why and source",
            location=Location(str(path), 1, 1),
        )
    try:
        content = _Content.model_validate(tree.data)
    except ValidationError as error:
        found = translate(error, tree.data, _Content)
        placed = [one.placed(tree.places, "the file") for one in found]
        raise SpecError([*tree.diagnostics, *placed]) from None
    if tree.diagnostics:
        raise SpecError(tree.diagnostics)
    return Golden(Path(path), content.title or Path(path).stem, content.runs)


@dataclass(frozen=True)
class Row:
    """Holds a line of the comparison; without a `computed` number, `note` says why it is None."""

    golden: str
    run: str
    quantity: Quantity
    computed: float | None
    note: str = ""

    @property
    def deviation(self) -> float | None:
        """Return the computed minus the expected value."""
        return None if self.computed is None else self.computed - self.quantity.expected

    @property
    def passed(self) -> bool:
        """Return whether the number was computed and lies within its tolerance."""
        return self.deviation is not None and abs(self.deviation) <= self.quantity.tolerance

    def as_dict(self) -> dict[str, Any]:
        """Return the row in JSON's types."""
        return {
            "golden": self.golden,
            "run": self.run,
            "quantity": self.quantity.name,
            **self.quantity.model_dump(include={"path", "expected", "why", "source"}),
            "computed": self.computed,
            "deviation": self.deviation,
            "tolerance": self.quantity.tolerance,
            "passed": self.passed,
            "note": self.note,
        }


def compare(golden: Golden, results: Mapping[str, Result | IdesignError]) -> list[Row]:
    """Return a row for each quantity; `results` go by name of run. A run without a result fails its rows."""
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
    try:
        for step in parse_key(quantity.path):
            value = value[step]
    except (LookupError, TypeError):
        return None, f"the result has no {quantity.path}"
    try:
        return float(value), ""
    except (TypeError, ValueError):
        return None, f"{quantity.path} is not a number"
