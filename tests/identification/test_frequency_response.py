"""The frequency response without a model: exact at lines, unbiased, within its discs as often as stated."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification import frequency_response, response_delays
from inputdesign_cli.plant import PolynomialModel
from tests.support.plants import lag_of

B, F = [0, 1.0, 0.4], [1, -1.2, 0.6]


def plant(w):
    return scipy.signal.freqz(B, F, worN=w)[1]


def test_without_noise_the_response_at_lines_of_a_periodic_input_is_exact():
    rng = np.random.default_rng(1)
    lines = np.array([1, 4, 9, 20, 31])
    angle = 2 * np.pi * np.outer(np.arange(640), lines) / 64
    u = np.cos(angle + rng.uniform(0, 6, 5)).sum(axis=1)
    y = scipy.signal.lfilter(B, F, u)
    found = frequency_response(u[:, None], y[:, None])
    assert found.method == "lines"
    np.testing.assert_allclose(found.frequency, 2 * np.pi * lines / 64)
    # the transient has decayed to 0.775^64 after the first of ten periods
    np.testing.assert_allclose(found.G[:, 0, 0], plant(found.frequency), atol=1e-7)
    assert found.radius.max() < 1e-6


def test_mean_square_error_and_coverage_at_lines_agree_with_theory():
    """P - 1 periods and noise of variance Phi_v give the variance Phi_v / ((P - 1) N |U|^2)."""
    period = np.random.default_rng(2).choice([-1.0, 1.0], 32)
    u, power = np.tile(period, 7), 0.3
    caused = scipy.signal.lfilter(B, F, u)
    errors, inside = [], []
    for seed in range(200):
        noise = np.sqrt(power) * np.random.default_rng(100 + seed).standard_normal(u.size)
        found = frequency_response(u[:, None], (caused + noise)[:, None])
        errors.append(found.G[:, 0, 0] - plant(found.frequency))
        inside.append(np.abs(errors[-1]) < found.radius[:, 0, 0])
    lines = np.abs(np.fft.rfft(period))[1:16] ** 2
    variance = np.mean(np.abs(errors) ** 2, axis=0)
    np.testing.assert_allclose(np.mean(variance * lines), power * 32 / 6, rtol=0.06)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)


@pytest.mark.slow
def test_for_white_inputs_95_percent_of_discs_contain_the_plant():
    errors, inside = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = rng.standard_normal(1000)
        y = scipy.signal.lfilter(B, F, u) + 0.5 * scipy.signal.lfilter(
            [1], [1, -0.5], rng.standard_normal(1000)
        )
        # the record is cut out of a longer one, so that its start is unknown
        found = frequency_response(u[500:, None], y[500:, None])
        assert found.method == "local_polynomial"
        errors.append(found.G[:, 0, 0] - plant(found.frequency))
        inside.append(np.abs(errors[-1]) < found.radius[:, 0, 0])
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)
    mean, deviation = np.mean(errors, axis=0), np.std(errors, axis=0)
    assert np.mean(np.abs(mean) ** 2 / (deviation**2 / 20)) == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize("periodic", [False, True])
def test_noise_and_coherence_agree_with_theory(periodic):
    """White noise of variance v has the spectrum v; a white input, the coherence |G|^2 / (|G|^2 + v)."""
    rng = np.random.default_rng(6)
    u = np.tile(rng.choice([-1.0, 1.0], 400), 10) if periodic else rng.standard_normal(4000)
    y = scipy.signal.lfilter(B, F, u) + np.sqrt(0.3) * rng.standard_normal(4000)
    found = frequency_response(u[:, None], y[:, None])
    assert found.method == ("lines" if periodic else "local_polynomial")
    assert np.mean(found.noise) == pytest.approx(0.3, rel=0.1)
    size = np.abs(plant(found.frequency)) ** 2
    if periodic:
        size = size * np.abs(np.fft.rfft(u[:400])[1:200]) ** 2 / 400
    error = found.coherence[:, 0] - size / (size + 0.3)
    assert abs(np.mean(error)) < 0.03
    assert np.all((found.coherence >= 0.0) & (found.coherence <= 1.0))


def test_discs_from_two_records_of_two_inputs_contain_the_plant():
    rng = np.random.default_rng(3)
    u = rng.standard_normal((1300, 2))
    y = np.stack([scipy.signal.lfilter([0, 1], [1, -0.5], u[:, 0]) + 0.5 * u[:, 1], -2.0 * u[:, 1]], axis=1)
    found = frequency_response(u, y + 0.1 * rng.standard_normal(y.shape), lengths=[800, 500])
    z = np.exp(-1j * found.frequency)
    zero = np.zeros_like(z)
    truth = np.array([[z / (1 - 0.5 * z), zero + 0.5], [zero, zero - 2.0]]).transpose(2, 0, 1)
    assert np.mean(np.abs(found.G - truth) < found.radius) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("seeds", [2, pytest.param(12, marks=pytest.mark.slow)])
def test_in_a_loop_with_a_slow_reference_the_discs_contain_the_plant(seeds):
    """Where noise moves the input more than the reference does, a ratio of responses is far from normal."""
    inside = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        r = scipy.signal.lfilter([0.05], [1, -0.95], 3.0 * rng.standard_normal(1500))
        e, u, y = 0.3 * rng.standard_normal(1500), np.zeros(1500), np.zeros(1500)
        for t in range(1, 1500):
            y[t] = 0.95 * y[t - 1] + 0.1 * u[t - 1] + e[t] - 0.95 * e[t - 1]
            u[t] = r[t] - 2.0 * y[t]
        found = frequency_response(u[:, None], y[:, None], r[:, None])
        z = np.exp(-1j * found.frequency)
        inside.append(np.abs(found.G[:, 0, 0] - 0.1 * z / (1 - 0.95 * z)) < found.radius[:, 0, 0])
    assert min(map(len, inside)) >= 40
    assert np.mean(np.concatenate(inside)) >= 0.92


@pytest.mark.parametrize("samples", [*range(1, 60), 300])
def test_responses_of_short_or_poor_records_are_finite_or_none(samples):
    rng = np.random.default_rng(samples)
    u, y = rng.standard_normal((2, samples, 1))
    sinusoid = np.sin(0.3 * np.arange(samples))[:, None]
    for signal in (u, np.sign(u), np.zeros_like(u), np.resize([[1.0], [-1.0]], u.shape), sinusoid):
        found = frequency_response(signal, y)
        assert found is None or np.all(np.isfinite(found.G))
        assert samples != 20 or found is None


LATE = [[90, 3], [0, 40]]


def _late_record(seed, samples=800):
    """u, y (samples, 2): white inputs through the dead times LATE, cut out of a longer record."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((samples + 300, 2))
    y = 0.3 * rng.standard_normal((samples + 300, 2))
    for i, late in enumerate(LATE):
        for j, d in enumerate(late):
            y[d:, i] += scipy.signal.lfilter(B, F, u[: len(u) - d, j])
    return u[300:], y[300:]


def _held(found):
    """The share of discs, over entries and frequencies, that contain the plant."""
    late = np.exp(-1j * found.frequency[:, None, None] * np.array(LATE))
    return np.mean(np.abs(found.G - plant(found.frequency)[:, None, None] * late) < found.radius)


@pytest.mark.slow
def test_with_stated_dead_times_the_discs_of_each_entry_contain_the_plant():
    told, untold = [], []
    for seed in range(12):
        u, y = _late_record(seed)
        told.append(frequency_response(u, y, delays=np.array(LATE)))
        untold.append(frequency_response(u, y))
    assert np.mean([_held(found) for found in told]) == pytest.approx(0.95, abs=0.02)
    # A parabola cannot follow the phase of 90 samples, though its discs grow with its difference from a line.
    wide = np.median([found.radius[:, 0, 0] for found in untold])
    assert np.median([found.radius[:, 0, 0] for found in told]) < 0.5 * wide


def test_the_delay_of_a_response_is_the_lag_at_which_it_begins():
    one, none = np.ones(1), np.zeros(1)
    model = PolynomialModel(
        ((np.array([0, 0, 0, 1.0]), none), (np.array([0.4]), np.array([0, 1e-4, 0.5]))),
        (one,) * 2,
        ((np.array([1, -0.9]), one), (one, np.array([1, -0.5]))),
        (one,) * 2,
        (one,) * 2,
        np.eye(2),
    )
    np.testing.assert_array_equal(response_delays(model, 40, step=1.0), [[3, 0], [0, 2]])
    # Between samples a dead time counts to the sample where the response begins.
    assert response_delays(lag_of([2.0], [20.0, 1.0], 9.3), 200, step=0.5) == pytest.approx(19, abs=2)
