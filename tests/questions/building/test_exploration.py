"""Plants in s that were found in a log come back from the words of the spec that is written."""

import numpy as np
import pytest
import yaml

from inputdesign_cli.explore.structures import Process, process_models
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import noise_gradients
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import parse_spec


@pytest.mark.parametrize("outputs", [1, 2])
@pytest.mark.parametrize("noise", [0, 2])
@pytest.mark.parametrize(("order", "zero"), [(1, False), (2, False), (2, True), (3, False)])
def test_words_of_a_process_are_read_as_the_same_model(order, zero, noise, outputs):
    rng = np.random.default_rng(order)
    rows, thetas = [], []
    for _ in range(outputs):
        process = Process((1,) * outputs, order, 0.5, zero, noise)
        plant = rng.uniform(0.6, 1.4, process.size - 2 * noise)
        rows.append(process)
        thetas.append(np.concatenate([plant, rng.uniform(-0.3, 0.3, 2 * noise)]))
    model = process_models(rows, thetas, np.diag(rng.uniform(0.5, 1.0, outputs)))
    text = yaml.safe_dump({"sample_time": 0.5, **blocks_of(model)}, sort_keys=False)
    read = build_model(parse_spec(text, design=False))
    assert read.names == model.names
    np.testing.assert_allclose(read.theta, model.theta, rtol=1e-12)
    w = np.array([0.01, 0.5, 2.0])
    np.testing.assert_allclose(read.plant_at(w), model.plant_at(w), rtol=1e-10)
    np.testing.assert_allclose(
        noise_gradients([read], w)[0], noise_gradients([model], w)[0], rtol=1e-10, atol=1e-12
    )
