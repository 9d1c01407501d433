"""Records of every kind, of one input and of two, their spectra, and what delivered records attain."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli.accuracy import least_ratios, worst_ratio
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.signal.evaluation import Target
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.lines import DesignedSpectrum
from inputdesign_cli.signal.multisine import gaussian_record
from inputdesign_cli.signal.selection import best_record
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.spectrum import FirBasis, LinesBasis
from tests.support.convex_designs import solve
from tests.support.random_plants import random_case
from tests.support.signals import COLOURED, block_spectrum, of_two_inputs

KINDS = ["filtered_noise", "multisine", "binary", "ternary", "prbs", "white", "steps"]


def rng(seed=0):
    return np.random.default_rng(seed)


def one_input(w):
    return FirBasis(1, 3).density(COLOURED, w)


LINES = np.array([0.2, 0.9])
TWO = DesignedSpectrum(2, 13.58, density=of_two_inputs)
SPECTRA = {
    "moving average": DesignedSpectrum.of(FirBasis(1, 3), COLOURED),
    "density": DesignedSpectrum(1, COLOURED[0], density=one_input),
    "lines": DesignedSpectrum.of(LinesBasis.at(LINES, 1), np.ones(2)),
    "two inputs": TWO,
    "lines of two inputs": DesignedSpectrum.of(LinesBasis.at(LINES, 2), np.ones(8), inputs=2),
}


def generator(spectrum, samples=240, **settings):
    return SignalGenerator(SPECTRA[spectrum], SignalSettings(**settings), samples)


@pytest.mark.parametrize("method", KINDS)
@pytest.mark.parametrize("spectrum", SPECTRA)
def test_the_values_are_equal_periods_before_the_hold(method, spectrum):
    """The 120 values are three equal periods of 40; each value is to be held for four samples."""
    values = generator(spectrum, 480, method=method, periods=3, hold=4).values(rng())
    assert values.shape == (120, SPECTRA[spectrum].inputs)
    np.testing.assert_array_equal(values[:40], values[40:80])
    np.testing.assert_array_equal(values[:40], values[80:])
    assert np.all(np.ptp(values, axis=0) > 0)


@pytest.mark.parametrize("method", ["multisine", "filtered_noise", "white"])
@pytest.mark.parametrize("spectrum", SPECTRA)
def test_the_ramp_fades_every_input_in_and_out(method, spectrum):
    share = generator(spectrum, method=method, ramp=10).values(rng()) / generator(
        spectrum, method=method
    ).values(rng())
    np.testing.assert_allclose(share[10:-10], 1.0)
    assert np.all(np.diff(share[:11], axis=0) > 0)
    np.testing.assert_allclose(share, share[::-1])
    assert np.all((share[0] > 0) & (share[0] < 0.05))


@pytest.mark.parametrize("spectrum", ["moving average", "density", "two inputs"])
def test_the_spectrum_is_corrected_for_the_hold(spectrum):
    """Up to pi / hold the held record has the designed spectrum."""
    inputs = SPECTRA[spectrum].inputs
    held = np.repeat(generator(spectrum, 4800, method="multisine", hold=4).values(rng()), 4, axis=0)
    found = block_spectrum(held, inputs)
    w = 2 * np.pi * np.arange(len(found)) / (4800 / inputs)
    wanted = SPECTRA[spectrum].density(w).reshape(found.shape)
    inside = slice(1, int(0.9 * len(found) / 4))
    np.testing.assert_allclose(found[inside], wanted[inside], atol=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("chosen", ["odd", 8, (1, 4, 9, 20)])
@pytest.mark.parametrize("spectrum", ["moving average", "two inputs"])
def test_chosen_lines_keep_the_powers_of_the_inputs(chosen, spectrum):
    period = 240 // SPECTRA[spectrum].inputs
    lines = generator(spectrum, method="multisine", lines=chosen).lines
    wanted = SPECTRA[spectrum].lines(period).powers.sum(axis=0)
    np.testing.assert_allclose(lines.powers.sum(axis=0), wanted)
    used = np.rint(lines.frequencies * period / (2 * np.pi)).astype(int)
    if chosen == 8:
        assert used.size == 8
    else:
        assert set(used) == (set(range(1, period // 2 + 1, 2)) if chosen == "odd" else set(chosen))


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_noise_of_sinusoids_is_a_multisine(spectrum):
    made = generator(spectrum, method="filtered_noise")
    assert made.method == ("multisine" if "lines" in spectrum else "filtered_noise")
    assert (made.factor is not None) == (spectrum == "moving average")


def test_gaussian_noise_has_the_spectrum_on_average():
    lines, draws = TWO.lines(24), 1000
    generator = rng()
    X = np.array([block_spectrum(gaussian_record(lines, generator), 1) for _ in range(draws)])
    wanted = of_two_inputs(2 * np.pi * np.arange(13) / 24)
    wanted[[0, -1]] = wanted[[0, -1]].real
    error = X.std(axis=0) / np.sqrt(draws)
    assert np.all(np.abs(X.mean(axis=0) - wanted) < 5 * error + 1e-12)


def test_shifted_sequences_are_nearly_uncorrelated():
    """The correlation over one sequence is -1/n at every lag except the shift, about n/2."""
    values = generator("two inputs", 254, method="prbs", bits=7, periods=2).values(rng())[:127]
    values = values / np.abs(values).max(axis=0)
    spectrum = np.fft.rfft(values, axis=0)
    cross = np.fft.irfft(spectrum[:, 0].conj() * spectrum[:, 1], 127) / 127
    peaks = np.flatnonzero(np.abs(cross) > 0.5)
    assert peaks.size == 1
    assert min(peaks[0], 127 - peaks[0]) == 63
    np.testing.assert_allclose(np.delete(cross, peaks), -1 / 127, atol=1e-12)


@pytest.mark.parametrize("method", ["filtered_noise", "multisine", "binary"])
@pytest.mark.parametrize("seed", range(3))
def test_leaving_candidates_out_early_changes_no_record(method, seed):
    """The bounds on ratios only save time: every candidate that they leave out costs more than the best."""
    case = random_case(seed)
    experiment = case.experiment(300).whitened(1.0)
    requirements = [case.requirement(experiment)]
    spectrum = DesignedSpectrum.of(FirBasis(1, 3), COLOURED)
    made = SignalGenerator(spectrum, SignalSettings(method, candidates=6, most_candidates=9), 300)
    target = Target(worst_ratio(requirements), meets=True)
    early = replace(target, least_ratios=least_ratios(requirements))
    plant = FiniteRecord(experiment, 300)
    every, some = (best_record(made, plant, one) for one in (target, early))
    assert some.met
    np.testing.assert_array_equal(some.samples, every.samples)


def record_of(experiment, basis, x, seed=0):
    made = SignalGenerator(
        DesignedSpectrum.of(basis, x),
        SignalSettings("multisine", candidates=1, most_candidates=1, seed=seed),
        500,
    )
    return best_record(made, FiniteRecord(experiment, 500), Target(lambda _: 0.0)).samples[:, 0]


def test_free_lines_that_a_record_cannot_resolve_do_not_cancel(first_order):
    """Four sinusoids near w = 0 are one constant of their power; the line at 2.0 keeps its own power."""
    basis = replace(LinesBasis.at(np.array([1e-5, 2.0, 1.1e-5, 3e-4, 2.0 + 1e-6, 4e-4]), 1), free=True)
    for seed in range(6):
        samples = record_of(first_order, basis, np.array([1.0, 0.5, 1.0, 1.0, 0.5, 1.0]), seed)
        assert abs(np.mean(samples)) == pytest.approx(2.0, rel=0.01)
        line = 2 * np.abs(np.mean(samples * np.exp(-2.0j * np.arange(500)))) ** 2
        assert line == pytest.approx(1.0, rel=0.05)


def test_given_lines_keep_their_frequencies_and_amplitudes(first_order):
    samples = record_of(first_order, LinesBasis.at(np.array([1.0, 1.001]), 1), np.ones(2))
    rows = np.exp(1j * np.outer([1.0, 1.001], np.arange(500)))
    regressors = np.concatenate([rows.real, rows.imag]).T
    fit = np.linalg.lstsq(regressors, samples, rcond=None)
    np.testing.assert_allclose(regressors @ fit[0], samples, atol=1e-8)
    amplitude = np.hypot(fit[0][:2], fit[0][2:])
    assert amplitude[0] == pytest.approx(amplitude[1], rel=1e-6)


@pytest.mark.first(1)
@pytest.mark.parametrize("samples", [500, 5000])
@pytest.mark.parametrize("method", ["filtered_noise", "multisine"])
@pytest.mark.parametrize("seed", range(20))
def test_records_of_random_designs_meet_the_accuracy_with_little_extra_power(seed, samples, method):
    """The accuracy and the cost of the record are recomputed."""
    case = random_case(seed)
    design = solve(
        case.experiment(samples), "cost", [case.requirement], case.order, cost=case.cost, tolerance=1e-6
    )
    problem, x = design.problem, design.result.x
    designed = sum(weight * problem.power(kind).at(x) for kind, weight in case.cost.items())
    target = Target(worst_ratio(problem.requirements), True, case.cost, designed)
    plant = FiniteRecord(problem.experiment, samples)
    spectrum = DesignedSpectrum.of(FirBasis(1, x.size - 1), x)
    record = best_record(SignalGenerator(spectrum, SignalSettings(method), samples), plant, target)
    cost = sum(weight * plant.mean_squares(kind, record.samples)[0] for kind, weight in case.cost.items())
    assert record.met
    assert target.worst_ratio(plant.information(record.samples)) <= 1 + 1e-9
    assert cost / designed - 1 == pytest.approx(record.extra_power, abs=1e-9)
    assert record.extra_power <= {500: 0.10, 5000: 0.03}[samples]
