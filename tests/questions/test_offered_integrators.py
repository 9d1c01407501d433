"""What is offered for a plant in a loop that a record cannot tell from an integrator."""

import re

import numpy as np
import pytest

from inputdesign_cli.questions import explore, identify
from inputdesign_cli.specification import parse_spec

# The clock, the plant, and the noise where the output wanders besides.
OFFER = r"in SPEC (.*?) and (plant: .*? sample: zoh\})(?:, and (noise: .*))?$"


@pytest.mark.slow
def test_an_integrator_in_a_loop_is_offered_with_its_controller(tmp_path):
    """y(t) = y(t-1) + 0.1 u(t-1), u = 1.5 (r - y): the spec offered, its controller filled in, is right."""
    rng = np.random.default_rng(1)
    r, u, y, x = np.repeat(rng.uniform(-1, 1, 8), 50), np.zeros(400), np.zeros(400), 0.0
    for t in range(400):
        x = x + 0.1 * u[t - 1] if t else 0.0
        y[t] = x + 0.02 * rng.standard_normal()
        u[t] = 1.5 * (r[t] - y[t])
    log = tmp_path / "log.csv"
    table = np.column_stack([np.arange(400), u, y])
    np.savetxt(log, table, delimiter=",", header="t_s,u,y", comments="", fmt="%.9g")
    (reason,) = [one for one in explore(log).reasons if "integrator" in one]
    offer = r"in SPEC (sample_time: \S+) and (plant: .*? sample: zoh\}), and the controller as it was, (.*)$"
    step, plant, controller = re.search(offer, reason).groups()
    filled = controller.replace("numerator: [..]", "numerator: [1.5]").replace("[..]", "[1]")
    result = identify(parse_spec(f"{step}\n{plant}\n{filled}\n", design=False), log).result
    assert result["identification"]["theta"]["K"] == pytest.approx(0.1, rel=0.1)
    assert result["identification"]["failed"] == []


@pytest.mark.slow
def test_what_is_offered_is_a_spec_in_the_unit_of_the_log(tmp_path):
    """y(t) = y(t-1) + 0.1 u(t-1): the lines offered, as they stand, identify the slope in the same log."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 16), 5)
    y = 0.1 * np.concatenate([[0.0], np.cumsum(u)[:-1]]) + 0.02 * rng.standard_normal(80)
    log = tmp_path / "log.csv"
    table = np.column_stack([np.arange(80), u, y])
    np.savetxt(log, table, delimiter=",", header="time_min,u,y", comments="", fmt="%.9g")
    (reason,) = [one for one in explore(log).reasons if "cannot be told from an integrator" in one]
    clock, plant, noise = re.search(OFFER, reason).groups()
    text = "\n".join([*clock.split(", "), plant, noise or ""])
    result = identify(parse_spec(text + "\n", design=False), log).result
    assert result["identification"]["theta"]["K"] == pytest.approx(0.1, rel=0.1)
    assert "time_unit: min" in text.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 6, 8, 9])
def test_an_integrator_beside_a_random_walk_is_offered_with_noise_that_wanders(tmp_path, seed):
    """y(t) = y(t-1) + 0.05 u(t-4) and a walk: by the slope alone the walk is taken for the plant's doing."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 20), 15)
    y = 0.05 * np.concatenate([np.zeros(4), np.cumsum(u)[:-4]]) + np.cumsum(0.03 * rng.standard_normal(300))
    y += 0.02 * rng.standard_normal(300)
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack([np.arange(300), u, y]), delimiter=",", header="t_s,u,y", comments="")
    done = explore(log)
    (reason,) = [one for one in done.reasons if "cannot be told from an integrator" in one]
    clock, plant, noise = re.search(OFFER, reason).groups()
    assert "drift: true" in noise
    found = identify(parse_spec(f"{clock}\n{plant}\n{noise}\n", design=False), log).result["identification"]
    K, deviation = found["theta"]["K"], found["standard_deviation"]["K"]
    assert abs(K - 0.05) < 3.0 * deviation
