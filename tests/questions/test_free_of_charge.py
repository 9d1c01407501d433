"""A loop with integral action is excited best near frequency zero, where it costs no input power."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve

# A pole of this loop has an angle of rounding, so that the grid of frequencies has a point next to zero.
LOOP = """
plant:
  parameters: {a: 3.21, k: 0.9362, m: 1.865}
  state_space: {A: [[-a, 0], [m, -m]], B: [[k*a], [0]], C: [[0, 1]], delay: 0.04888}
  sample: zoh
  known: [m]
noise: {variance: 0.02358, C: [1.0, 0.23507, -0.52711]}
experiment: {samples: 1000, controller: {pid: {Kp: 0.3, Ti: 0.9346}}}
sample_time: 0.06794
accuracy: {standard_deviation: {k: 0.1024}}
objective: best_accuracy
limits: {input_power: 0.2527}
spectrum: {type: free}
signal: {seed: 81, type: multisine}
"""


def test_the_proof_closes_for_a_very_slow_input():
    """To a very slow input the gain alone matters: var(k) <= v C(1)^2 / (N p), for G(0) = k."""
    found = solve(parse_spec(LOOP)).result["objective"]
    assert found["relative_gap"] < 1e-7
    slow = np.sqrt(0.02358 / (1000 * 0.2527)) * (1 + 0.23507 - 0.52711)
    # What the noise adds around the loop only helps, and is little.
    assert 0.99 * slow < found["value"] * 0.1024 < slow
    assert found["value"] == pytest.approx(found["any_spectrum_bound"], rel=1e-7)
