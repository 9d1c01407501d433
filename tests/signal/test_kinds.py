"""Kinds of signals: their levels, lines, crest factors, and laws that each must obey."""

import numpy as np
import pytest

from inputdesign_cli.signal import (
    Quantiser,
    SignalSettings,
    Sinusoids,
    crest_factor,
    line_powers,
    optimise_phases,
    select,
)
from inputdesign_cli.signal.constraints import compressed
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.levels import pseudo_random, register_length, three_level, two_level
from inputdesign_cli.signal.spectral_factor import autocorrelation
from inputdesign_cli.spectrum import FirBasis, LinesBasis

COLOURED = autocorrelation(np.array([1.0, 0.9, 0.6, 0.3]))


def flat(lines, samples):
    power = np.zeros(samples // 2 + 1)
    power[1 : lines + 1] = 1.0 / lines
    return Sinusoids.on_grid(power, samples)


def periodogram(x):
    power = np.abs(np.fft.rfft(x) / x.size) ** 2
    power[1 : (x.size + 1) // 2] *= 2
    return power


def rng(seed=0):
    return np.random.default_rng(seed)


def test_slopes_are_those_of_the_record():
    """Finite differences, on and off the grid, with a filter in between."""
    gains = np.exp(1j * np.linspace(0, 3, 5)) * np.linspace(1, 2, 5)
    for lines in (flat(5, 32), Sinusoids(np.array([0.0, 0.3, 1.0, 2.2, np.pi]), np.ones(5), 32)):
        phases, weight = lines.random_phases(rng()), rng(1).normal(size=32)
        found = lines.slopes(phases, weight, gains)
        for i in np.flatnonzero(~lines.real):
            step = 1e-6 * np.eye(5)[i]
            change = lines.record(phases + step, gains) - lines.record(phases - step, gains)
            assert found[i] == pytest.approx(weight @ change / 2e-6, rel=1e-6, abs=1e-7)


def test_both_ways_to_sum_sinusoids_agree():
    on = flat(7, 40)
    off = Sinusoids(on.frequencies, on.powers, 40)
    phases = on.random_phases(rng())
    np.testing.assert_allclose(on.record(phases), off.record(phases), atol=1e-13)


def test_schroeder_phases_of_a_flat_multisine_are_his():
    """phi_n = phi_1 - pi n (n - 1) / L up to a delay: second differences are -2 pi / L."""
    lines = flat(31, 256)
    second = np.diff(lines.schroeder_phases(), 2)
    np.testing.assert_allclose(second[1:], -2 * np.pi / 31, atol=1e-12)


@pytest.mark.parametrize("samples", [512, 1024])
def test_crest_factor_of_64_flat_lines(samples):
    """At most 1.42, where Schroeder's phases give 1.7 and random ones 3; the lines keep their powers."""
    lines = flat(64, samples)
    phases = optimise_phases(lines, lines.schroeder_phases())
    record = lines.record(phases)
    assert crest_factor(record) < 1.42
    np.testing.assert_allclose(periodogram(record)[1:65], 1 / 64, rtol=1e-12)
    random = [crest_factor(lines.record(lines.random_phases(rng(seed)))) for seed in range(20)]
    assert np.median(random) > 2.7
    assert crest_factor(lines.record(lines.schroeder_phases())) > 1.6


@pytest.mark.parametrize("count", [15, 31])
def test_crest_factors_of_classical_cases_beat_the_published_constructions(count):
    """Schroeder's phases, Newman's, and clip and restore from five random starts."""
    lines = flat(count, 16 * count)
    starts = [lines.random_phases(rng(seed)) for seed in range(5)]
    found = min(crest_factor(lines.record(optimise_phases(lines, start))) for start in starts)
    newman = np.pi * np.arange(count) ** 2 / count
    clipped = [compressed(lines.record(start), 1.3) for start in starts]
    others = [lines.record(lines.schroeder_phases()), lines.record(newman), *clipped]
    assert found < min(crest_factor(record) for record in others)
    assert found < 1.42


def test_crest_factor_of_several_signals_at_once():
    """Input and output of a resonance: neither alone decides, and the joint peak falls by a third."""
    lines = flat(40, 512)
    gains = 1 / (1 - 1.8 * np.exp(-1j * lines.frequencies) + 0.9 * np.exp(-2j * lines.frequencies))
    both = (np.ones(40, dtype=complex), gains / np.sqrt(np.mean(np.abs(gains) ** 2)))
    start = lines.random_phases(rng())

    def peak(phases):
        return max(np.abs(lines.record(phases, g)).max() for g in both)

    assert peak(optimise_phases(lines, start, gains=both)) < 0.66 * peak(start)


@pytest.mark.parametrize("chosen", ["odd", 8, (1, 5, 9, 20)])
def test_selected_lines_keep_the_power_and_exclude_the_others(chosen):
    power = line_powers(FirBasis(3).density(COLOURED, 2 * np.pi * np.arange(33) / 64), 64)
    gathered = select(power, chosen)
    assert gathered.sum() == pytest.approx(power.sum(), rel=1e-12)
    used = np.flatnonzero(gathered)
    if chosen == "odd":
        assert set(used) == set(range(1, 33, 2))
    else:
        assert used.size == (8 if chosen == 8 else 4)


@pytest.mark.parametrize(("make", "values"), [(two_level, {-1.0, 1.0}), (three_level, {-1.0, 0.0, 1.0})])
def test_levels_and_their_spectrum(make, values):
    """Few levels only, and a spectrum nearer to the wanted one than that of the signs of noise."""
    samples = 512
    power = line_powers(FirBasis(3).density(COLOURED, 2 * np.pi * np.arange(257) / samples), samples)

    def misfit(x):
        found = np.sqrt(periodogram(x))
        wanted = np.sqrt(power)
        return 1 - (found @ wanted) ** 2 / (found @ found) / (wanted @ wanted)

    lines = Sinusoids.on_grid(power, samples)
    record = make(lines, rng())
    assert set(np.unique(record)) <= values
    signs = [misfit(np.sign(lines.record(lines.random_phases(rng(seed))))) for seed in range(10)]
    assert misfit(record) < 0.35 * min(signs)


@pytest.mark.parametrize("bits", [2, 5, 9])
def test_maximum_length_sequences_are_white(bits):
    """Circular autocorrelations of -1/n at every lag."""
    n = 2**bits - 1
    x = pseudo_random(bits, n, rng())
    found = np.fft.irfft(np.abs(np.fft.rfft(x)) ** 2, n) / n
    np.testing.assert_allclose(found[1:], -1 / n, atol=1e-12)
    assert register_length(n) == bits
    np.testing.assert_array_equal(pseudo_random(bits, 2 * n, rng())[n:], x)


def test_quantiser():
    converter = Quantiser(bits=3, span=4.0, offset=1.4)  # values -4, -3, .., 3
    assert converter.step == 1.0
    assert converter.operating_point == 1.0
    np.testing.assert_array_equal(converter.codes(np.array([-9.0, -0.4, 0.6, 9.0])), [-5, 0, 1, 2])
    assert converter.room() == 2.0


KINDS = ["filtered_noise", "multisine", "binary", "ternary", "prbs", "white"]


@pytest.mark.parametrize("method", KINDS)
@pytest.mark.parametrize("basis", ["fir", "lines"])
def test_periods_and_hold(method, basis):
    """Three equal periods of 20 values, each held four times."""
    recipe = SignalSettings(method=method, periods=3, hold=4, phases="random")
    spectrum = (FirBasis(3), COLOURED) if basis == "fir" else (LinesBasis(np.array([0.2, 0.9])), np.ones(2))
    values = SignalGenerator(*spectrum, recipe, 240).values(rng())
    assert values.shape == (60,)
    np.testing.assert_array_equal(values[:20], values[20:40])
    np.testing.assert_array_equal(values[:20], values[40:])
    assert np.ptp(values) > 0


def test_the_hold_is_compensated():
    """Up to pi / hold the held record has the designed density."""
    recipe = SignalSettings(method="multisine", hold=4)
    held = np.repeat(SignalGenerator(FirBasis(3), COLOURED, recipe, 4000).values(rng()), 4)
    w = 2 * np.pi * np.arange(2001) / 4000
    low = slice(1, 450)
    wanted = FirBasis(3).density(COLOURED, w)
    np.testing.assert_allclose((periodogram(held) * 4000 / 2)[low], wanted[low], rtol=1e-9)


def test_the_ramp_fades_in_and_out():
    recipe = SignalSettings(ramp=10, method="white")
    values = SignalGenerator(FirBasis(0), np.ones(1), recipe, 100).values(rng())
    plain = SignalGenerator(FirBasis(0), np.ones(1), SignalSettings(method="white"), 100).values(rng())
    share = values / plain
    np.testing.assert_array_equal(share[10:90], 1.0)
    assert np.all(np.diff(share[:11]) > 0)
    np.testing.assert_allclose(share, share[::-1])
    assert 0 < share[0] < 0.05
