"""Single samples that decide what a record says are seen; noise of any usual kind is none."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.identification import spikes
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.identification.spikes import period_spikes


@settings(deadline=None, max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    scale=st.floats(-100, 100),
    where=st.sets(st.integers(0, 199), min_size=1, max_size=8),
    size=st.floats(20, 1e12),
)
def test_spikes_are_found_whatever_the_unit(seed, scale, where, size):
    """Of at least twenty standard deviations one in 200 holds more than half: 400 of 400 + 200."""
    rng = np.random.default_rng(seed)
    e = rng.normal(size=(200, 2))
    assert spikes(e) == []
    e[sorted(where), 1] += size * rng.choice([-1.0, 1.0], len(where)) * (1.0 + rng.random(len(where)))
    (found,) = spikes(10.0**scale * e)
    assert (found.output, set(found.samples)) == (1, where)
    rest = np.delete(e[:, 1], sorted(where))
    assert found.share == pytest.approx(1 - np.sum(rest**2) / np.sum(e[:, 1] ** 2), rel=1e-9)


@pytest.mark.parametrize("kind", ["normal", "laplace", "uniform", "logistic"])
@pytest.mark.parametrize("samples", [20, 100, 3000])
def test_noise_is_no_spike(kind, samples):
    rng = np.random.default_rng(7)
    assert not any(spikes(getattr(rng, kind)(size=(samples, 1))) for _ in range(300))


def test_what_is_frequent_or_without_spread_is_no_spike():
    e = np.random.default_rng(0).normal(size=(100, 1))
    e[:30:4] += 1e3  # eight of a hundred: an event, or a model that is wrong
    assert spikes(e) == []
    assert spikes(np.zeros((50, 1))) == []


@settings(deadline=None, max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    blocks=st.integers(1, 2),
    repeats=st.integers(1, 2),
    skip=st.integers(0, 1),
    where=st.sets(st.integers(0, 399), min_size=1, max_size=2),
    drift=st.floats(-10, 10),
)
def test_spikes_of_periods_are_found_whatever_the_period_holds(seed, blocks, repeats, skip, where, drift):
    """Not in the transient. The noise has a limit: of 60 examples none is to be far by chance."""
    rng = np.random.default_rng(seed)
    periods, samples = Periods(100, blocks=blocks, skip=skip), blocks * 600
    y = np.concatenate([np.tile(100.0 * rng.standard_normal(100), samples // 100) for _ in range(1)])
    y = np.tile(y, repeats) + rng.uniform(-1.0, 1.0, samples * repeats)
    y += np.repeat(drift * np.arange(samples * repeats // 100), 100)
    assert period_spikes(y[:, None], periods, repeats=repeats) == []
    at = sorted(100 * skip + x for x in where)
    y[at] += 200.0
    transient = {x for x in at if blocks == 2 and 600 <= x < 700 and skip}
    (found,) = period_spikes(y[:, None], periods, repeats=repeats)
    assert set(found.samples) == set(at) - transient
