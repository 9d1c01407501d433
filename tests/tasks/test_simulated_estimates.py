"""Estimates of simulated experiments, by which an exact confidence is calibrated."""

import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.tasks import simulated_estimates

SPEC = """
plant: {{B: [0, 3.6], F: [1, -0.7]}}
noise: {{variance: 1.0}}
experiment: {{samples: {samples}}}
accuracy: {{model_error: {{relative: 0.2, confidence: {{exact: 0.95, runs: 100}}}}}}
spectrum: {{type: fir, order: 2}}
signal: {{candidates: 1}}
"""


@pytest.mark.parametrize(("samples", "each"), [(12, 1), (200, 20)])
def test_short_records_differ_so_much_that_each_has_one_run(monkeypatch, samples, each):
    """Twenty runs of each of five records of 8 samples told of these five: it cost 1.7 times too much."""
    seen, genuine = set(), simulated_estimates.Reapplied

    def noted(excitation, times):
        seen.add(times)
        return genuine(excitation, times)

    monkeypatch.setattr(simulated_estimates, "Reapplied", noted)
    solve(parse_spec(SPEC.format(samples=samples)))
    assert seen == {each}
