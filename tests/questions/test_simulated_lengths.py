"""Runs are compared with predictions for the length of their records, whatever length the design counts."""

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, simulate

PLANT = """
plant: {B: [0, 1, 0.4], F: [1, -0.7]}
noise: {variance: 0.5}
spectrum: {type: fir, order: 4}
report: {ellipses: [[b1, f1]]}
simulation: {runs: 60, seed: 1}
"""
D_OPTIMAL = "accuracy: {criterion: D}\nlimits: {input_power: 1}\n"
PRIOR = "prior: {information: [[50, 0, 0], [0, 40, 0], [0, 0, 60]]}"


def compared(text, *overrides):
    """The result, the share within the promised r_u, r_u over frequency, and the ellipse."""
    found = simulate(parse_spec(PLANT + text, overrides=list(overrides)))
    design = found.result["simulation"]["inputs"]["design"]
    (panel,) = found.curves["errors_design"].panels
    (pair,) = found.curves["ellipses"].pairs
    return found, design["within_promised_r_u"], (panel.frequency, panel.r_u), pair


def test_a_criterion_per_sample_is_compared_like_one_of_the_record():
    per_sample, *found = compared(f"{D_OPTIMAL}signal: {{samples: 400}}")
    of_length, *expected = compared(f"{D_OPTIMAL}experiment: {{samples: 400}}")
    assert (per_sample.result["samples"], of_length.result["samples"]) == (1, 400)
    assert found[0] == expected[0]
    np.testing.assert_allclose(np.interp(1.0, *found[1]), np.interp(1.0, *expected[1]), rtol=1e-5)
    for kind in ("covariance", "white"):
        one, other = (getattr(each[2], kind) for each in (found, expected))
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-12)
    (only,) = per_sample.result["findings"]
    assert (only["code"], only["figures"]) == ("other-length", {"counted": 1, "simulated": 400})
    assert "notes" not in of_length.result


@pytest.mark.parametrize("region", ["first_order", "ellipsoid"])
def test_what_is_known_before_does_not_grow_with_the_record(region):
    given = ["spectrum={given: {type: white, power: 1}}", "simulation.runs=20"]
    accuracy = f"accuracy: {{model_error: {{relative: 0.2, region: {region}}}}}\n"
    short = f"{accuracy}experiment: {{samples: 100, {PRIOR}}}\nsignal: {{samples: 400}}"
    long = f"{accuracy}experiment: {{samples: 400, {PRIOR}}}"
    designed, *found = compared(short, *given)
    _, *expected = compared(long, *given)
    assert designed.result["samples"] == 100
    assert found[0] == expected[0]
    np.testing.assert_allclose(np.interp(1.0, *found[1]), np.interp(1.0, *expected[1]), rtol=1e-4)
    np.testing.assert_allclose(found[2].covariance, expected[2].covariance, rtol=1e-9)
    # bound.csv stays the statement of the design, for its own length.
    (bound,) = designed.curves["bound"].panels
    assert np.interp(1.0, bound.frequency, bound.r_u) > 1.5 * np.interp(1.0, *found[1])


@pytest.mark.slow
def test_the_shipped_plant_in_s():
    """r_u of the figure is that of bound.csv for one sample over the root of the length of the record."""
    found = simulate(load_spec("specs/two_by_two.yaml", ["signal.samples=1024", "simulation.runs=2"]))
    for panel, bound in zip(found.curves["errors_design"].panels, found.curves["bound"].panels, strict=True):
        np.testing.assert_allclose(panel.r_u, bound.r_u / np.sqrt(1024), rtol=1e-9)
