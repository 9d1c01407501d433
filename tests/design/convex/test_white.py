"""White excitation of the least power: in any units, and where no power is enough."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.design.convex.coordinates import least_white_power
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions.least_cost.build import build_convex

COLOURED = """
plant: {B: [0, %g], F: [1, 0.0]}
noise: {C: [1, 0.0], variance: 1.0}
experiment:
  samples: 400
  prior: {parameters: [b1, c1, f1], information: [[%g, 0, 0], [0, 100, 40], [0, 40, %g]]}
accuracy: {model_error: {relative: 0.1}, standard_deviation: {c1: %g}}
spectrum: {type: fir, order: 2}
"""


def asked(gain, deviation):
    """The input in a unit of its own; what is known of c1 and f1 hangs together."""
    text = COLOURED % (gain, 50.0 / gain**2, 50.0, deviation)
    return build_convex(parse_spec(text)).asked.question


@pytest.mark.parametrize("gain", [1e-6, 1.0, 1e6])
def test_what_only_the_noise_tells_is_out_of_reach_in_any_units(gain):
    """Where b1 and f1 are known, var c1 = 1 / (100 + N): the ratio that stays is 1 / (sqrt(500) 0.03)."""
    question = asked(gain, 0.03)
    with pytest.raises(InfeasibleError) as refused:
        least_white_power(question.experiment, question.requirements)
    assert f"{1.0 / np.sqrt(500.0) / 0.03:.6g} times" in refused.value.diagnostics[0].message


@pytest.mark.parametrize("gain", [1e-6, 1e6])
def test_the_least_power_is_that_of_the_other_units(gain):
    powers = [
        least_white_power(question.experiment, question.requirements) * g**2
        for g in (1.0, gain)
        for question in [asked(g, 0.06)]
    ]
    assert powers[0] > 0.0
    assert powers[1] == pytest.approx(powers[0], rel=1e-9)
