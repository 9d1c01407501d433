"""The comparison with golden values in the XML that CI servers read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree import ElementTree

if TYPE_CHECKING:
    from inputdesign_cli.runs.golden import Row


def junit_text(rows: Sequence[Row]) -> str:
    """One test case a quantity; a suite of the name `idesign check`."""
    failures = sum(not row.passed for row in rows)
    suite = ElementTree.Element(
        "testsuite", name="idesign check", tests=str(len(rows)), failures=str(failures), errors="0"
    )
    for row in rows:
        quantity = row.quantity
        name = f"{row.run}: {quantity.name} ({quantity.source})"
        case = ElementTree.SubElement(suite, "testcase", classname=row.golden, name=name)
        if not row.passed:
            message = row.note or f"computed {row.computed:.10g}, expected {quantity.expected:.10g}"
            failure = ElementTree.SubElement(case, "failure", message=message)
            failure.text = f"{quantity.path}: {message}; tolerance {quantity.tolerance:.3g} ({quantity.why})"
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"
