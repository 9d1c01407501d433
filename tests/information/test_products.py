"""Weighted products of gradients against their definition, also of nothing and at no frequency."""

import numpy as np
import pytest

from inputdesign_cli.information.experiment import WeightedProducts


@pytest.mark.parametrize("frequencies", [0, 1, 300])
@pytest.mark.parametrize("inputs", [1, 2])
@pytest.mark.parametrize("silent", [(), (0,), (0, 1)])
def test_they_are_the_sums_over_outputs(frequencies, inputs, silent):
    rng = np.random.default_rng(3)
    F = rng.standard_normal((frequencies, 4, 2, inputs, 2)) @ np.array([1.0, 1.0j])
    F[:, 2, 1] = 0.0
    F[:, :, list(silent)] = 0.0
    w, Y = np.arange(frequencies, dtype=float), np.diag([1.0, 2.0, 3.0, 4.0]) + 0.5
    got = WeightedProducts.of(lambda at: F[at.astype(int)], w).at(Y)
    assert got.shape == (frequencies, inputs, inputs)
    np.testing.assert_allclose(got, np.einsum("nkpa,kl,nlpb->nab", F.conj(), Y, F), atol=1e-12)
