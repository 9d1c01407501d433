"""Every count of a spec has a limit, which schema and page show, or needs no memory in proportion."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from inputdesign_cli import validate
from inputdesign_cli.diagnostics import render
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import json_schema, parse_spec
from inputdesign_cli.specification.models.sizes import SIZES
from tests.support.refusals import refused

PAGE = Path(__file__).parents[3] / "docs" / "sizes.md"
BASE = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"

# They scale information, bound a length that is found, or start random numbers: nothing grows with them.
UNLIMITED = {"Experiment.samples", "Limits.samples", "Signal.seed", "Simulation.seed", "Uncertainty.seed"}


def test_the_page_lists_every_limit():
    page = PAGE.read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `?([^|`]+)`? \| ([0-9]+) \|", page, re.MULTILINE))
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
    unlimited = {where for where, most in found if most is None or most > 1_000_000}
    assert unlimited - {"Signal.lines"} == UNLIMITED


# Lists that need no limit of their own. All values of a spec together are at most 100 000.
CHECKED = {
    "one for each channel, or each pair of them": re.compile(
        r"cost\.\w+_power|limits\.(\w+_power(\.max|\.min)?|amplitude(\.input|\.output)?|rate)"
        r"|noise\.(C|D|drift|standard_deviation|correlation_time|variance(\[\])?)|plant\.A|signal\.(amplitudes|least_move|offset|quantisation\.range)"
        r"|spectrum\.given\.(power|amplitudes(\[\])?)|accuracy\.closed_loop_error\.reference\.variance"
        r"|.*controller\.loops"
    ),
    "one for each parameter, or each pair of them": re.compile(
        r"experiment\.prior\.(information(\[\])?|parameters)|estimate\.covariance(\[\])?"
        r"|accuracy\.(information(\.matrix|\.parameters)?|application\.(parameters|hessian))(\[\])*"
        r"|accuracy\.mean_squared_error\.(estimated|neglected)|plant\.parameters|(plant|noise)\.known"
        r"|accuracy\.standard_deviation|estimate\.parameters|prior\.parameters"
        r"|uncertainty\.((covariance|information)(\[\])?|parameters|intervals(\[\])?|scenarios\[\])"
    ),
    "factors, whose product has a limit": re.compile(r".*denominator"),
    "harmonics of a period, which has a limit": re.compile(r"signal\.lines"),
    "a handful of words, files or keys": re.compile(
        r"signal\.(also|export)|include|sweep\.set(\[\])?|channels"
    ),
}


def lists(node, definitions, path=(), inside=frozenset()):
    """Every list and every mapping of names below a node of the schema that has no limit."""
    if "$ref" in node:
        name = node["$ref"].rsplit("/", 1)[-1]
        if name not in inside:
            yield from lists(definitions[name], definitions, path, inside | {name})
    free = isinstance(node.get("additionalProperties"), dict) and "maxProperties" not in node
    if (node.get("type") == "array" and "maxItems" not in node) or free:
        yield "".join(path).lstrip(".")
    for key, part in node.get("properties", {}).items():
        yield from lists(part, definitions, (*path, f".{key}"), inside)
    for part in (one for key in ("anyOf", "oneOf", "allOf") for one in node.get(key, [])):
        yield from lists(part, definitions, path, inside)
    for key in ("items", "additionalProperties"):
        if isinstance(node.get(key), dict):
            yield from lists(node[key], definitions, (*path, "[]"), inside)


def test_every_list_of_the_schema_has_a_limit_or_a_reason():
    schema = json_schema()
    found = {re.sub(r"^simulation\.(plant|noise)", r"\1", path) for path in lists(schema, schema["$defs"])}
    unexplained = {path for path in found if not any(why.fullmatch(path) for why in CHECKED.values())}
    assert unexplained == set()


MANY = 8_000


@pytest.mark.first(3)
@pytest.mark.parametrize(
    "extra",
    [
        "signal: {type: multisine, lines: [" + ", ".join(map(str, range(1, MANY))) + "]}",
        "signal: {also: [" + ", ".join(["x"] * MANY) + "]}",
        "simulation: {compare: [" + ", ".join(["white"] * MANY) + "]}",
        "cost: {input_power: [" + ", ".join(["1"] * MANY) + "]}",
        "limits: {amplitude: [" + ", ".join(["x"] * MANY) + "]}",
        "".join(f"key{i}: 1\n" for i in range(MANY)),
        "sweep: {set: {" + ", ".join(f"key{i}: [1, 2]" for i in range(MANY)) + "}}",
    ],
    ids=["harmonics", "files", "inputs", "numbers", "words", "keys", "sweep"],
)
def test_long_lists_are_answered_soon_and_briefly(extra):
    started, told = time.process_time(), SpecError([])
    try:
        validate(parse_spec(BASE + extra))
    except SpecError as error:
        told = error
    assert len(told.diagnostics) <= 101
    assert len(render(told)) < 50_000
    if len(told.diagnostics) == 101:
        assert re.match(r"[0-9]+ more errors", told.diagnostics[-1].message)
    assert time.process_time() - started < 10.0


def test_many_named_parameters_are_refused_at_once():
    names = ", ".join(f"p{i}: 1" for i in range(MANY))
    found = refused(parse_spec, BASE.replace("plant: {", f"plant: {{parameters: {{{names}}}, "))
    assert "too-large" in {one.code for one in found}


@pytest.mark.parametrize(
    ("key", "extra"),
    [
        ("spectrum.order", "spectrum: {type: fir, order: 1.0e+9}"),
        ("spectrum.order", "spectrum: {type: polynomial, order: 81, band: [0, 1]}"),
        ("spectrum.frequencies", f"spectrum: {{type: multisine, frequencies: {[*range(5001)]}}}"),
        ("signal.samples", "signal: {samples: 2.0e+9}"),
        ("signal.lines", "signal: {type: multisine, lines: 1.0e+9}"),
        ("simulation.runs", "simulation: {runs: 1.0e+9}"),
    ],
)
def test_a_count_that_is_too_large_is_refused_with_its_limit(key, extra):
    (found,) = refused(parse_spec, BASE + extra)
    assert (found.code, found.key) == ("too-large", key)
    assert re.search(r"write at most [0-9]+", found.hint)
