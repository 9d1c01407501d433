"""Estimates from few samples: their stated errors are those that simulated records have."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli import assess, identify, parse_spec
from inputdesign_cli.identification import identify as first_order
from inputdesign_cli.questions.building.system import build_model

B, F, D, VARIANCE = 0.2, -0.8, -0.6, 0.05
SPEC = """
plant: {{B: [0, {B}], F: [1, {F}]}}
noise: {{variance: {variance}, D: [1, {D}]}}
experiment: {{samples: 100}}
accuracy: {{model_error: {{relative: {relative}, band: [0.02, 1]}}}}
limits: {{input_power: 1}}
"""


def spec(relative=0.5):
    return parse_spec(SPEC.format(B=B, F=F, D=D, variance=VARIANCE, relative=relative))


def recorded(path, samples, seed):
    """Write a record of random levels from rest, by the difference equations."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], -(-samples // 2)), 2)[:samples]
    e = np.sqrt(VARIANCE) * rng.standard_normal(samples)
    y = scipy.signal.lfilter([0, B], [1, F], u) + scipy.signal.lfilter([1], [1, D], e)
    path.write_text(
        "time,u1,y1\n"
        + "".join(f"{t},{a},{b!r}\n" for t, (a, b) in enumerate(zip(u, y.tolist(), strict=True)))
    )
    return path


def codes(results):
    return {one["code"]: one for one in results.result.get("findings", [])}


def test_a_long_record_needs_no_simulated_ones(tmp_path):
    results = identify(spec(), recorded(tmp_path / "long.csv", 400, 1))
    assert "short-record" not in codes(results)


def test_stated_errors_grow_by_what_simulated_records_show(tmp_path):
    data = recorded(tmp_path / "short.csv", 40, 1)
    results = identify(spec(), data)
    factor = codes(results)["short-record"]["figures"]["factor"]
    assert 1.02 < factor < 5
    judged = assess(spec(), data)
    assert codes(judged.results)["short-record"]["figures"]["factor"] == pytest.approx(factor)
    _, u, y = np.loadtxt(data, delimiter=",", skiprows=1).T
    plain = first_order(build_model(spec()), u[:, None], y[:, None])
    stated = np.array(results.result["information"]["covariance"])
    assert stated == pytest.approx(factor**2 * plain.covariance, rel=1e-6)


@pytest.mark.slow
def test_regions_hold_the_truth_as_often_as_stated(tmp_path):
    """The 95 % regions of 60 records of 50 samples; by first-order theory they hold it in 82 %."""
    truth, held, tried = np.array([B, D, F]), 0, 0
    for seed in range(60):
        results = identify(spec(), recorded(tmp_path / f"{seed}.csv", 50, seed)).result
        if results["status"] != "identified":
            continue
        theta = results["identification"]["theta"]
        away = np.array([theta[name] for name in ("b1", "d1", "f1")]) - truth
        information = np.linalg.inv(np.array(results["information"]["covariance"]))
        held += away @ information @ away <= scipy.stats.chi2.ppf(0.95, 3)
        tried += 1
    assert held / tried >= 0.88
