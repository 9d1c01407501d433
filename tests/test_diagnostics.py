"""Diagnostics as text and as data."""

from __future__ import annotations

import json
import re
import unicodedata

import pytest

from inputdesign_cli.diagnostics import as_json, render
from inputdesign_cli.errors import Diagnostic, InfeasibleError, Location, SpecError
from inputdesign_cli.specification import parse_spec

ONE = SpecError(
    Diagnostic("a-code", "plant.F is wrong", "mend it", "plant.F", Location("s.yaml", 12, 9, "plant: {F: 1}"))
)


def test_one_complaint_in_full_and_without_place_or_hint():
    assert render(ONE) == (
        "s.yaml:12:9: error[a-code] plant.F is wrong\n"
        "12 | plant: {F: 1}\n"
        "   |         ^\n"
        "help: mend it\n"
        "\n"
        "`idesign explain a-code` says more."
    )
    bare = InfeasibleError(Diagnostic("infeasible", "too strict"))
    assert render(bare) == "error[infeasible] too strict\n\n`idesign explain infeasible` says more."
    coloured = render(ONE, color=True)
    assert "\x1b[" in coloured
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == render(ONE)


def test_several_complaints_are_counted():
    with pytest.raises(SpecError) as caught:
        parse_spec("plant: {B: [x]}\n", "s.yaml")
    text = render(caught.value)
    # x is no number, noise is missing, and nothing is asked
    assert text.count("error[") == 3
    assert text.endswith("3 errors. `idesign explain CODE` says more.")


def test_overrides_have_no_line_number():
    with pytest.raises(SpecError) as caught:
        parse_spec("plant: {B: [0, 1]}\nnoise: {variance: 1}\n", "s.yaml", ["noise.variance=-1", "plant.D=1"])
    text = render(caught.value)
    assert "--set noise.variance=-1: error[out-of-range]" in text
    assert "| noise.variance=-1\n|                ^\n" in text


def shown(text, column, **fields):
    """The lines of a complaint about a column of this text."""
    place = Location(fields.pop("file", "f"), 1, column, text)
    return render(SpecError(Diagnostic("c-d", **{"message": "m", **fields}, location=place))).splitlines()


@pytest.mark.parametrize("column", [1, 2, 60, 150, 299, 300, 301])
def test_long_lines_are_clipped_around_the_column(column):
    text = "".join(chr(ord("a") + i % 26) for i in range(300))
    _, line, caret, *_ = shown(text, column)
    assert len(line) <= 4 + 106
    if column <= 300:
        assert line[len(caret) - 1] == text[column - 1]


def test_the_caret_stands_below_wide_characters():
    line = "title: 温度 x"
    column = line.index("x") + 1
    cells = sum(2 if unicodedata.east_asian_width(c) == "W" else 1 for c in line[: column - 1])
    assert shown(line, column)[2] == "  | " + " " * cells + "^"


def test_tabs_and_control_characters_do_not_reach_the_terminal():
    lines = shown("\ta\x1b[31m", 3, file="f\x1b[2J", message="m\x1b[0m", hint="h\x07")
    assert not set("".join(lines)) & set("\x1b\x07\t")


def test_diagnostics_become_plain_data():
    assert json.loads(json.dumps(as_json(ONE))) == [
        {
            "code": "a-code",
            "message": "plant.F is wrong",
            "hint": "mend it",
            "key": "plant.F",
            "location": {"file": "s.yaml", "line": 12, "column": 9, "text": "plant: {F: 1}"},
        }
    ]
    assert as_json(InfeasibleError(Diagnostic("x-y", "m")))[0]["location"] is None
