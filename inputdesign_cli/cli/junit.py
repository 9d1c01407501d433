"""The comparison with golden values in the XML that CI servers read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from inputdesign_cli.errors import IdesignError

if TYPE_CHECKING:
    from inputdesign_cli.outcome.golden import Row

Seconds = Mapping[tuple[str, str], float]


def junit_text(rows: Sequence[Row], seconds: Seconds, error: IdesignError | None = None) -> str:
    """A suite for each golden file and in it a test case for each quantity.

    Args:
        rows: the comparison, file by file.
        seconds: (golden file, run) -> how long the run took; its first quantity carries it.
        error: what ended the comparison, if anything did; it has a suite of its own.
    """
    root = ElementTree.Element("testsuites", name="idesign check")
    for golden, of_file in groupby(rows, lambda row: row.golden):
        _suite(root, golden, list(of_file), seconds)
    if error is not None:
        suite = ElementTree.SubElement(root, "testsuite", name="idesign check")
        _count(suite, tests=1, failures=0, errors=1, time=0.0)
        case = ElementTree.SubElement(
            suite, "testcase", classname="idesign check", name="golden files", time="0"
        )
        for found in error.diagnostics:
            ElementTree.SubElement(case, "error", type=found.code, message=found.message).text = found.hint
    _count(
        root,
        tests=len(rows) + (error is not None),
        failures=sum(not row.passed for row in rows),
        errors=int(error is not None),
        time=sum(seconds.values()),
    )
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _suite(root: ElementTree.Element, golden: str, rows: Sequence[Row], seconds: Seconds) -> None:
    suite = ElementTree.SubElement(root, "testsuite", name=golden)
    failures = sum(not row.passed for row in rows)
    total = sum(taken for (file, _), taken in seconds.items() if file == golden)
    _count(suite, tests=len(rows), failures=failures, errors=0, time=total)
    timed = set()
    for row in rows:
        quantity = row.quantity
        name = f"{row.run}: {quantity.name} ({quantity.source})"
        taken = 0.0 if row.run in timed else seconds.get((golden, row.run), 0.0)
        timed.add(row.run)
        case = ElementTree.SubElement(suite, "testcase", classname=golden, name=name, time=f"{taken:.3f}")
        if not row.passed:
            message = row.note or f"computed {row.computed:.10g}, expected {quantity.expected:.10g}"
            failure = ElementTree.SubElement(case, "failure", message=message)
            failure.text = f"{quantity.path}: {message}; tolerance {quantity.tolerance:.3g} ({quantity.why})"


def _count(element: ElementTree.Element, *, tests: int, failures: int, errors: int, time: float) -> None:
    counts = {"tests": tests, "failures": failures, "errors": errors, "time": f"{time:.3f}"}
    element.attrib.update({name: str(value) for name, value in counts.items()})
