"""A spec that was written for a log is a design, and says what its model is worth."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.questions.exploration.build import spec_text
from tests.explore.plants import siso


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("reasons", [(), ("the record\nis too short: see #3", "y wanders " * 30)])
def test_reasons_stand_at_the_head_and_in_the_title(reasons, loop):
    u = np.array([[1e5], [1e5 + 2.0], [1e5 + 1.0]])
    log = SimpleNamespace(u=u, y=u, step=1e-5, time_unit="s", names={"u1": "a: #\nb", "y1": "y"})
    taken = (SimpleNamespace(orders=SimpleNamespace(physical=False, family="OE")),)
    found = SimpleNamespace(model=siso([0.0, 1.0], [1.0, -0.5]), taken=taken, integrates=())
    text = spec_text(log, found, [Path('title: "odd".csv')], reasons, loop=loop)
    spec = parse_spec(text)
    doubted = "On a model that deserves no trust: " if reasons else ""
    assert spec.title == f'{doubted}The next experiment after title: "odd".csv'
    assert (spec.sample_time, spec.limits.input_power.max, spec.signal.offset) == (1e-5, 0.666667, 100001.0)
    head = text.partition("\ntitle:")[0].splitlines()
    assert all(line.startswith("#") and len(line) <= 110 for line in head)
    words = " ".join(line.lstrip("# ") for line in head)
    for reason in reasons:
        assert " ".join(reason.split()) in words
    assert ("experiment: {controller:" in words) == loop
