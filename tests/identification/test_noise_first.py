"""Noise that is not that of the model: it is found, it blames no plant, and it hides no fault."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import identify, noises_of_residuals
from inputdesign_cli.identification.white import Whitening
from inputdesign_cli.levels import RATE, SHARES
from tests.support.identification_systems import one_channel

LENGTHS = (250, 150)
FIR = one_channel([0, 1.0, 0.5])


def record(seed, *, distorted=lambda u: u, samples=400):
    """Slow inputs, a plant of two coefficients, and noise that fades in ten samples."""
    rng = np.random.default_rng(seed)
    u = scipy.signal.lfilter([0.4], [1.0, -0.9], rng.standard_normal(samples))
    noise = scipy.signal.lfilter([0.1], [1.0, -0.9], rng.standard_normal(samples))
    return u[:, None], (scipy.signal.lfilter([0.0, 1.0, 0.5], [1.0], distorted(u)) + noise)[:, None]


def blamed(found):
    return {test.fault for test in (*found.tests.failed, *found.tests.answering)} - {"noise"}


@pytest.mark.slow
def test_no_plant_is_blamed_for_slow_noise():
    """White residuals are a wrong model in all records; a right plant fails no more often than the rate."""
    found = [identify(FIR, *record(seed), rest=True) for seed in range(25)]
    assert all(one.tests.coloured for one in found)
    assert sum(bool(blamed(one)) for one in found) <= scipy.stats.binom.ppf(0.999, len(found), RATE)


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("fault", "distorted"),
    [
        ("nonlinear", lambda u: np.clip(u, -0.6, 0.6)),
        ("plant", lambda u: u + 0.3 * np.append(np.zeros(4), u[:-4])),
        ("change", lambda u: np.linspace(0.75, 1.25, u.size) * u),
        ("feedback", lambda u: u + 0.5 * np.append(u[3:], np.zeros(3))),
    ],
)
def test_slow_noise_hides_no_fault(fault, distorted):
    found = [blamed(identify(FIR, *record(seed, distorted=distorted), rest=True)) for seed in range(4)]
    assert sum(fault in one for one in found) >= 3


def test_units_do_not_matter():
    u, y = record(3)
    one, other = identify(FIR, u, y, rest=True), identify(FIR, 1e3 * u, 1e-4 * y, rest=True)
    for mine, its in zip(
        (*one.tests.scores, *one.tests.future), (*other.tests.scores, *other.tests.future), strict=True
    ):
        assert its.statistic == pytest.approx(mine.statistic, rel=1e-6)


def test_residuals_become_white_record_by_record():
    rng = np.random.default_rng(5)
    parts = [scipy.signal.lfilter([1.0], [1.0, -1.2, 0.5], rng.standard_normal(n)) for n in LENGTHS]
    v = np.concatenate(parts)[:, None]
    whitening = Whitening.of(v, LENGTHS)
    assert whitening.filters[0][:3] == pytest.approx([1.0, -1.2, 0.5], abs=0.15)
    order = whitening.filters[0].size - 1
    apart = [np.convolve(part, whitening.filters[0])[: len(part)] for part in parts]
    for part in apart:
        part[:order] = 0.0
    assert whitening.through(v)[:, 0] == pytest.approx(np.concatenate(apart))


def test_slopes_of_filtered_residuals_are_differences():
    v = np.random.default_rng(6).standard_normal((400, 1))
    whitening, step = Whitening((np.array([1.0, -0.4, 0.2]),), LENGTHS), 1e-6
    for k, slope in enumerate(whitening.slopes(v), start=1):
        moved = [whitening.filters[0] + sign * step * (np.arange(3) == k) for sign in (1.0, -1.0)]
        above, below = (Whitening((filter,), LENGTHS).through(v) for filter in moved)
        inside = np.r_[2:250, 252:400]
        assert slope[inside] == pytest.approx(((below - above) / (2.0 * step))[inside], abs=1e-6)


def test_the_noise_of_residuals_is_found():
    e = np.random.default_rng(7).standard_normal(4000)
    v = scipy.signal.lfilter([1.0, 0.5], [1.0, -0.8], e)[:, None]
    ((C, D),) = noises_of_residuals(v, (4000,))[0]
    assert pytest.approx([1.0, 0.5], abs=0.1) == C[:2]
    assert pytest.approx([1.0, -0.8], abs=0.1) == D[:2]


def test_the_shares_of_all_tests_are_no_more_than_one():
    assert sum(SHARES.values()) <= 1.0
