"""Plants in s by named parameters: what is written is what was estimated, and it is the truth."""

import numpy as np
import pytest

from inputdesign_cli.identification.explore import explore_records
from inputdesign_cli.identification.explore.processes import Process, process_models
from inputdesign_cli.plant import ContinuousModel, SampledModel

STEP = 0.5


def first_order(K, T, L):
    row = (np.array([K]),), (np.array([1.0, T]),), (np.array([L]),)
    plant = ContinuousModel.monic((row[0],), (row[1],), np.eye(1), delay=(row[2],))
    return SampledModel(plant, STEP)


@pytest.mark.parametrize(
    ("process", "theta", "below"),
    [
        (Process((3,), 1, STEP), [2.0, 6.0, 1.2], [6.0, 1.0]),
        (Process((3,), 2, STEP), [2.0, 3.0, 0.4, 1.2], [9.0, 2.4, 1.0]),
        (Process((3,), 2, STEP, zero=True), [2.0, 3.0, 1.5, 0.7, 1.2], [9.0, 9.0, 1.0]),
        (Process((3,), 3, STEP), [2.0, 3.0, 1.0, 5.0, 1.2], np.polymul([9.0, 6.0, 1.0], [5.0, 1.0])),
    ],
)
def test_a_response_is_that_of_its_formula(process, theta, below):
    plant = process_models([process], [np.array(theta)], np.eye(1)).coefficients.continuous_plant
    w = np.array([0.01, 0.3, 2.0])
    s = 1j * w
    above = theta[0] * (1.0 + theta[3] * s if process.zero else 1.0)
    expected = above / np.polyval(below, s) * np.exp(-s * theta[-1])
    np.testing.assert_allclose(plant.plant_at(w)[:, 0, 0], expected, rtol=1e-12)


def test_gain_time_constant_and_dead_time_are_found():
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)[:, None]
    x, _ = first_order(2.0, 6.0, 1.7).simulate(u, np.zeros(u.shape), 1.0)
    y = 30.0 + x + 0.2 * np.std(x) * rng.standard_normal(u.shape)
    found = explore_records([(u, y)], step=STEP)
    assert found.model.names == ("K", "T", "L")
    deviations = (found.estimate.theta - [2.0, 6.0, 1.7]) / np.sqrt(np.diag(found.estimate.covariance))
    assert np.all(np.abs(deviations) < 4.0)
