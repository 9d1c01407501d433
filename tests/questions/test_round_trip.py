"""What was written is what was designed: an analysis of the written spectrum agrees with the design."""

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, solve

# With integral action power near frequency zero is almost free: one huge line must not hide the others.
INTEGRAL_ACTION = """
plant: {A: [1, -0.0063055794, -0.24801378, 0.085217878], B: [0, 0, 1.9794985, 1.2099904]}
noise: {variance: 0.1}
experiment:
  samples: 1000
  controller: {numerator: [0.09405895722038726, -0.056435374332232356], denominator: [1, -1]}
cost: {input_power: 1, output_power: 1}
accuracy: {model_error: {relative: 0.2, alpha: 2}}
signal: {samples: 200, seed: 1}
"""
OPEN_LOOP = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.01, alpha: 2.45}}
"""


@pytest.mark.first(2)
@pytest.mark.parametrize("spectrum", ["{type: free}", "{type: multisine, lines: 40}"])
@pytest.mark.parametrize("text", [INTEGRAL_ACTION, OPEN_LOOP], ids=["integral action", "open loop"])
def test_the_listed_sinusoids_meet_what_the_design_promises(text, spectrum):
    solved = solve(parse_spec(f"{text}spectrum: {spectrum}\n"))
    designed, table = solved.result, solved.tables["spectrum"].columns
    frequency = table["frequency_rad_per_s"]
    np.testing.assert_array_equal(frequency, designed["spectrum"]["frequencies"])
    inside = (frequency > 0) & (frequency < np.pi)
    amplitude = np.sqrt(np.where(inside, 2.0, 1.0) * table["power"])
    given = f"{{type: multisine, frequencies: {frequency.tolist()}, amplitudes: {amplitude.tolist()}}}"
    found = analyse(parse_spec(f"{text}spectrum: {{given: {given}}}\n")).result
    assert found["status"] == "met"
    assert found["cost"] == pytest.approx(designed["cost"], rel=1e-9)
    assert found["model_error"]["worst_ratio"] == pytest.approx(
        designed["model_error"]["worst_ratio"], rel=1e-8
    )
