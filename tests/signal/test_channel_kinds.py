"""Records of several inputs of every kind: their levels, their spectra, their limits, laws of the plant."""

import numpy as np
import pytest
import scipy.signal
from channel_plants import arx
from inputdesign_cli.signal.channel_levels import few_levels
from inputdesign_cli.signal.channels import gaussian_record

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.signal import (
    ChannelBounds,
    ChannelSignalGenerator,
    Lines,
    Quantiser,
    RecordFilter,
    SignalSettings,
    Target,
    grid_lines,
    realise_channels,
)
from inputdesign_cli.signal.levels import two_level
from inputdesign_cli.signal.sinusoids import Sinusoids

SAMPLES = 240


def rng(seed=0):
    return np.random.default_rng(seed)


def density(w):
    """A moving average of three taps at each of two inputs, correlated with a phase that turns."""
    phi = np.zeros((w.size, 2, 2), dtype=complex)
    for tap, phase in ((1.0, 0), (0.5, 1)):
        h = tap * np.exp(-1j * np.outer(w, [phase, 2 * phase])) @ np.array([[1.0, 0.2], [0.4, 3.0]])
        phi += h[:, :, None] * h[:, None, :].conj()
    return phi + 0.2 * np.eye(2)


def design(period, hold):
    w = 2 * np.pi * np.arange(period // 2 + 1) / (period * hold)
    return grid_lines(density(w), period, float(hold))


def drawer(samples=SAMPLES, **recipe):
    return ChannelSignalGenerator(design, SignalSettings(**recipe), samples)


def block_spectrum(record, blocks):
    """The mean over blocks of the matrix periodogram (n, r, r)."""
    period = len(record) // blocks
    X = np.fft.rfft(record.reshape(blocks, period, -1), axis=1) / np.sqrt(period)
    return np.einsum("bni,bnj->nij", X, X.conj()) / blocks


KINDS = ["filtered_noise", "multisine", "binary", "ternary", "prbs", "white"]


@pytest.mark.parametrize("method", KINDS)
def test_periods_and_hold(method):
    values = drawer(method=method, periods=3, hold=2).values(rng())
    assert values.shape == (120, 2)
    np.testing.assert_array_equal(values[:40], values[40:80])
    np.testing.assert_array_equal(values[:40], values[80:])
    assert np.all(np.ptp(values, axis=0) > 0)


@pytest.mark.parametrize("method", ["multisine", "filtered_noise", "white"])
def test_the_ramp_fades_every_input(method):
    faded = drawer(method=method, ramp=10).values(rng())
    plain = drawer(method=method, lines=None).values(rng())
    share = faded[20:-20] / plain[20:-20]
    np.testing.assert_allclose(share, 1.0)
    assert np.all(np.abs(faded[0]) < 0.1 * np.abs(plain).max(axis=0))


def test_the_hold_is_allowed_for():
    """Up to pi / hold the held record has the designed matrix spectrum."""
    held = np.repeat(drawer(4 * 1200, method="multisine", hold=4).values(rng()), 4, axis=0)
    found = block_spectrum(held, 2)
    w = 2 * np.pi * np.arange(len(found)) / 2400
    inside = slice(1, 270)
    np.testing.assert_allclose(found[inside], density(w)[inside], atol=1e-9 * np.abs(density(w)).max())


@pytest.mark.parametrize("chosen", ["odd", (1, 4, 9, 20)])
def test_chosen_lines_keep_the_powers_of_the_inputs(chosen):
    lines = drawer(method="multisine", lines=chosen).lines
    np.testing.assert_allclose(lines.powers.sum(axis=0), design(120, 1).powers.sum(axis=0))
    used = np.rint(lines.frequencies * 120 / (2 * np.pi)).astype(int)
    assert set(used) == (set(range(1, 61, 2)) if chosen == "odd" else set(chosen))


def test_gaussian_noise_has_the_spectrum_on_average():
    lines, draws = design(24, 1), 4000
    generator = rng()
    X = np.array([block_spectrum(gaussian_record(lines, generator), 1) for _ in range(draws)])
    wanted = density(2 * np.pi * np.arange(13) / 24)
    wanted[[0, -1]] = wanted[[0, -1]].real
    error = X.std(axis=0) / np.sqrt(draws)
    assert np.all(np.abs(X.mean(axis=0) - wanted) < 5 * error + 1e-12)


def test_one_input_of_two_levels_is_that_of_the_scalar_method():
    """With one block the unitary factor is a phase, so that both find the same signal from the same start."""
    power = design(240, 1).powers[:, 0, 0].real
    lines = Lines(2 * np.pi * np.arange(121) / 240, power[:, None, None].astype(complex), 240)
    single = np.sign(few_levels(lines, 240, rng(), "binary")[:, 0])
    several = [misfit(two_level(Sinusoids.on_grid(power, 240), rng(seed)), power) for seed in range(8)]
    assert min(several) * 0.8 <= misfit(single, power) <= 1.2 * max(several)


def misfit(x, power):
    found, wanted = np.abs(np.fft.rfft(x)), np.sqrt(power)
    found[[0, -1]] /= np.sqrt(2.0)
    return 1 - (found @ wanted) ** 2 / (found @ found) / (wanted @ wanted)


@pytest.mark.parametrize(("kind", "number"), [("binary", 2), ("ternary", 3)])
@pytest.mark.parametrize("samples", [480, 481])
def test_few_levels_at_several_inputs(kind, number, samples):
    """Levels of the powers of the inputs, and a matrix spectrum nearer than that of clipped multisines."""
    lines = design(240, 1)
    record = few_levels(lines, samples, rng(), kind)
    assert record.shape == (samples, 2)
    assert all(np.unique(column).size == number for column in record.T)
    np.testing.assert_allclose(np.mean(record[:480] ** 2, axis=0), lines.mean_squares, rtol=0.01)
    wanted = density(2 * np.pi * np.arange(121) / 240)

    def error(x):
        return np.linalg.norm(block_spectrum(x[:480], 2) - wanted) / np.linalg.norm(wanted)

    def signs(seed):
        return np.sign(drawer(480, method="multisine").values(rng(seed))) * np.sqrt(lines.mean_squares)

    assert error(record) < 0.8 * min(error(signs(seed)) for seed in range(5))


def test_shifted_sequences_are_nearly_uncorrelated():
    """Over one sequence: -1/n at every lag but those of the shifts, n/2 away."""
    values = drawer(254, method="prbs", bits=7, periods=2).values(rng())[:127]
    values = values / np.abs(values).max(axis=0)
    spectrum = np.fft.rfft(values, axis=0)
    cross = np.fft.irfft(spectrum[:, 0].conj() * spectrum[:, 1], 127) / 127
    peaks = np.flatnonzero(np.abs(cross) > 0.5)
    assert peaks.size == 1
    assert min(peaks[0], 127 - peaks[0]) == 63
    np.testing.assert_allclose(np.delete(cross, peaks), -1 / 127, atol=1e-12)


def test_the_adjoint_of_an_output():
    plant = RecordFilter(ChannelExperiment(arx(), SAMPLES).whitened(1.0), SAMPLES, 1.0)
    u, weights = rng().normal(size=(SAMPLES, 2)), rng(1).normal(size=(SAMPLES, 2))
    model = arx()
    y = np.zeros((SAMPLES, 2))
    for i, j in np.ndindex(2, 2):
        y[:, i] += scipy.signal.lfilter(model.B[i][j], model.A[i], u[:, j])
    np.testing.assert_allclose(plant.signals("output", u), y, atol=1e-10)
    assert np.sum(weights * y) == pytest.approx(np.sum(plant.adjoint("output", weights) * u))


BOUNDS = {
    "amplitude": ChannelBounds(amplitude=np.array([1.6, 4.0])),
    "rate": ChannelBounds(rate=np.array([1.5, 4.0])),
    "output": ChannelBounds(output=np.array([7.0, 5.0])),
    "all": ChannelBounds(np.array([1.8, 4.5]), np.array([2.0, 5.0]), np.array([8.0, 6.0])),
}
RECIPES = {
    "multisine": {"method": "multisine"},
    "optimised": {"method": "multisine", "phases": "optimised"},
    "noise": {"method": "filtered_noise", "hold": 2},
    "binary": {"method": "binary"},
    "prbs": {"method": "prbs"},
    "converter": {"method": "multisine", "periods": 2},
}


@pytest.mark.parametrize("limited", BOUNDS)
@pytest.mark.parametrize("kind", RECIPES)
def test_limits_hold_exactly(kind, limited):
    experiment = ChannelExperiment(arx(), SAMPLES).whitened(1.0)
    plant, bounds = RecordFilter(experiment, SAMPLES, 1.0), BOUNDS[limited]
    demand = Target(lambda M: float(np.sqrt(0.4 / np.linalg.eigvalsh(M)[0])), meets=True)
    converters = [Quantiser(8, 4.0), Quantiser(7, 10.0)] if kind == "converter" else None
    recipe = {**RECIPES[kind], "candidates": 1, "most_candidates": 1}
    record = realise_channels(
        plant, drawer(**recipe), demand, total=10.0, bounds=bounds, quantisers=converters
    )
    u = record.samples
    assert u.shape == (SAMPLES, 2)
    moves = np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0)
    if bounds.amplitude is not None:
        assert np.all(np.abs(u).max(axis=0) <= bounds.amplitude)
    if bounds.rate is not None:
        assert np.all(moves <= bounds.rate * (1 + 1e-15))
    if bounds.output is not None:
        assert np.all(np.abs(plant.signals("output", u)).max(axis=0) <= bounds.output)
    if converters:
        codes = u / np.array([q.step for q in converters])
        np.testing.assert_allclose(codes, np.rint(codes), atol=1e-9)
    attained = demand.worst_ratio(plant.information(u))
    assert record.worst_ratio == pytest.approx(attained, rel=1e-12)
    assert record.met == (attained <= 1 + 1e-9)


def test_powers_of_each_channel_are_kept_below_their_limits():
    plant = RecordFilter(ChannelExperiment(arx(), SAMPLES).whitened(1.0), SAMPLES, 1.0)
    demand = Target(lambda M: float(np.sqrt(0.5 / np.linalg.eigvalsh(M)[0])), meets=True)
    bounds = ChannelBounds(powers=(("input", 1, 0.02), ("output", None, 50.0)))
    recipe = {"method": "multisine", "candidates": 1, "most_candidates": 1}
    record = realise_channels(plant, drawer(**recipe), demand, total=10.0, bounds=bounds)
    assert not record.met
    assert np.mean(record.samples[:, 1] ** 2) == pytest.approx(0.02)
