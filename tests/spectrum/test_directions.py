"""The best directions of power at each frequency."""

import numpy as np
import scipy.linalg

from inputdesign_cli.spectrum.directions import best_directions


def test_each_frequency_is_judged_by_itself_and_one_without_a_price_is_left_out():
    rng = np.random.default_rng(5)
    half = rng.standard_normal((6, 2, 3, 2)) @ np.array([1.0, 1.0j])
    price, value = (np.einsum("nij,nkj->nik", h, h.conj()) for h in (half, half[::-1]))
    price[0] = 0.0
    ratios, directions = best_directions(price, value)
    assert ratios[0] == -np.inf
    for n in range(6):
        ratio, direction = best_directions(price[[n]], value[[n]])
        assert ratio[0] == ratios[n]
        np.testing.assert_allclose(np.abs(direction[0] @ directions[n].conj()), 1.0)
    expected = [scipy.linalg.eigh(value[n], price[n], eigvals_only=True)[-1] for n in range(1, 6)]
    np.testing.assert_allclose(ratios[1:], expected, rtol=1e-9)
