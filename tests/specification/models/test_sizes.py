"""Every count of a spec has a limit, which schema and page show, or is one that nothing is made of."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import json_schema, parse_spec
from inputdesign_cli.specification.models.sizes import SIZES

PAGE = Path(__file__).parents[3] / "docs" / "sizes.md"
BASE = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"

# They scale information, bound a length that is found, or start random numbers: nothing grows with them.
UNLIMITED = {"Experiment.samples", "Limits.samples", "Signal.seed", "Simulation.seed"}


def test_the_page_lists_every_limit():
    rows = dict(
        re.findall(r"^\| `?([^|`]+)`? \| ([0-9]+) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert rows == {key: str(size.most) for key, size in SIZES.items()}


def counts(node, where):
    """Every whole number below a node of the schema, with its largest value."""
    if isinstance(node, list):
        return [found for item in node for found in counts(item, where)]
    if not isinstance(node, dict):
        return []
    if node.get("type") == "integer":
        return [(where, node.get("maximum"))]
    return [found for part in node.values() for found in counts(part, where)]


def test_every_whole_number_of_the_schema_has_a_limit():
    found = [
        one
        for name, section in json_schema()["$defs"].items()
        for key, entry in section["properties"].items()
        for one in counts(entry, f"{name}.{key}")
    ]
    assert {where for where, most in found if most is None or most > 1_000_000} - {
        "Signal.lines"
    } == UNLIMITED


@pytest.mark.parametrize(
    ("key", "extra"),
    [
        ("spectrum.order", "spectrum: {type: fir, order: 1.0e+9}"),
        ("spectrum.order", "spectrum: {type: fir, order: 1.0e+300}"),
        ("spectrum.order", "spectrum: {type: polynomial, order: 81, band: [0, 1]}"),
        ("spectrum.lines", "spectrum: {type: multisine, lines: 100000}"),
        (
            "spectrum.frequencies",
            f"spectrum: {{type: multisine, frequencies: {[i / 2000 for i in range(5001)]}}}",
        ),
        ("signal.samples", "signal: {samples: 2.0e+9}"),
        ("signal.hold", "signal: {hold: 1.0e+15}"),
        ("signal.lines", "signal: {type: multisine, lines: 1.0e+9}"),
        ("solver.grid", "solver: {method: lmi, grid: 1.0e+6}"),
        ("simulation.runs", "simulation: {runs: 1.0e+9}"),
    ],
)
def test_what_is_too_large_is_refused_with_what_would_fit(key, extra):
    with pytest.raises(SpecError) as refused:
        parse_spec(BASE + extra)
    (found,) = refused.value.diagnostics
    assert (found.code, found.key) == ("too-large", key)
    assert re.search(r"write at most [0-9]+", found.hint)
