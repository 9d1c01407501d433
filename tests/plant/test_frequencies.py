"""Grids resolve resonances; maxima are found where calculus puts them."""

import numpy as np
import pytest

from inputdesign_cli.plant import graded_grid, local_maxima, logarithmic_distance
from inputdesign_cli.plant.polynomial import roots_in_z


def test_grid_resolves_a_lightly_damped_pole():
    radius, angle = 0.99999, 1.234
    grid = graded_grid(logarithmic_distance([radius * np.exp(1j * angle)]), 0.0, np.pi)
    near = grid[np.abs(grid - angle) < 1e-5]
    assert near.size > 20
    assert grid[0] == 0.0
    assert grid[-1] == np.pi


# Functions, grids, the places of the maxima, and tolerances on the places and the values.
MAXIMA = {
    # -7 sin(7 w) + 0.2 = 0 next to each maximum of the cosine
    "smooth": (
        lambda w: np.cos(7 * w) + 0.2 * w,
        np.linspace(0, np.pi, 60),
        [(2 * np.pi * k + np.arcsin(0.2 / 7)) / 7 for k in range(4)],
        1e-6,
        1e-12,
    ),
    "twin peaks between neighbouring grid points": (
        lambda w: 1 / (1 + ((w - 1.000) / 2e-3) ** 2) + 1.01 / (1 + ((w - 1.009) / 2e-3) ** 2),
        np.linspace(0, 2, 401),
        [1.000, 1.009],
        1e-3,
        1e-2,
    ),
    "kink": (lambda w: -np.abs(w - 0.3333), np.linspace(0, 1, 11), [0.3333], 1e-6, 1e-6),
    # A ratio r_u over r_adm has kinks as steep as this one where r_adm nearly vanishes.
    "steep kink": (
        lambda w: 1.0 / (1.0 + 1e4 * np.abs(w - 0.245528)),
        graded_grid([], 0.0, np.pi),
        [0.245528],
        1e-6,
        1e-8,
    ),
    # Ripples of 1e-9 are no rounding: all of them are found, whatever stands beside them.
    "ripples": (
        lambda w: 1.0 + 1e-9 * np.cos(20.0 * w) + np.where(w > 2.0, w - 2.0, 0.0),
        np.linspace(0.0, 2.5, 3001),
        [*(np.pi / 10 * k for k in range(7)), 2.5],
        1e-4,
        1e-12,
    ),
}


@pytest.mark.parametrize(("function", "grid", "exact", "apart", "off"), MAXIMA.values(), ids=MAXIMA)
def test_maxima_are_where_calculus_puts_them(function, grid, exact, apart, off):
    w, values = local_maxima(function, grid, function(grid))
    np.testing.assert_allclose(w, exact, atol=apart)
    np.testing.assert_allclose(values, function(np.array(exact)), rtol=0.0, atol=off)


@pytest.mark.parametrize("end", [0.0, np.pi])
def test_a_maximum_at_an_end_is_reported_at_that_end(end):
    """cos(w) and its mirror are flat at 0 and pi: their values at 1e-9 and 0 are rounded alike."""

    def function(w):
        return 1.0 + np.cos(w - end)

    grid = np.union1d(np.geomspace(1e-6, np.pi, 50), [0.0])
    at, value = local_maxima(function, grid, function(grid))
    assert at.tolist() == [end]
    assert value.tolist() == [2.0]


@pytest.mark.parametrize("noise", [0.0, 3e-15, 2e-13])
def test_a_function_that_is_flat_but_for_rounding_has_one_maximum(noise):
    rng = np.random.default_rng(1)
    calls = []

    def function(w):
        calls.append(w.size)
        return 2.0 * (1.0 + noise * rng.uniform(-1.0, 1.0, w.size))

    grid = np.linspace(0.0, np.pi, 4000)
    w, values = local_maxima(function, grid, function(grid))
    assert len(w) == 1
    assert values[0] == pytest.approx(2.0, rel=1e-12)
    assert sum(calls[1:]) < 200


@pytest.mark.parametrize(
    ("coefficients", "roots"),
    [
        ([1.0], []),
        ([0.0, 0.0], []),
        ([1.0, -0.7], [0.7]),
        ([0.0, 2.0, 1.0, 0.0], [-0.5]),
        ([1.0, -1.5, 0.56], [0.7, 0.8]),
    ],
)
def test_roots_in_z_do_not_count_delays(coefficients, roots):
    found = roots_in_z(coefficients)
    np.testing.assert_allclose(np.sort(found.real), roots, rtol=1e-12)
    np.testing.assert_array_equal(found.imag, 0.0)


@pytest.mark.first(8)
@pytest.mark.parametrize("seed", range(20))
def test_a_level_just_below_a_maximum_does_not_hide_it(seed):
    """|B/A| with poles near the circle, on a coarse grid that rises to within 5 % of every maximum."""
    rng = np.random.default_rng(seed)
    poles = rng.uniform(0.7, 0.93, 3) * np.exp(1j * rng.uniform(0.1, 3.0, 3))
    zeros = rng.normal(size=(1, 4))

    def function(w):
        q = np.exp(-1j * np.asarray(w))
        below = np.prod((1 - np.outer(q, poles)) * (1 - np.outer(q, poles.conj())), axis=1)
        return np.abs(q[:, None] ** np.arange(4) @ zeros[0]) / np.abs(below)

    grid = np.linspace(0.0, np.pi, 120)
    dense = np.linspace(0.0, np.pi, 400_001)
    top = function(dense).max()
    assert function(grid).max() > 0.95 * top
    for share in (0.95, 0.99, 0.999, 0.99999):
        _, values = local_maxima(function, grid, function(grid), above=share * top)
        assert values.max() == pytest.approx(top, rel=1e-8)
    assert local_maxima(function, grid, function(grid), above=1.0001 * top)[0].size == 0
