"""The comparison with golden values in the XML that CI servers read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

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
    root = Element("testsuites", name="idesign check")
    for golden, of_file in groupby(rows, lambda row: row.golden):
        suite, timed = SubElement(root, "testsuite", name=golden), set()
        for row in of_file:
            taken = 0.0 if row.run in timed else seconds.get((golden, row.run), 0.0)
            timed.add(row.run)
            _add(suite, golden, row, taken)
    if error is not None:
        suite = SubElement(root, "testsuite", name="idesign check")
        case = SubElement(suite, "testcase", classname="idesign check", name="golden files", time="0")
        for found in error.diagnostics:
            SubElement(case, "error", type=found.code, message=found.message).text = found.hint
    for part in (root, *root):
        cases = list(part.iter("testcase"))
        time = sum(float(one.get("time", 0.0)) for one in cases)
        part.attrib.update({"tests": str(len(cases)), "time": f"{time:.3f}"})
        for kind in ("failure", "error"):
            part.set(f"{kind}s", str(sum(one.find(kind) is not None for one in cases)))
    indent(root)
    return tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(suite: Element, golden: str, row: Row, taken: float) -> None:
    quantity = row.quantity
    name = f"{row.run}: {quantity.name} ({quantity.source})"
    case = SubElement(suite, "testcase", classname=golden, name=name, time=f"{taken:.3f}")
    if not row.passed:
        message = row.note or f"computed {row.computed:.10g}, expected {quantity.expected:.10g}"
        failure = SubElement(case, "failure", message=message)
        failure.text = f"{quantity.path}: {message}; tolerance {quantity.tolerance:.3g} ({quantity.why})"
