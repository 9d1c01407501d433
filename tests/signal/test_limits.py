"""Limits on single samples hold exactly, whatever else is asked of the record."""

import numpy as np
import pytest
import scipy.linalg

from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.signal import levels
from inputdesign_cli.signal.constraints import (
    SignalConstraint,
    compressed,
    largest_move,
    restrained,
    slow_moves,
)
from inputdesign_cli.signal.evaluation import Target, first_level, last_level, least_level, level_of_power
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.lines import DesignedSpectrum, Lines
from inputdesign_cli.signal.selection import best_record
from inputdesign_cli.signal.settings import Quantiser, SignalSettings
from inputdesign_cli.spectrum import FirBasis
from tests.support.plants import arx
from tests.support.signals import of_two_inputs

COLOURED = np.array([1.0, 0.7, 0.3])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("rate", [0.01, 0.3, 2.0])
def test_slow_moves_are_half_way_between_the_lipschitz_envelopes(seed, rate):
    """The envelopes are written out over all pairs of samples."""
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


@pytest.mark.parametrize("known", [0.0, 0.3, 0.9, 0.999])
def test_the_least_level_is_found_over_twelve_decades(known):
    """ratio(a) = (m + g a^2)^-0.4 is one at a = sqrt((1 - m) / g). At some scales an end of the bracket is a
    root up to rounding.
    """
    for gain in 10.0 ** np.random.default_rng(0).uniform(-6, 6, 100):
        level = least_level(lambda a, g=gain: (known + g * a**2) ** -0.4, 1.0)
        assert level == pytest.approx(np.sqrt((1 - known) / gain), rel=1e-8)
        assert (known + gain * level**2) ** -0.4 <= 1.0 + 1e-12


def test_no_level_is_needed_where_enough_is_known():
    assert least_level(lambda a: (1.5 + a**2) ** -0.5, 1.0) < 1e-8


def test_the_last_level_that_holds_and_the_first_that_suffices_are_found():
    assert 0.3 >= last_level(lambda a: a <= 0.3, 1.0) == pytest.approx(0.3, rel=2e-3)
    assert first_level(lambda a: 3.0 / a, 1.0) == (pytest.approx(3.0, rel=2e-3), True)


def test_the_level_that_helps_most_is_found_if_none_suffices():
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


def test_the_level_of_a_given_power_is_found():
    assert level_of_power(lambda a: a**2, 4.0, 1.0) == pytest.approx(2.0, rel=2e-3)
    # Below half a step a converter gives nothing at all.
    assert level_of_power(lambda a: np.floor(a) ** 2, 4.0, 0.5) == pytest.approx(2.0, rel=2e-3)
    assert level_of_power(lambda a: min(a, 1.5) ** 2, 4.0, 1.0) >= 1.4


TARGET = Target(lambda M: float(np.sqrt(0.45 / np.linalg.eigvalsh(M)[0])), meets=True)
"""A condition on the information in white coordinates: its least eigenvalue is at least 0.45."""


SPECTRA = {
    1: DesignedSpectrum.of(FirBasis(1, 2), COLOURED),
    2: DesignedSpectrum(2, 13.1, density=of_two_inputs),
}
SETTINGS = {
    "noise": {},
    "random": {"method": "multisine", "phases": "random"},
    "multisine": {"method": "multisine"},
    "optimised": {"method": "multisine", "phases": "optimised"},
    "binary": {"method": "binary"},
    "ternary": {"method": "ternary"},
    "prbs": {"method": "prbs"},
    "white": {"method": "white"},
    "held": {"hold": 4},
    "periods": {"periods": 2},
    "ramp": {"ramp": 20},
}
CONVERTERS = {"noise": 8, "binary": 8, "held": 7}


def bounds_of(inputs, **figures):
    """Bounds of one input as given; two inputs have different units."""
    units = {"amplitude": [1.25, 3.1], "rate": [1.4, 3.5], "output": [0.6, 0.45]}
    scale = {key: np.ones(1) if inputs == 1 else np.array(units[key]) for key in figures}
    return Bounds(**{key: figure * scale[key] for key, figure in figures.items()})


LIMITS = {
    "amplitude": {"amplitude": 1.3},
    "rate": {"rate": 0.9},
    "both": {"amplitude": 1.4, "rate": 1.2},
    "output": {"output": 14.0},
    "all": {"amplitude": 1.4, "rate": 1.2, "output": 14.0},
}


def made(experiment, settings, bounds, candidates=2):
    """The plant and its best record, of as many samples as the experiment."""
    settings = SignalSettings(**settings, candidates=candidates, most_candidates=candidates)
    generator = SignalGenerator(SPECTRA[experiment.inputs], settings, experiment.samples)
    plant = FiniteRecord(experiment, experiment.samples)
    return plant, best_record(generator, plant, TARGET, bounds)


def check(experiment, settings, bounds):
    plant, record = made(experiment, settings, bounds)
    assert record.samples.shape == (experiment.samples, experiment.inputs)
    u, y = (plant.signals(kind, record.samples) for kind in ("input", "output"))
    if bounds.amplitude is not None:
        assert np.all(np.abs(u).max(axis=0) <= bounds.amplitude)
    if bounds.rate is not None:
        moves = np.array([largest_move(column) for column in u.T])
        assert np.all(moves <= bounds.rate * (1 + 1e-15))
    if bounds.output is not None:
        assert np.all(np.abs(y).max(axis=0) <= bounds.output)
    for quantiser, column in zip(bounds.quantisers, record.samples.T, strict=bool(bounds.quantisers)):
        steps = column / quantiser.step
        np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
        assert np.abs(column).max() <= quantiser.reach() + 1e-12
    blocks = record.samples.reshape(-1, settings.get("hold", 1), experiment.inputs)
    assert np.all(blocks == blocks[:, :1])
    attained = TARGET.worst_ratio(plant.information(record.samples))
    assert record.worst_ratio == pytest.approx(attained, rel=1e-12)
    assert record.met == (attained <= 1 + 1e-9)


@pytest.fixture(params=[1, 2], ids=["one input", "two inputs"])
def experiment(request, first_order):
    """The first-order system, or an ARX system of two inputs and outputs, in white coordinates."""
    if request.param == 1:
        return first_order.whitened(1.0)
    return Experiment(arx(), 240).whitened(1.0)


@pytest.mark.first(12)
@pytest.mark.parametrize("meets", [True, False])
@pytest.mark.parametrize("limited", [*LIMITS, "none"])
@pytest.mark.parametrize("kind", SETTINGS)
def test_values_that_are_zero_make_a_record_of_zeros(monkeypatch, experiment, kind, limited, meets):
    """A few samples may all be zeros of the sinusoids: no division by zero follows."""

    def ratio(information):
        return 0.45 / float(np.linalg.norm(np.linalg.cholesky(information), -2))

    def zeros(self, rngs):
        return np.zeros((len(rngs), self.samples // self.settings.hold, self.spectrum.inputs))

    monkeypatch.setattr(SignalGenerator, "several", zeros)
    bounds = bounds_of(experiment.inputs, **LIMITS.get(limited, {}))
    settings = SignalSettings(**SETTINGS[kind], candidates=2)
    generator = SignalGenerator(SPECTRA[experiment.inputs], settings, experiment.samples)
    target = Target(ratio, meets, {"output": 1.0}, least_ratios=lambda M: np.full(len(M), np.nan))
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        record = best_record(generator, FiniteRecord(experiment, experiment.samples), target, bounds)
    assert not record.samples.any()
    assert not (meets and record.met)


@pytest.mark.parametrize("kind", ["binary", "ternary"])
def test_levels_of_a_signal_of_zeros_are_finite(monkeypatch, kind):
    """The alternation may begin with a multisine of zeros."""
    monkeypatch.setattr(levels, "multisine_record", lambda lines, samples, *_, **__: np.zeros((samples, 1)))
    lines = Lines.of_period(np.ones((9, 1, 1), dtype=complex), 16)
    with np.errstate(divide="raise", invalid="raise"):
        found = levels.few_levels(lines, 16, np.random.default_rng(0), kind_of(kind).nearest)
    assert np.all(np.isfinite(found))


@pytest.mark.first(12)
@pytest.mark.parametrize("limited", LIMITS)
@pytest.mark.parametrize("kind", SETTINGS)
def test_limits_hold_exactly(experiment, kind, limited):
    check(experiment, SETTINGS[kind], bounds_of(experiment.inputs, **LIMITS[limited]))


@pytest.mark.first(4)
@pytest.mark.parametrize("limited", ["amplitude", "both", "output"])
@pytest.mark.parametrize("kind", CONVERTERS)
def test_quantised_records_keep_the_limits(experiment, kind, limited):
    bounds = bounds_of(experiment.inputs, **LIMITS[limited])
    quantisers = (Quantiser(CONVERTERS[kind], 4.0), Quantiser(CONVERTERS[kind], 10.0))[: experiment.inputs]
    check(
        experiment,
        SETTINGS[kind],
        Bounds(bounds.amplitude, bounds.rate, bounds.output, quantisers=quantisers),
    )


@pytest.mark.first(2)
@pytest.mark.parametrize("limits", [{"amplitude": 2.0}, {"rate": 2.5}, {"output": 2.5}])
@pytest.mark.parametrize("kind", ["noise", "optimised", "binary"])
def test_limits_in_closed_loop_apply_to_the_response_to_r(flexible, kind, limits):
    check(flexible.whitened(1.0), SETTINGS[kind], bounds_of(1, **limits))


def test_powers_of_each_channel_are_kept_below_their_limits(experiment):
    """The limit is below the power that the accuracy needs: the record uses it all and reports a miss."""
    last = experiment.inputs - 1
    bounds = Bounds(powers=(("input", last, 0.02), ("output", None, 50.0)))
    _, record = made(experiment, {"method": "multisine"}, bounds)
    assert not record.met
    assert np.mean(record.samples[:, last] ** 2) == pytest.approx(0.02)


@pytest.mark.parametrize("returns", [False, True])
def test_a_record_within_its_limits_is_the_nearest_and_returns_if_asked(returns):
    """A quadratic program agrees; the output of a lag must stay below half of its unlimited peak."""
    import cvxpy as cp

    wanted = np.random.default_rng(0).standard_normal((60, 1))
    wanted[-1] = 0.0 if returns else wanted[-1]
    matrix = scipy.linalg.toeplitz(0.5 * 0.8 ** np.arange(60), np.zeros(60))
    bound = 0.5 * np.abs(matrix @ wanted).max()
    limit = SignalConstraint(lambda u: matrix @ u, lambda w: matrix.T @ w, np.array([bound]))
    found = restrained(wanted, (limit,), returns=returns)
    assert np.abs(matrix @ found).max() <= bound
    assert not returns or found[-1, 0] == 0.0
    u = cp.Variable(60)
    within = [cp.abs(matrix @ u) <= bound, *([u[-1] == 0.0] if returns else [])]
    least = cp.Problem(cp.Minimize(cp.sum_squares(u - wanted[:, 0])), within).solve(solver=cp.CLARABEL)
    assert np.sum((found - wanted) ** 2) <= 1.05 * least
