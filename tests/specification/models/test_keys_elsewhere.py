"""Keys of another place or another custom: the hint says how this section says the same."""

import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError

REST = "\nnoise: {variance: 1}\naccuracy: {standard_deviation: {gain: 0.1}}\n"
CASES = {
    "plant: {B: [0, 1], F: [1, -0.5], delay: 3}": "leading zeros of B",
    "plant: {continuous: {numerator: [2], denominator: [9, 1]}, delay: 3, sample: zoh}": "under continuous",
    "plant: {continuous: {gain: 2, time_constant: 9}, dead_time: 3, sample: zoh}": "under continuous",
    "plant: {B: [0, 1]}\nexperiment: {controller: {pid: {Kp: 1, Ki: 2}}}": "Ti: Kp / Ki",
    "plant: {B: [0, 1]}\nexperiment: {controller: {pid: {Kp: 1, Kd: 2}}}": "Td: Kd / Kp",
    "plant: {parameters: {K: 2, θ: 3}, continuous: {numerator: [K], denominator: [9, 1]}}": "a to z",
    "plant: {parameters: {K: 2}, continuous: {numerator: [K], denominator: [9, 1], delay: 25s}}": "unit: 25",
    "plant: {parameters: {K: 2, z: 0}, continuous: {numerator: ['K*sqrt(z)'], denominator: [z, 1]}}": "root",
}


@pytest.mark.parametrize("text", CASES)
def test_what_to_write_instead(text):
    with pytest.raises(SpecError) as caught:
        parse_spec(text + REST)
    assert any(CASES[text] in found.hint for found in caught.value.diagnostics)
