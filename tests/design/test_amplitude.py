"""Forms of a few lags over signals within an amplitude, against enumeration and closed forms."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.amplitude.polytope import LagPolytope
from inputdesign_cli.design.amplitude.windows import Windows, weighted


def _form_of(record: Array, form: Array) -> float:
    """Return sum u_t^T Q_0 u_t + 2 sum u_t^T Q_k u_(t-k), term by term."""
    total = 0.0
    for t in range(len(record)):
        for lag in range(min(len(form), t + 1)):
            total += (1.0 if lag == 0 else 2.0) * record[t] @ form[lag] @ record[t - lag]
    return float(total)


def _random_form(length: int, inputs: int, seed: int) -> Array:
    form = np.random.default_rng(seed).standard_normal((length, inputs, inputs))
    form[0] = form[0] @ form[0].T
    return form


@pytest.mark.parametrize(
    ("inputs", "length", "samples"), [(1, 2, 5), (1, 4, 11), (1, 9, 6), (1, 5, 1), (2, 3, 5)]
)
def test_largest_sum_is_that_of_all_records(inputs: int, length: int, samples: int) -> None:
    windows = Windows.within(np.array([1.5, 0.5])[:inputs], length)
    form = _random_form(length, inputs, length)
    largest, record = windows.largest_sum(form, samples)
    every = [_form_of(np.array(letters), form) for letters in product(windows.letters, repeat=samples)]
    assert largest == pytest.approx(max(every), rel=1e-12)
    assert _form_of(record, form) == pytest.approx(largest, rel=1e-12)


def test_values_between_the_ends_of_the_range_gain_nothing() -> None:
    windows, form = Windows.within(np.ones(1), 4), _random_form(4, 1, 0)
    three = Windows(np.array([[-1.0], [0.2], [1.0]]), 4)
    assert three.largest_sum(form, 9)[0] == pytest.approx(windows.largest_sum(form, 9)[0], rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_no_cycle_has_a_larger_mean(seed: int) -> None:
    windows, form = Windows.within(np.ones(1), 3), _random_form(3, 1, seed)
    bound, cycle, _ = windows.largest_mean(form)
    means = [
        float(np.sum(weighted(form) * windows.lags(np.array(letters))))
        for period in range(1, 9)  # four states: the best cycle is no longer than four
        for letters in product(windows.letters, repeat=period)
    ]
    assert max(means) <= bound * (1.0 + 1e-12) + 1e-12
    assert float(np.sum(weighted(form) * windows.lags(cycle))) == pytest.approx(max(means), rel=1e-6)


@pytest.mark.parametrize(("c1", "c2"), [(0.3, -0.2), (-0.8, 0.1), (0.5, -0.9), (0.9, 0.9)])
def test_gauge_of_three_lags_is_the_known_polytope(c1: float, c2: float) -> None:
    """Three signs have s_1 s_2 + s_2 s_3 + s_1 s_3 >= -1, so that 1 + c_2 >= 2 |c_1|; and |c_2| <= 1."""
    polytope = LagPolytope(Windows.within(np.array([2.0]), 3))
    multiple, face = polytope.gauge(4.0 * np.array([1.0, c1, c2]).reshape(3, 1, 1))
    # The least c_0 / a^2 with c_0 + c_2 >= 2 |c_1| and c_0 >= |c_2|, c_0 >= 1.
    assert multiple == pytest.approx(max(1.0, 2.0 * abs(c1) - c2, abs(c2)), rel=1e-9)
    assert face.share == pytest.approx(multiple, rel=1e-4)


def test_no_signal_exceeds_a_face() -> None:
    rng = np.random.default_rng(3)
    polytope = LagPolytope(Windows.within(np.array([1.0, 2.0]), 4))
    w = 0.7
    lags = np.array([np.cos(k * w) * np.array([[1.0, 1.0], [1.0, 4.0]]) for k in range(4)])
    multiple, face = polytope.gauge(lags)
    assert multiple > 1.1
    for _ in range(200):
        signal = polytope.windows.letters[rng.integers(4, size=int(rng.integers(1, 30)))]
        assert np.sum(weighted(face.form) * polytope.windows.lags(signal)) <= 1.0 + 1e-9


def test_longer_windows_know_more() -> None:
    lags = np.cos(0.4 * np.arange(8)).reshape(8, 1, 1)
    short = LagPolytope(Windows.within(np.ones(1), 3))
    multiple, _ = short.gauge(lags[:3])
    longer, face = short.longer(8).gauge(lags)
    assert longer >= multiple
    assert face.share == pytest.approx(longer, rel=1e-4)
