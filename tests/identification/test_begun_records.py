"""Records that begin during operation: inputs applied before them, and many unknown starts."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import identify
from inputdesign_cli.plant import PolynomialModel
from tests.support.plants import stated

GAIN, LAG, N, BEFORE = 2.0, 10.0, 500, 200
IN_S = "{{continuous: {{gain: 2, time_constant: 10, dead_time: {delay}}}, sample: zoh}}"
IN_STATES = (
    "{{parameters: {{K: 2, T: 10, L: {delay}}}, sample: zoh, "
    "state_space: {{A: [['-1/T']], B: [['K/T']], C: [[1]], delay: L}}}}"
)


def model_of(words, delay):
    return stated(f"plant: {words.format(delay=delay)}\nnoise: {{variance: 0.01}}\n")


def cut_out(delay, seed, *, before=BEFORE, samples=N):
    """u, y (samples, 1) of a running experiment; the plant is a lag behind a hold, in closed form.

    Args:
        before: the number of samples before the record; 0: it begins at rest.
    """
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], (samples + before) // 5), 5)
    whole, rest = divmod(delay, 1.0)
    pole, early = np.exp(-1.0 / LAG), 1.0 - np.exp(-(1.0 - rest) / LAG)
    B = np.concatenate([np.zeros(int(whole) + 1), GAIN * np.array([early, 1.0 - pole - early])])
    y = scipy.signal.lfilter(B, [1.0, -pole], u) + 0.1 * rng.standard_normal(samples + before)
    return u[before:, None], y[before:, None]


@pytest.mark.parametrize(
    ("words", "delay", "records", "samples"),
    [
        (IN_S, 0.4, 1, 300),
        *(
            pytest.param(*one, 3, N, marks=pytest.mark.slow)
            for one in ((IN_S, 0.4), (IN_S, 12.3), (IN_STATES, 0.4), (IN_STATES, 12.3))
        ),
    ],
)
def test_inputs_before_the_record_that_act_after_a_dead_time_are_no_faults(words, delay, records, samples):
    """During the first dead time the output responds to inputs before the record."""
    model, failed, deviations, variances = model_of(words, delay), 0, [], []
    for seed in range(records):
        signals = cut_out(delay, seed, samples=samples)
        found = identify(model, *signals, start=model.theta, near=records == 1)
        failed += bool(found.tests.failed)
        deviations.append((found.theta - model.theta) / np.sqrt(np.diag(found.covariance)))
        variances.append(found.noise[0, 0])
    assert failed <= records // 3
    assert np.mean(variances) == pytest.approx(0.01, rel=0.13)
    assert np.sum(np.square(deviations)) < scipy.stats.chi2.ppf(0.999, np.size(deviations))


def _short_records(seed, *, at_rest):
    """Twenty records of 16 samples behind a dead time of 4.3: a third as many unknowns as samples."""
    length, cut = 16, []
    for part in range(20):
        u, y = cut_out(4.3, 1000 * seed + part, before=0 if at_rest else BEFORE)
        cut.append((u[:length], y[:length]))
    u, y = (np.concatenate(signals) for signals in zip(*cut, strict=True))
    return u, y, [length] * len(cut)


@pytest.mark.slow
def test_rest_is_refuted_for_many_short_records_if_it_does_not_hold():
    """Unknown starts explain half of the samples, and shrink the residuals."""
    model, deviations = model_of(IN_S, 4.3), []
    rested = (_short_records(seed, at_rest=True) for seed in range(2))
    refuted = [
        identify(model, u, y, lengths=lengths, start=model.theta).start.rest_refuted
        for u, y, lengths in rested
    ]
    assert sum(refuted) <= 1
    for seed in range(2):
        u, y, lengths = _short_records(seed, at_rest=False)
        found = identify(model, u, y, lengths=lengths, start=model.theta)
        assert found.start.rest_refuted
        tests = found.tests
        assert min(tests.whiteness.probability, tests.independence.probability) > 0.01
        deviations.append((found.theta - model.theta) / np.sqrt(np.diag(found.covariance)))
    assert np.sum(np.square(deviations)) < scipy.stats.chi2.ppf(0.999, np.size(deviations))


@pytest.mark.slow
def test_residuals_that_unknown_inputs_make_zero_are_left_out_of_ljung_box():
    """The statistic of [ljung-box-1978] uses the others; with all it was a third too large, and more."""
    model = model_of(IN_S, 60.3)
    u, y = (signal[:200] for signal in cut_out(60.3, 0))
    found = identify(model, u, y, start=model.theta)
    assert np.all(np.abs(found.errors[:60]) < 1e-6 * found.errors.std())
    left = found.errors[61:, 0]
    n, lags = left.size, found.tests.whiteness.lags.astype(int)
    correlations = np.array([left[k:] @ left[:-k] for k in lags]) / (left @ left)
    expected = n * (n + 2) * np.sum(correlations**2 / (n - lags))
    assert found.tests.whiteness.statistic == pytest.approx(expected, rel=0.02)


def segmented(length, seed, *, colour=0.0):
    """Many short records of one system, each cut out of a longer run."""
    rng = np.random.default_rng([seed, 77])
    u = rng.choice([-1.0, 1.0], 650)
    noise = 0.1 * scipy.signal.lfilter([1.0], [1.0, -colour], rng.standard_normal(650))
    y = scipy.signal.lfilter([0.0, 1.0], [1.0, -0.7], u) + noise
    kept = np.arange(50, 50 + 600 - 600 % length)
    return u[kept, None], y[kept, None], [length] * (kept.size // length)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "D", "colour", "limits"),
    [
        *((length, [1], 0.0, (0, 1)) for length in (20, 150)),
        *((length, [1, -0.4], 0.4, (0, 1)) for length in (20, 150)),
        (20, [1], 0.6, (4, 5)),
    ],
)
def test_only_wrong_models_of_records_with_gaps_are_refuted(length, D, colour, limits):
    """Unknown starts explain a part of the residuals, and so correlate the rest."""
    model, failed = PolynomialModel.single([0, 1.0], F=[1, -0.7], D=D, variance=0.01), 0
    for seed in range(5):
        u, y, lengths = segmented(length, seed, colour=colour)
        failed += bool(identify(model, u, y, lengths=lengths, rest=False).tests.failed)
    assert limits[0] <= failed <= limits[1]


@pytest.mark.slow
@pytest.mark.parametrize("zero", [0.97, 0.5])
def test_noise_before_the_record_does_not_refute_rest_of_the_plant(zero):
    """The plant is at rest; earlier noise has decayed to 0.97^20 = 0.54 after a tenth of the record."""
    model, found = PolynomialModel.single([0, 0.6], F=[1, -0.7], C=[1, -zero]), []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        u, e = rng.standard_normal(200), rng.standard_normal(500)
        noise = scipy.signal.lfilter([1, -zero], [1], e)[300:]
        y = scipy.signal.lfilter([0, 0.6], [1, -0.7], u) + noise
        found.append(identify(model, u[:, None], y[:, None]))
    assert sum(each.start.free for each in found) <= 1
    of_plant = [0, 2]
    distances = [
        d @ np.linalg.solve(each.covariance[np.ix_(of_plant, of_plant)], d)
        for each in found
        if (d := (each.theta - model.theta)[of_plant]) is not None
    ]
    assert np.sum(distances) < scipy.stats.chi2.ppf(0.999, 2 * len(found))


TANKS = {
    "in s": "{parameters: {k: 0.03}, continuous: {numerator: [k], denominator: [1, 0]}, sample: zoh}",
    "in s, states": ("{parameters: {k: 0.03}, state_space: {A: [[0]], B: [[k]], C: [[1]]}, sample: zoh}"),
    "in q": "{B: [0, 0.03], F: [1, -1], known: [f1]}",
}


@pytest.mark.parametrize("plant", TANKS.values(), ids=TANKS.keys())
def test_an_integrating_plant_may_be_measured_about_any_level(plant):
    """y = 30 + 0.05 (sum of u - 50.2) + e: least squares of y on the sum of u, a level and a ramp."""
    rng = np.random.default_rng(4)
    u = 50.0 + np.repeat(rng.choice([-5.0, 5.0], 40), 10)
    total, time = np.concatenate([[0.0], np.cumsum(u - 50.2)[:-1]]), np.arange(400.0)
    y = 30.0 + 0.05 * total + 0.2 * rng.standard_normal(400)
    regressors = np.column_stack([total, np.ones(400), time])
    expected = np.linalg.lstsq(regressors, y, rcond=None)[0][0]
    spread = np.sqrt(0.04 * np.linalg.inv(regressors.T @ regressors)[0, 0])
    model = stated(f"plant: {plant}\nnoise: {{variance: 0.04}}\n")
    found = identify(model, u[:, None], y[:, None])
    assert found.start.free
    assert found.theta[0] == pytest.approx(expected, rel=1e-6)
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(spread, rel=0.1)


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2))])
def test_a_dead_time_estimated_near_zero_does_not_stop_other_parameters(seed):
    rng = np.random.default_rng(seed)
    pole = np.exp(-0.1)
    u = np.repeat(rng.choice([-1.0, 1.0], 50), 4)
    y = scipy.signal.lfilter([0, 2.0 * (1.0 - pole)], [1, -pole], u) + 0.1 * rng.standard_normal(200)
    found = [identify(model_of(words, 2), u[:, None], y[:, None], rest=True) for words in (IN_S, IN_STATES)]
    for one in found:
        assert one.search.converged
        assert one.theta[:2] == pytest.approx(
            [2.0, 10.0], abs=5.0 * np.sqrt(np.diag(one.covariance)[:2]).max()
        )
        assert 0.0 <= one.theta[2] < 5.0 * np.sqrt(one.covariance[2, 2])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_a_spike_does_not_lead_to_a_long_dead_time(seed):
    """If rest is assumed, the spike and the level of 20 give a dead time of 26 to 89 samples.

    As many unknown inputs before each of five stretches would fit any outputs.
    """
    model, rng = model_of(IN_STATES, 3.0), np.random.default_rng(seed)
    u, pole = np.repeat(rng.choice([-1.0, 1.0], 40), 15), np.exp(-1.0 / LAG)
    y = scipy.signal.lfilter([0, 0, 0, 0, GAIN * (1.0 - pole)], [1.0, -pole], u)
    y += 20.0 + 0.1 * rng.standard_normal(600)
    y[int(rng.integers(50, 550))] += 100.0
    found = identify(model, u[:, None], y[:, None], start=model.theta, lengths=(100, 150, 90, 140, 120))
    assert found.start.free
    # One spike in 600 samples has an rms of 4.1, forty times the rms of the noise.
    assert np.all((found.theta > [1.0, 3.0, 0.0]) & (found.theta < [4.0, 30.0, 8.0]))
