"""Multisines: their spectra, harmonics and phases of low crest factors."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.compute.time_limit import OutOfTimeError, time_limit
from inputdesign_cli.signal.constraints import compressed
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.harmonic_grid import (
    HarmonicGrid,
    TooFewHarmonicsError,
    harmonics_between,
    nearest_harmonics,
    thinned,
)
from inputdesign_cli.signal.lines import DesignedSpectrum, Lines, grid_lines, merged
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.phases import crest_factor, low_peak_phases, optimise_phases, schroeder_phases
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.signal.sinusoids import Sinusoids
from inputdesign_cli.spectrum import LinesBasis
from tests.support.signals import periodogram


def hermitian_density(number, r, rng):
    X = rng.normal(size=(number, r, r)) + 1j * rng.normal(size=(number, r, r))
    return X @ X.conj().swapaxes(1, 2)


@pytest.mark.parametrize("r", [1, 2, 3, 4])
def test_orthogonal_periods_have_exactly_the_spectrum(r):
    rng = np.random.default_rng(0)
    period = 64
    phi = hermitian_density(period // 2 + 1, r, rng)
    record = multisine_record(grid_lines(phi, period, 1.0), r * period, rng, "orthogonal")
    blocks = np.fft.rfft(record.reshape(r, period, r), axis=1) / np.sqrt(period)
    mean = np.einsum("bni,bnj->nij", blocks, blocks.conj()) / r
    inside = slice(1, period // 2)
    np.testing.assert_allclose(mean[inside], phi[inside], atol=1e-10 * np.abs(phi).max())
    ends = np.trace(mean[[0, -1]], axis1=1, axis2=2).real
    if r != 3:  # signs are orthogonal there, so that the ends are exact too
        np.testing.assert_allclose(ends, np.trace(phi[[0, -1]], axis1=1, axis2=2).real, rtol=1e-9)


def test_random_phases_meet_the_spectrum_on_average_with_one_vector_a_line():
    rng = np.random.default_rng(1)
    period, draws = 16, 1000
    phi = hermitian_density(period // 2 + 1, 2, rng)
    lines = grid_lines(phi, period, 1.0)
    records = np.array([multisine_record(lines, period, rng, "random") for _ in range(draws)])
    X = np.fft.rfft(records, axis=1) / np.sqrt(period)
    outer = np.einsum("dni,dnj->dnij", X, X.conj())
    assert np.linalg.matrix_rank(outer[0, 3], tol=1e-9) == 1
    inside = slice(1, period // 2)
    deviation = outer.mean(axis=0)[inside] - phi[inside]
    error = outer.std(axis=0)[inside] / np.sqrt(draws)
    assert np.all(np.abs(deviation) < 5 * error + 1e-9)


def test_lines_anywhere_have_their_powers():
    powers = np.array([[[2.0, 0.5j], [-0.5j, 1.0]]], dtype=complex)
    lines = Lines(np.array([0.3]), powers)
    rng = np.random.default_rng(2)
    record = multisine_record(lines, 2 * 20000, rng, "orthogonal")
    np.testing.assert_allclose(record.T @ record / len(record), powers[0].real, atol=2e-3)


def test_lines_that_a_record_cannot_resolve_become_one():
    powers = np.array([np.eye(2), 2 * np.eye(2), 3 * np.eye(2)], dtype=complex)
    found = merged(Lines(np.array([1.0, 1e-9, 2e-7]), powers), 100)
    assert found.frequencies[1] == 1.0
    assert found.frequencies[0] == 0.0
    np.testing.assert_allclose(found.powers, [5 * np.eye(2), np.eye(2)])
    record = multisine_record(found, 200, np.random.default_rng(0), "orthogonal")
    assert np.mean(record**2) == pytest.approx(6.0, rel=0.05)


def test_a_record_of_lines_anywhere_is_their_sum_however_long():
    rng = np.random.default_rng(5)
    frequencies, samples = np.sort(rng.uniform(0.01, 3.0, 700)), 3001
    lines = Lines(frequencies, np.full((700, 1, 1), 0.5 + 0j))
    angles = rng.uniform(0.0, 2.0 * np.pi, 700)
    found = multisine_record(lines, samples, rng, "orthogonal", angles=angles)
    at = [0, 1428, 1429, 3000]
    expected = [sum(np.cos(w * t + a) for w, a in zip(frequencies, angles, strict=True)) for t in at]
    np.testing.assert_allclose(found[at, 0], expected, atol=1e-9)


def test_the_time_limit_ends_a_record_that_is_being_made():
    rng = np.random.default_rng(5)
    lines = Lines(rng.uniform(0.01, 3.0, 20), np.full((20, 1, 1), 0.5 + 0j))
    with time_limit(0.0), pytest.raises(OutOfTimeError):
        multisine_record(lines, 100, rng, "orthogonal")


@pytest.mark.parametrize("period", [64, 65, 1000, 997])
@pytest.mark.parametrize("odd", [False, True])
@pytest.mark.parametrize("lines", [1, 2, 7, 15])
def test_the_requested_number_of_harmonics_ascends_inside_the_band(period, odd, lines):
    band = (0.05, 2.9)
    found = harmonics_between(period, band, lines, odd=odd)
    assert found.size == lines
    assert np.all(np.diff(found) > 0)
    w = 2 * np.pi * found / period
    assert band[0] * (1 - 1e-9) <= w[0]
    assert w[-1] <= band[1] * (1 + 1e-9)
    assert not odd or np.all(found % 2 == 1)


def test_harmonics_are_spaced_logarithmically_or_all_or_nearest_or_too_few():
    found = harmonics_between(10**6, (0.01, 1.0), 21, odd=False)
    assert np.diff(np.log(found)) == pytest.approx(np.log(100.0) / 20, rel=1e-2)
    assert harmonics_between(10, (0.0, np.pi), None, odd=False).tolist() == [1, 2, 3, 4]
    assert harmonics_between(10, (0.0, np.pi), None, odd=True).tolist() == [1, 3]
    with pytest.raises(TooFewHarmonicsError) as caught:
        harmonics_between(100, (0.1, 0.3), 5, odd=False)
    assert caught.value.there == 3  # 2, 3 and 4 times 2 pi / 100
    w = 2 * np.pi / 100
    assert nearest_harmonics(100, w * np.array([0.6, 2.4, 2.6]), odd=False).tolist() == [1, 2, 3]
    assert nearest_harmonics(100, w * np.array([1.9, 2.1, 48.9]), odd=True).tolist() == [1, 3, 49]


def test_one_harmonic_of_each_group_is_left_out_and_monitored():
    candidates = np.arange(1, 49, 2)
    kept = thinned(candidates, 4, np.random.default_rng(3))
    missing = np.setdiff1d(candidates, kept)
    assert missing.size == 6
    assert np.all((missing - 1) // 8 == np.arange(6))
    grid = HarmonicGrid.of(100, kept, watched=True)
    everything = np.sort(np.concatenate([grid.excited, grid.odd, grid.even]))
    assert everything.tolist() == list(range(kept[0], kept[-1] + 1))
    assert np.all(grid.odd % 2 == 1)
    assert np.all(grid.even % 2 == 0)


def flat(lines, samples):
    power = np.zeros(samples // 2 + 1)
    power[1 : lines + 1] = 1.0 / lines
    return Sinusoids.on_grid(power, samples)


def rng(seed=0):
    return np.random.default_rng(seed)


def test_slopes_of_a_record_in_its_phases_agree_with_finite_differences():
    """The frequencies lie on and off the grid, and the record passes a filter."""
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


def test_schroeder_phases_of_a_flat_multisine_have_the_published_form():
    """phi_n = phi_1 - pi n (n - 1) / L up to a delay: second differences are -2 pi / L."""
    lines = flat(31, 256)
    second = np.diff(lines.schroeder_phases(), 2)
    np.testing.assert_allclose(second[1:], -2 * np.pi / 31, atol=1e-12)


@pytest.mark.parametrize("samples", [512, 1024])
def test_optimised_phases_of_64_flat_lines_have_a_crest_factor_below_1_42(samples):
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


def test_the_joint_peak_of_input_and_output_falls_by_a_third():
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


def test_low_peak_phases_lower_the_peaks_of_all_inputs_and_periods():
    lines, rng = coloured(40, 256), np.random.default_rng(1)
    start = 2 * np.pi * rng.random(40)
    rms = np.sqrt(lines.mean_squares)

    def crest(angles):
        record = multisine_record(lines, 512, rng, "orthogonal", angles=angles)
        np.testing.assert_allclose(np.sqrt(np.mean(record**2, axis=0)), rms, rtol=1e-9)
        return (np.abs(record).max(axis=0) / rms).max()

    assert crest(low_peak_phases(lines, 512, start)) < 0.75 * crest(start)
    assert np.isfinite(crest(schroeder_phases(lines, 512)))


def test_a_larger_size_of_one_input_lowers_the_peak_of_the_other():
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
def test_records_of_fewer_samples_than_lines_are_finite(method, samples):
    """Phases of many lines can make all of a few samples zero: no division by zero follows."""
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
