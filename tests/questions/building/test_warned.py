"""A spec that was written for a log says in words and in its title what its model is worth."""

import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.questions.exploration.build import warned

TEXT = """# Written by `idesign explore` from title: odd.csv.
title: "The next experiment after \\"odd\\""

plant: {B: [0, 1]}
noise: {variance: 1}
"""


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("reasons", [(), ("the record\nis too short: see #3", "y wanders " * 30)])
def test_reasons_stand_at_the_head_and_in_the_title(reasons, loop):
    text = warned(TEXT, reasons, loop=loop)
    spec = parse_spec(text, design=False)
    doubted = "On a model that deserves no trust: " if reasons else ""
    assert spec.title == f'{doubted}The next experiment after "odd"'
    head = text.partition("\ntitle:")[0].splitlines()
    assert all(line.startswith("#") and len(line) <= 110 for line in head)
    words = " ".join(line.lstrip("# ") for line in head)
    for reason in reasons:
        assert " ".join(reason.split()) in words
    assert ("experiment: {controller:" in words) == loop
    assert (text == TEXT) == (not reasons and not loop)
