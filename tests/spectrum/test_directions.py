"""The best directions of power at each frequency."""

import numpy as np
import pytest
import scipy.linalg

from inputdesign_cli.spectrum import Functional, directed_scale
from inputdesign_cli.spectrum.directions import best_directions, every_direction


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


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e-15, 1e9])
def test_ratios_do_not_depend_on_the_units_of_the_channels(unit):
    """v^* value v / v^* price v is the same for v and for the same input in another unit."""
    rng = np.random.default_rng(11)
    roots = rng.standard_normal((2, 5, 3, 3)) + 1j * rng.standard_normal((2, 5, 3, 3))
    price, value = roots @ roots.conj().swapaxes(2, 3)
    expected = np.array(
        [scipy.linalg.eigh(v, p, eigvals_only=True) for v, p in zip(value, price, strict=True)]
    )
    scale = np.diag([1.0, unit, 1.0])
    ratios, _ = every_direction(scale @ price @ scale, scale @ value @ scale)
    np.testing.assert_allclose(ratios, expected, rtol=1e-9)


def test_a_dear_channel_does_not_make_a_cheap_one_dearer():
    """By adding a share of what all cost to each, a bound on every spectrum was off by 2e6."""
    price, value = np.diag([1e30, 1.0])[None], np.diag([1e30, 2.0])[None]
    ratios, _ = best_directions(price, value)
    np.testing.assert_allclose(ratios, 2.0, rtol=1e-9)


@pytest.mark.parametrize("corner", [1e-4, 1e-2, 1.0])
@pytest.mark.parametrize("next_to_zero", [[], [1e-18], [2e-13], [3e-14, 1e-9]])
def test_the_best_frequency_beside_one_that_costs_nothing_has_a_price(corner, next_to_zero):
    """price w^2, value w^2 / (1 + (w / corner)^2): the best is w -> 0, wherever the grid has its points."""

    def functional(density):
        return Functional(np.zeros(1), density)

    price, value = functional(lambda w: w**2), functional(lambda w: w**2 / (1.0 + (w / corner) ** 2))
    grid = np.concatenate([[0.0], next_to_zero, np.geomspace(3e-6, np.pi, 400)])
    scale, peaks = directed_scale(price, value, grid)
    assert scale == pytest.approx(1.0, rel=1e-9)
    # As good as zero itself, and as dear as that allows.
    assert peaks[0] == pytest.approx(1e-5 * corner, rel=0.3)
