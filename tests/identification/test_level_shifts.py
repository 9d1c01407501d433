"""Shifts of the level of an output that the inputs do not cause."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification import identify
from tests.support.plants import stated

ARX = "sample_time: 1\nplant: {A: [1, -0.8], B: [0, 0.5]}\nnoise: {variance: 0.01}\n"
LAG = (
    "sample_time: 1\nplant: {parameters: {K: 1, T: 10, L: 3.3}, "
    "continuous: {numerator: [K], denominator: [T, 1], delay: L}, sample: zoh}\n"
)
# The plant that `lag_of` simulates, in q: its estimates take a tenth of the time.
FINE = "sample_time: 1\nplant: {B: [0, 0, 0, 0.1], F: [1, -0.9]}\n"
NOISES = {
    "white": "noise: {variance: 0.01}",
    "coloured": "noise: {variance: 0.01, D: [1, -0.5]}",
    "walk": "noise: {variance: 0.01, C: [1, -0.5], drift: true}",
}


def lag_of(samples, seed, noise="white", size=0.1):
    """u and y of 1/(9 s + 1) e^-2s, inputs held for 5 to 30 samples, and noise of the named sort."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], samples), rng.integers(5, 31, samples))[:samples]
    pole = np.exp(-1.0 / 9.0)
    e = rng.standard_normal(samples)
    v = {
        "white": e,
        "coloured": scipy.signal.lfilter([1.0], [1.0, -0.7], e),
        "walk": 0.3 * np.cumsum(e) + rng.standard_normal(samples),
    }[noise]
    y = scipy.signal.lfilter([0.0, 0.0, 0.0, 1.0 - pole], [1.0, -pole], u) + size * v
    return u[:, None], y[:, None]


def shift_of(text, u, y, **settings):
    return identify(stated(text), u, y, **settings).tests.shift


def test_the_shift_statistic_of_arx_is_the_likelihood_ratio_of_two_regressions():
    """A shift is one more regressor; the statistic is N log of the ratio of sums of squares."""
    rng = np.random.default_rng(4)
    u, e = rng.choice([-1.0, 1.0], 120), 0.1 * rng.standard_normal(120)
    y = scipy.signal.lfilter([0.0, 0.5], [1.0, -0.8], u) + scipy.signal.lfilter([1.0], [1.0, -0.8], e)
    phi = np.stack([np.append(0.0, -y[:-1]), np.append(0.0, u[:-1])], axis=1)

    def squares(regressors):
        return np.sum((y - regressors @ np.linalg.lstsq(regressors, y, rcond=None)[0]) ** 2)

    expected = {}
    for lag in (0.0, 4.0):
        for at in range(5, 115):
            after = np.maximum(np.arange(120.0) - at + 1.0, 0.0)
            column = -np.expm1(-after / lag) if lag else (after > 0.0).astype(float)
            expected[lag, at] = 120.0 * np.log(squares(phi) / squares(np.column_stack([phi, column])))
    found = shift_of(ARX, u[:, None], y[:, None], rest=True)
    best = max(expected, key=expected.get)
    # Only lags up to an eighth of the record are tried; the third would have 16 samples.
    assert found.test.statistic == pytest.approx(expected[best], rel=1e-6)
    assert found.sample == best[1]


@pytest.mark.parametrize(
    ("words", "noise"), [(FINE, "white"), *(pytest.param(LAG, n, marks=pytest.mark.slow) for n in NOISES)]
)
def test_right_models_show_no_level_shift(words, noise):
    told = [
        shift_of(words + NOISES[noise], *lag_of(int(120 + 37 * seed), seed, noise)).test.probability < 1e-3
        for seed in range(3)
    ]
    assert not any(told)


@pytest.mark.parametrize(
    ("words", "at", "lag", "sign"),
    [
        (FINE, 150, 10.0, 1.0),
        *(
            pytest.param(LAG, *one, marks=pytest.mark.slow)
            for one in ((150, 10.0, 1.0), (90, 0.0, -1.0), (200, 25.0, -1.0))
        ),
    ],
)
def test_the_sample_and_the_sign_of_a_shift_are_found(words, at, lag, sign):
    u, y = lag_of(300, 3)
    after = np.maximum(np.arange(300.0) - at, 0.0)
    y[:, 0] += sign * 0.5 * (-np.expm1(-after / lag) if lag else after >= 1.0)
    estimate = identify(stated(words + NOISES["white"]), u, y)
    found = estimate.tests.shift
    assert estimate.tests.shifted[:1] == (found,)
    assert found.test in estimate.tests.failed
    assert abs(found.sample - at) <= 6
    assert found.begins <= at + 1 < found.ends
    assert found.rises == (sign > 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 8])
def test_a_load_that_comes_and_goes_gives_two_shifts(seed):
    u, y = lag_of(300, seed)
    y[120:180] += 0.6
    found = identify(stated(LAG + NOISES["white"]), u, y)
    first, second = sorted(found.tests.shifted, key=lambda one: one.sample)
    assert (first.sample, first.rises, second.sample, second.rises) == (120, True, 180, False)
    assert not [test for test in found.tests.beside_shifts if test.probability < 1e-4]


@pytest.mark.slow
def test_a_shift_belongs_to_one_record_and_one_output():
    first, second = lag_of(150, 5), lag_of(200, 6)
    matrix = stated(
        "sample_time: 1\nplant: {A: [[1, -0.9], [1, -0.9]], B: [[[0, 0.1]], [[0, 0.1]]]}\n"
        "noise: {variance: [[0.01, 0], [0, 0.01]]}\n"
    )
    u = np.concatenate([first[0], second[0]])
    y = np.concatenate([first[1], second[1]])
    two = np.column_stack([y[:, 0], np.random.default_rng(1).permutation(y[:, 0])])
    two[250:, 0] += 3.0
    found = identify(matrix, u, two, lengths=[150, 200]).tests.shift
    assert (found.output, found.sample) == (0, 250)
    two = two[:, ::-1]
    assert identify(matrix, u, two, lengths=[150, 200]).tests.shift.output == 1
    # Separate records may have different levels.
    apart = np.concatenate([first[1], second[1] + 3.0])
    assert shift_of(LAG + NOISES["white"], u, apart, lengths=[150, 200], rest=False).test.probability > 0.01


@pytest.mark.slow
def test_lines_and_single_samples_are_no_shifts():
    u, y = lag_of(300, 7)
    line = y + np.linspace(0.0, 1.0, 300)[:, None]
    found = identify(stated(LAG + NOISES["white"]), u, line, rest=False)
    assert found.tests.shift.test.probability < 1e-3
    assert not found.tests.shift.alone
    assert found.tests.shifted == ()
    spike = y.copy()
    spike[288] += 5.0
    found = identify(stated(LAG + NOISES["white"]), u, spike)
    assert found.tests.shift.test.probability < 1e-3
    assert found.tests.shifted == ()


def test_a_record_too_short_for_a_shift_has_none():
    rng = np.random.default_rng(2)
    u = rng.choice([-1.0, 1.0], (10, 1))
    y = np.append(0.0, 0.5 * u[:-1, 0])[:, None] + 0.1 * rng.standard_normal((10, 1))
    text = "sample_time: 1\nplant: {B: [0, 0.5]}\nnoise: {variance: 0.01}\n"
    assert shift_of(text, u, y, rest=True) is None


@pytest.mark.slow
def test_a_shift_that_alone_refutes_a_model_is_reported_unless_another_test_fails():
    """Its score may be below that of a test that passes; another test that fails outweighs it."""
    u, y = lag_of(300, 5)
    y[120:] += 0.6
    found = identify(stated(LAG + NOISES["white"]), u, y)
    shift = found.tests.shifts[0]
    faint = replace(shift, score=5.0)
    one = next(one for one in found.tests.directed if not one.of_structure)

    def beside(probability):
        other = replace(one, test=replace(one.test, probability=probability))
        quiet = tuple(replace(test, probability=0.5) for test in found.tests.scores)
        return replace(found.tests, shift=faint, shifts=(faint,), scores=quiet, directed=(other,))

    alone, outweighed = beside(0.1), beside(1e-9)
    assert alone.failed == (faint.test,)
    assert alone.shifted == (faint,)
    assert outweighed.shifted == ()
    assert outweighed.failed_besides == outweighed.failed
    assert len(outweighed.failed) == 2
