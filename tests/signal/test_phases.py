"""Phases of low crest factors: of one record, and of all inputs, periods and outputs at once."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.signal.constraints import compressed
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.lines import DesignedSpectrum, Lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.phases import crest_factor, low_peak_phases, optimise_phases, schroeder_phases
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.signal.sinusoids import Sinusoids
from inputdesign_cli.spectrum import LinesBasis
from tests.support.signals import periodogram


def flat(lines, samples):
    power = np.zeros(samples // 2 + 1)
    power[1 : lines + 1] = 1.0 / lines
    return Sinusoids.on_grid(power, samples)


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


def coloured(lines, period):
    """Correlated inputs of different powers."""
    rng = np.random.default_rng(0)
    roots = rng.normal(size=(lines, 2, 2)) + 1j * rng.normal(size=(lines, 2, 2))
    powers = roots @ roots.conj().swapaxes(1, 2) * np.array([[1.0, 0.3], [0.3, 0.09]])
    return Lines(2 * np.pi * np.arange(1, lines + 1) / period, powers, period)


def test_low_peaks_of_all_inputs_and_periods_at_once():
    lines, rng = coloured(40, 256), np.random.default_rng(1)
    start = 2 * np.pi * rng.random(40)
    rms = np.sqrt(lines.mean_squares)

    def crest(angles):
        record = multisine_record(lines, 512, rng, "orthogonal", angles=angles)
        np.testing.assert_allclose(np.sqrt(np.mean(record**2, axis=0)), rms, rtol=1e-9)
        return (np.abs(record).max(axis=0) / rms).max()

    assert crest(low_peak_phases(lines, 512, start)) < 0.75 * crest(start)
    assert np.isfinite(crest(schroeder_phases(lines, 512)))


def test_weights_of_the_inputs():
    """An input that may reach little is kept low at the expense of the other."""
    lines, rng = coloured(40, 256), np.random.default_rng(1)
    start = 2 * np.pi * rng.random(40)
    rms = np.sqrt(lines.mean_squares)
    peaks = []
    for weight in (1.0, 3.0):
        limited = [
            (np.tile(unit, (40, 1)), size) for unit, size in zip(np.eye(2), rms * [1.0, weight], strict=True)
        ]
        angles = low_peak_phases(lines, 512, start, limited=limited)
        peaks.append(np.abs(multisine_record(lines, 512, rng, "orthogonal", angles=angles)).max(axis=0))
    assert peaks[1][0] < peaks[0][0]


@pytest.mark.first(2)
@pytest.mark.parametrize("method", ["multisine", "binary", "ternary", "filtered_noise"])
@pytest.mark.parametrize("samples", [1, 2, 3, 5])
def test_records_of_fewer_samples_than_lines_are_numbers(method, samples):
    """Phases of many lines can make all of a few samples zero: nothing is divided by what that leaves."""
    spectrum = DesignedSpectrum.of(LinesBasis.at(np.pi * np.arange(1, 61) / 60, 1), np.ones(60))
    for seed in range(80, 100):
        kind = SignalSettings(method, phases="optimised" if method == "multisine" else "random")
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
        with np.errstate(divide="raise", invalid="raise", over="raise"):
            values = SignalGenerator(spectrum, kind, samples).values(rng)
        assert np.all(np.isfinite(values))


def test_a_record_of_zeros_has_a_crest_factor():
    assert crest_factor(np.zeros(4)) == 1.0
    assert crest_factor(np.array([1.0, -1.0])) == 1.0


@settings(deadline=None, max_examples=12)
@given(repeats=st.integers(4, 90), times=st.integers(2, 300), data=st.data())
def test_phases_of_lines_that_repeat_are_chosen_over_one_repetition(repeats, times, data):
    """The harmonics of a short period give the same signal again and again."""
    first = data.draw(st.integers(1, max(repeats // 4, 1)))
    harmonics = np.arange(first, repeats // 2 + 1)
    lines = Lines(2.0 * np.pi * harmonics / repeats, np.ones((harmonics.size, 1, 1), dtype=complex))
    seen, plain = [], Sinusoids.record

    def record(self, phases, gains=None):
        seen.append(self.samples)
        return plain(self, phases, gains)

    start = np.random.default_rng(repeats).uniform(0.0, 2.0 * np.pi, harmonics.size)
    with patch.object(Sinusoids, "record", record):
        short = low_peak_phases(lines, repeats, start, steps=10)
        long = low_peak_phases(lines, times * repeats, start, steps=10)
    np.testing.assert_array_equal(short, long)
    assert max(seen) <= repeats
