"""Plants in JSON: what is wrong is told in its words, and a pole at zero is known, not estimated."""

import json

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.wizard.composing import compose
from inputdesign_cli.wizard.plants import system_of
from tests.wizard.test_faults import GOOD

_TANK = {"num": [4, 2], "den": [360, 2, 0], "delay": 25}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"num": [2], "den": [0, 0]}', "den of p.json is zero"),
        ('{"num": [0], "den": [1, 1]}', "num of p.json is zero"),
        ('{"num": [1, 2, 3], "den": [1, 1]}', "num of p.json has more entries than den"),
        ("[1]", "valid dictionary"),
        ('{"num": [NaN], "den": [1, 1]}', "num.0: "),
        ('{"num": [1], "den": [1, Infinity]}', "den.1: "),
        ('{"den": [1, 1]}', "num: Field required"),
        ('{"num": [true], "den": [1, 1]}', "num.0: "),
        ('{"num": [1], "den": [1, 1], "delay": "x"}', "delay: "),
        ('{"num": [[1]], "den": [1, 1]}', "num.0: "),
        ('{"num": 3, "den": [1, 1]}', "num: Input should be a valid list"),
        ("[" * 100_000, "does not hold"),
        ('{"num": [1], "den": [1, 1], "dealy": 25}', "dealy: Extra inputs are not permitted"),
        ('{"num": [1], "den": [1, 1], "delay": null}', "delay: "),
        ('{"num": [1], "den": [1, 1], "delay": NaN}', "delay: "),
        ('{"num": [2], "den": [1, 0]}', 'write its dead time ("delay": 5), however small, or the lag'),
        ('{"num": [2], "den": [1, 0, 1], "delay": 5}', "has no stable pole"),
    ],
)
def test_what_is_wrong_is_told(tmp_path, text, words):
    file = tmp_path / "p.json"
    file.write_text(text)
    with pytest.raises((SpecError, DataError)) as error:
        system_of(file)
    assert words in str(error.value)


def test_an_integrator_is_known(tmp_path):
    (tmp_path / "p.json").write_text(json.dumps(_TANK))
    loop = "PI Kp 0.0005, Ti 3000"
    draft = compose(GOOD | {"plant": "p.json", "loop": loop}, "s", tmp_path)
    plant = parse_spec(draft.text, design=False).plant
    assert plant.kind == "continuous"
    assert {one.label for one in plant.named_parameters} == {"b1", "b0", "a1", "L"}
    matrix = plant.continuous
    s = 1j * np.array([1e-4, 1e-2, 1.0])
    found = np.polyval(matrix.numerator_matrix[0][0], s) / np.polyval(matrix.denominator_matrix[0][0], s)
    assert found == pytest.approx(np.polyval(_TANK["num"], s) / np.polyval(_TANK["den"], s), rel=1e-12)


def test_a_pure_integrator_is_sampled_by_its_dead_time(tmp_path):
    """As the template `tank`: 0.05 exp(-5 s)/s."""
    (tmp_path / "p.json").write_text(json.dumps({"num": [0.05], "den": [1, 0], "delay": 5}))
    draft = compose(GOOD | {"plant": "p.json", "loop": "PI Kp 0.8, Ti 60"}, "s", tmp_path)
    assert "sample_time: 2  # half the dead time, or a little less" in draft.text
    plant = draft.spec().plant
    assert {one.label for one in plant.named_parameters} == {"b0", "L"}


def test_a_zero_that_cancels_the_integrator_leaves_none(tmp_path):
    for name, num, den in (("a", [2, 0], [180, 1, 0]), ("b", [2], [180, 1])):
        (tmp_path / f"{name}.json").write_text(json.dumps({"num": num, "den": den}))
    one, other = (system_of(tmp_path / f"{name}.json") for name in "ab")
    assert one.lines[1:] == other.lines[1:]
