"""Limits on single samples hold exactly, whatever else is asked of the record."""

import numpy as np
import pytest

from inputdesign_cli.signal import (
    Bounds,
    Quantiser,
    SignalSettings,
    Target,
    input_and_output,
    largest_move,
    realise,
    record_information,
)
from inputdesign_cli.signal.constraints import compressed, slow_moves
from inputdesign_cli.signal.level_search import first_level, last_level, least_level, level_of_power
from inputdesign_cli.spectrum import FirBasis

COLOURED = np.array([1.0, 0.7, 0.3])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("rate", [0.01, 0.3, 2.0])
def test_slow_moves_against_the_definition(seed, rate):
    """Half way between the Lipschitz envelopes, written out over all pairs of samples."""
    values = np.random.default_rng(seed).normal(size=80)
    found = slow_moves(values, rate)
    assert largest_move(found) <= rate * (1 + 1e-12)
    distance = rate * np.abs(np.arange(80)[:, None] - np.arange(80))
    middle = 0.5 * ((values - distance).max(axis=1) + (values + distance).min(axis=1))
    reach = rate * np.arange(1, 81)
    np.testing.assert_allclose(found, np.clip(middle, -reach, reach), atol=1e-12)


def test_compression_keeps_the_periodogram():
    values = np.random.default_rng(0).normal(size=400)
    found = compressed(values, 1.5)
    np.testing.assert_allclose(np.abs(np.fft.rfft(found)), np.abs(np.fft.rfft(values)), rtol=1e-9)
    assert np.abs(found).max() < 0.75 * np.abs(values).max()


def test_least_level_with_and_without_prior_knowledge():
    """ratio(a) = 1 / sqrt(m + a^2 g) has the root sqrt((1 - m) / g)."""
    for known in (0.0, 0.3, 0.999):
        level = least_level(lambda a, m=known: (m + 2.0 * a**2) ** -0.5, 1.0)
        assert level == pytest.approx(np.sqrt((1 - known) / 2), rel=1e-8)
        assert (known + 2.0 * level**2) ** -0.5 <= 1.0 + 1e-12


@pytest.mark.parametrize("known", [0.0, 0.9])
def test_least_level_of_any_size(known):
    """The same root over twelve decades, where the ends of a bracket are roots up to rounding."""
    for gain in 10.0 ** np.random.default_rng(0).uniform(-6, 6, 200):
        level = least_level(lambda a, g=gain: (known + g * a**2) ** -0.4, 1.0)
        assert level == pytest.approx(np.sqrt((1 - known) / gain), rel=1e-8)


def test_no_level_is_needed_where_enough_is_known():
    assert least_level(lambda a: (1.5 + a**2) ** -0.5, 1.0) < 1e-8


def test_last_level():
    assert last_level(lambda a: a <= 0.3, 1.0) == pytest.approx(0.3, rel=2e-3)
    assert last_level(lambda a: a <= 0.3, 1.0) <= 0.3


def test_first_level():
    assert first_level(lambda a: 3.0 / a, 1.0) == (pytest.approx(3.0, rel=2e-3), True)


def test_a_level_that_helps_most():
    """Raising the level gains nothing beyond 4, and it is found without going to the end."""
    tried = []

    def figure(a):
        tried.append(a)
        return 3.0 / min(a, 4.0) + 0.5

    level, met = first_level(figure, 1.0)
    assert not met
    assert figure(level) == pytest.approx(1.25, rel=1e-2)
    assert max(tried) < 10.0
    assert first_level(lambda a: np.inf, 1.0)[1] is False


def test_a_level_of_some_power():
    assert level_of_power(lambda a: a**2, 4.0, 1.0) == pytest.approx(2.0, rel=2e-3)
    # Below half a step a converter gives nothing at all.
    assert level_of_power(lambda a: np.floor(a) ** 2, 4.0, 0.5) == pytest.approx(2.0, rel=2e-3)
    assert level_of_power(lambda a: min(a, 1.5) ** 2, 4.0, 1.0) >= 1.4


def demand():
    """A condition on the information in white coordinates: its least eigenvalue is at least one half."""
    return Target(lambda M: float(np.sqrt(0.5 / np.linalg.eigvalsh(M)[0])), meets=True)


RECIPES = {
    "noise": SignalSettings(candidates=3),
    "random": SignalSettings(method="multisine", candidates=3),
    "optimised": SignalSettings(method="multisine", phases="optimised", candidates=2),
    "binary": SignalSettings(method="binary", candidates=3),
    "ternary": SignalSettings(method="ternary", candidates=3),
    "prbs": SignalSettings(method="prbs", candidates=3),
    "white": SignalSettings(method="white", candidates=3),
    "held": SignalSettings(hold=4, candidates=3),
    "periods": SignalSettings(periods=2, candidates=3),
    "ramp": SignalSettings(ramp=20, candidates=3),
    "converter": SignalSettings(candidates=3, quantiser=Quantiser(8, 4.0)),
    "binary converter": SignalSettings(method="binary", candidates=3, quantiser=Quantiser(8, 4.0)),
    "held converter": SignalSettings(candidates=3, hold=2, quantiser=Quantiser(7, 4.0)),
}
BOUNDS = {
    "amplitude": Bounds(amplitude=1.3),
    "rate": Bounds(rate=0.9),
    "both": Bounds(amplitude=1.4, rate=1.2),
    "output": Bounds(output=14.0),
    "all": Bounds(amplitude=1.4, rate=1.2, output=14.0),
}


@pytest.mark.parametrize("limited", BOUNDS)
@pytest.mark.parametrize("kind", RECIPES)
def test_limits_hold_exactly(first_order, kind, limited):
    check(first_order.whitened(1.0), RECIPES[kind], BOUNDS[limited])


@pytest.mark.parametrize("limited", ["amplitude", "rate", "output"])
@pytest.mark.parametrize("kind", ["noise", "optimised", "binary"])
def test_limits_in_closed_loop_are_those_of_what_r_causes(flexible, kind, limited):
    bounds = {"amplitude": Bounds(amplitude=2.0), "rate": Bounds(rate=2.5), "output": Bounds(output=2.5)}
    check(flexible.whitened(1.0), RECIPES[kind], bounds[limited])


def check(experiment, recipe, bounds):
    record = realise(
        experiment, FirBasis(2), COLOURED, demand(), recipe, samples=experiment.samples, bounds=bounds
    )
    u, y = input_and_output(experiment, record.samples)
    if bounds.amplitude is not None:
        assert np.abs(u).max() <= bounds.amplitude
    if bounds.rate is not None:
        assert largest_move(u) <= bounds.rate * (1 + 1e-15)
    if bounds.output is not None:
        assert np.abs(y).max() <= bounds.output
    if recipe.quantiser is not None:
        codes = record.samples / recipe.quantiser.step
        np.testing.assert_allclose(codes, np.rint(codes), atol=1e-9)
        assert np.abs(record.samples).max() <= recipe.quantiser.room() + 1e-12
    blocks = record.samples.reshape(-1, recipe.hold)
    assert np.all(blocks == blocks[:, :1])
    attained = demand().worst_ratio(record_information(experiment, record.samples))
    assert record.worst_ratio == pytest.approx(attained, rel=1e-12)
    assert record.met == (attained <= 1 + 1e-9)


def test_a_looser_limit_never_costs_more(first_order):
    """The cheapest record within the limit, from 1.0 (clipped hard) to none."""
    experiment = first_order.whitened(1.0)
    costs = []
    for amplitude in (1.0, 1.3, 2.0, None):
        record = realise(
            experiment,
            FirBasis(2),
            COLOURED,
            demand(),
            SignalSettings(candidates=5),
            samples=500,
            bounds=Bounds(amplitude=amplitude),
        )
        assert record.met
        costs.append(np.mean(record.samples**2))
    assert costs[0] * 1.02 > costs[-1]
    assert max(costs) < 1.5 * min(costs)


def test_powers_are_kept_below_their_limits(first_order):
    """With less power than the accuracy needs the record takes what there is and says so."""
    experiment = first_order.whitened(1.0)
    short = Bounds(powers=(("input", 0.1),))
    record = realise(
        experiment, FirBasis(2), COLOURED, demand(), SignalSettings(candidates=3), samples=500, bounds=short
    )
    assert not record.met
    assert np.mean(record.samples**2) == pytest.approx(0.1)
