"""An input that was logged late in a loop leaves the verdict open where the reference tells."""

import numpy as np
import pytest

from inputdesign_cli import assess, identify, parse_spec
from tests.identification.test_control_law import GAIN, loop

# The plant of `loop`, whose controller is a gain.
SPEC = """
plant: {A: [1, -0.8], B: [0, 0.5]}
noise: {variance: 0.09}
experiment: {samples: 1000, controller: {numerator: [0.5], denominator: [1]}}
accuracy: {model_error: {relative: 0.5}}
"""


@pytest.fixture
def logged(tmp_path):
    def write(shift, header):
        u, y, r = loop(GAIN, samples=1000)
        columns = {"u": np.roll(u, shift), "y": y, "r": r}
        path = tmp_path / "log.csv"
        rows = np.column_stack([columns[name] for name in header.split(",")])
        np.savetxt(path, rows[5:], delimiter=",", header=header, comments="", fmt="%.9g")
        return path

    return write


def test_an_input_that_was_logged_late_leaves_the_verdict_open(logged):
    spec = parse_spec(SPEC)
    good = assess(spec, logged(0, "u,y,r"))
    assert good.verdict == "met"
    late = logged(1, "u,y,r")
    found = assess(spec, late)
    assert found.verdict == "undecided"
    (told,) = found.results.result["assessment"]["undecided"]
    assert told.startswith("A column was logged at another time: u is 1 sample late")
    assert told in identify(spec, late).result["notes"]


def test_without_the_reference_nothing_can_be_said(logged):
    notes = identify(parse_spec(SPEC), logged(1, "u,y")).result.get("notes", [])
    assert not any("logged" in note for note in notes)
