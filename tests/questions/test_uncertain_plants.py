"""How far an estimate is from the spec's plant counts both uncertainties: the variance of a difference."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli import assess, parse_spec
from tests.support.heater import covariance_of

SPEC = """
plant: {{B: [0, {b1}], F: [1, -0.7]}}
noise: {{variance: 1.0}}
experiment: {{samples: 2000}}
accuracy: {{model_error: {{relative: 0.1}}}}
spectrum: {{type: white}}
"""
TRUE, NOMINAL = np.array([3.5, -0.72]), np.array([3.0, -0.7])
MATRIX = "[[0.1, 0.002], [0.002, 0.0004]]"
P = np.array([[0.1, 0.002], [0.002, 0.0004]])
STATED = {
    "": np.zeros((2, 2)),
    f"estimate: {{parameters: {{b1: 3.0, f1: -0.7}}, covariance: {MATRIX}}}": P,
    f"estimate: {{parameters: {{f1: -0.7, b1: 3.0}}, covariance: {MATRIX}}}": P[::-1, ::-1],
    f"estimate: {{parameters: {{b1: 9.0, f1: -0.7}}, covariance: {MATRIX}}}": np.zeros((2, 2)),
    f"estimate: {{parameters: {{b1: 3.0, K: 1.0}}, covariance: {MATRIX}}}": np.diag([0.1, 0.0]),
    f"uncertainty: {{covariance: {MATRIX}, scenarios: 3}}": P,
    f"uncertainty: {{information: {np.linalg.inv(P).tolist()}, scenarios: 3}}": P,
    # Even draws: a twelfth of the squared width, and the squared distance of the middle.
    "uncertainty: {intervals: {b1: [2.8, 3.4]}, scenarios: 3}": np.diag([0.6**2 / 12 + 0.1**2, 0.0]),
    "uncertainty: {scenarios: [{b1: 2.8}, {b1: 3.4, f1: -0.6}]}": np.array([[0.1, 0.02], [0.02, 0.005]]),
}  # fmt: skip


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    rng = np.random.default_rng(1)
    u = rng.standard_normal(2000)
    y = scipy.signal.lfilter([0, TRUE[0]], [1, TRUE[1]], u) + rng.standard_normal(2000)
    path = tmp_path_factory.mktemp("data") / "record.csv"
    np.savetxt(path, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
    return path


@pytest.mark.first(4)
@pytest.mark.parametrize("stated", STATED)
def test_the_statistic_is_by_the_covariance_of_the_difference(record, stated):
    found = assess(parse_spec(SPEC.format(b1=3.0) + stated), record)
    result = found.results.result
    nominal = result["assessment"]["nominal"]
    theta = [result["identification"]["theta"][name] for name in ("b1", "f1")]
    away, both = theta - NOMINAL, covariance_of(result, ["b1", "f1"]) + STATED[stated]
    statistic = away @ np.linalg.solve(both, away)
    assert nominal["statistic"] == pytest.approx(statistic, rel=1e-6)
    assert nominal["probability"] == pytest.approx(scipy.stats.chi2.sf(statistic, 2), rel=1e-5, abs=1e-300)


def test_what_the_spec_is_unsure_of_is_not_another_plant(record):
    """G may differ at a frequency by two standard deviations of the difference."""
    gap = {}
    for b1, known in ((3.0, False), (3.0, True), (-3.0, True)):
        block = f"estimate: {{parameters: {{b1: {b1}, f1: -0.7}}, covariance: {MATRIX}}}" if known else ""
        result = assess(parse_spec(SPEC.format(b1=b1) + block), record).results.result
        gap[b1, known] = result["assessment"]["nominal"]["worst_difference"], len(result.get("notes", []))
    assert gap[3.0, False][0] > 0.1
    assert gap[3.0, True] == (0.0, gap[3.0, False][1] - 1)
    assert gap[-3.0, True][0] > 1.0
    assert gap[-3.0, True][1] == gap[3.0, False][1]
