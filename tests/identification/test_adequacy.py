"""Score tests of the structure: their statistics, level and power; the search for larger noise models."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import identify, with_larger_noise
from inputdesign_cli.identification.adequacy import ScoreTest, failed
from inputdesign_cli.identification.white import White, Whitening, noises_of_residuals
from inputdesign_cli.levels import RATE, SHARES, level
from inputdesign_cli.plant import PolynomialModel, SampledModel
from tests.support.identification_systems import SYSTEMS, data, one_channel
from tests.support.plants import known, lag_of
from tests.support.records import arx_regressors, shifted


def by_name(found):
    return {test.name: test for test in found.tests.scores}


def test_score_statistics_of_arx_equal_n_r2_of_an_auxiliary_regression():
    """The statistic is N times the share of the residual sum of squares that the further lags explain."""
    u, y = (x[0, :, 0] for x in data("arx", 300, np.random.default_rng(1)))
    found = identify(SYSTEMS["arx"], u[:, None], y[:, None], rest=True)

    def squares(*columns):
        matrix = np.column_stack([arx_regressors(u, y), *columns])
        left = y - matrix @ np.linalg.lstsq(matrix, y, rcond=None)[0]
        return left, left @ left

    residual, least = squares()
    for name, further in (
        ("recent_inputs", [np.append(np.zeros(lag), u[: 300 - lag]) for lag in (0, 3, 4, 5, 6)]),
        ("recent_residuals", [shifted(residual, lag) for lag in (1, 2, 3, 4)]),
    ):
        _, less = squares(*further)
        test = by_name(found)[name]
        assert test.statistic == pytest.approx(300 * (least - less) / least, rel=1e-6)
        assert test.freedom == len(further)
        assert test.probability == pytest.approx(scipy.stats.chi2.sf(test.statistic, test.freedom))


def test_the_leak_of_a_tank_is_tested_by_the_derivative_of_its_level():
    """The residuals are regressed on the derivative of the simulated level by the leak."""
    rng, step, n = np.random.default_rng(5), 2.0, 400
    tank = known(SampledModel(lag_of([0.4], [1, 0]), step), "a0")
    u = np.repeat(rng.choice([-1.0, 1.0], n // 10), 10)
    y = filled(u, 0.4, 1e-3, step) + rng.standard_normal(n)
    found = identify(tank, u[:, None], y[:, None], rest=True)
    (slope,) = found.theta
    residual = y - filled(u, slope, 0.0, step)
    leak = (filled(u, slope, 1e-6, step) - filled(u, slope, -1e-6, step)) / 2e-6
    own = filled(u, 1.0, 0.0, step)
    left = leak - own * (own @ leak) / (own @ own)
    variance = residual @ residual / n
    test = by_name(found)["leak"]
    assert (test.fault, test.freedom) == ("drift", 1)
    assert test.statistic == pytest.approx((left @ residual) ** 2 / (left @ left) / variance, rel=1e-3)
    assert "leak" not in by_name(identify(SYSTEMS["arx"], *(x[0] for x in data("arx", 300, rng)), rest=True))


def filled(u, slope, leak, step):
    """The level of a tank behind a hold: dx/dt = slope u - leak x."""
    pole = np.exp(-leak * step)
    gain = slope * (step if leak == 0.0 else (1.0 - pole) / leak)
    return scipy.signal.lfilter([0.0, gain], [1.0, -pole], u)


def test_all_tests_share_one_significance_level():
    five = [ScoreTest(str(i), "plant", 1.0, 1, p, 1) for i, p in enumerate((0.21, 0.19, 1.0, 0.5, 0.3))]
    assert failed(five) == ()
    one = ScoreTest("x", "noise", 1.0, 1, 0.19 * level("many signals"), 1)
    assert failed([*five[1:], one]) == (one,)
    assert sum(SHARES.values()) <= 1.0


@pytest.mark.parametrize("w", [0.02, 0.2, 1.5])
def test_an_uncertain_zero_of_the_noise_makes_a_score_f_distributed(w):
    """If v = var c (d log |1 - c exp(-jw)|^2 / dc)^2, F has 1 and 2 / v degrees of freedom."""
    c, n = 0.9, 2000
    psi = scipy.signal.lfilter([0, 1.0], [1.0, -c], np.random.default_rng(8).standard_normal(n))[:, None]
    white = White(
        root=np.eye(1),
        lengths=(n,),
        residuals=np.zeros(n),
        variance=1.0,
        starts=np.zeros((n, 0)),
        explained=psi,
        basis=psi / np.linalg.norm(psi),
        echoes=scipy.signal.lfilter([0, 1.0], [1.0, -c], np.eye(1, n))[:, :, None, None],
    )
    along = np.cos(w * np.arange(n))[:, None]
    slope = 2.0 * np.real(np.exp(-1j * w) / (1.0 - c * np.exp(-1j * w)))
    variance = slope**2 / np.sum(psi**2)
    expected = scipy.stats.f.sf(11.0, 1, 2.0 / variance) if variance > 1e-3 else scipy.stats.chi2.sf(11.0, 1)
    assert white.probability(11.0, along / np.linalg.norm(along)) == pytest.approx(expected, rel=0.02)


def test_the_reported_lag_is_the_lag_of_the_missing_coefficient():
    rng = np.random.default_rng(4)
    u = rng.standard_normal((800, 1))
    y = scipy.signal.lfilter([0, 1.0, 0, 0, 0.3], [1.0], u, axis=0) + rng.standard_normal((800, 1))
    found = identify(one_channel([0, 1.0]), u, y)
    assert by_name(found)["recent_inputs"].lag == 4


def test_score_tests_name_the_channels_and_the_lag_that_fail():
    rng = np.random.default_rng(4)
    u, e = rng.standard_normal((600, 2)), rng.standard_normal((600, 2))
    one, gain = np.ones(1), np.array([0, 1.0])
    model = PolynomialModel(
        ((gain, gain),) * 2, (one,) * 2, ((one, one),) * 2, (one,) * 2, (one,) * 2, np.eye(2)
    )
    y = np.concatenate([np.zeros((1, 2)), u[:-1] @ np.array([[1.0, 0.5], [0.7, 1.0]])]) + e
    y[3:, 1] += 0.4 * u[:-3, 0]
    test = by_name(identify(model, u, y, rest=True))["recent_inputs"]
    assert (test.output, test.source, test.lag) == (1, 0, 3)
    y[1:, 0] += 0.6 * e[:-1, 1]
    test = by_name(identify(model, u, y, rest=True))["recent_residuals"]
    assert (test.output, test.source, test.lag) == (0, 1, 1)


def test_a_drift_is_found():
    u, y = data("oe", 600, np.random.default_rng(5))
    found = identify(SYSTEMS["oe"], u[0], y[0] + np.linspace(0.0, 1.5, 600)[:, None])
    assert [test.fault for test in found.tests.failed][-1] == "drift"


@pytest.mark.slow
def test_a_dead_time_estimated_as_zero_does_not_weaken_the_tests():
    """The likeliest dead time is negative; the tests equal the tests without a dead time.

    A dead time turns q^-1 of a lag behind a hold into q^-1 + b q^-2 with b > 0; here b is negative.
    """
    rng = np.random.default_rng(3)
    u = rng.standard_normal((400, 1))
    y = scipy.signal.lfilter([0, 1, -0.4], [1, -0.7], u, axis=0) + 0.3 * rng.standard_normal((400, 1))
    plain, late = lag_of([1.0], [1.0, 0.5]), lag_of([1.0], [1.0, 0.5], 0.3)
    known = identify(SampledModel(plain, 1.0), u, y, start=plain.theta)
    found = identify(SampledModel(late, 1.0), u, y, start=late.theta)
    assert found.theta[late.names.index("delay")] < 1e-6
    for name, test in by_name(known).items():
        assert by_name(found)[name].statistic == pytest.approx(test.statistic, rel=1e-3)
    assert by_name(found)["recent_inputs"].probability < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("pole", [1.0, 1.05, 1.2])
def test_in_a_stabilising_loop_the_right_model_passes_and_a_missing_lag_is_seen(pole):
    """The controller is proportional and adds no noise; the wrong model lacks a lag of the actuator."""
    model = PolynomialModel.single([0, 0.1], A=[1, -pole], C=[1, -0.1], variance=0.02)
    refuted = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        e, r = 0.02 * rng.standard_normal(400), np.repeat(rng.uniform(-1, 1, 20), 20)
        signals = {}
        for lag in (0.0, 0.6):
            y, u, x = np.zeros(400), np.zeros(400), 0.0
            for t in range(1, 400):
                x = lag * x + (1.0 - lag) * u[t - 1]
                y[t] = pole * y[t - 1] + 0.1 * x + e[t] - 0.1 * e[t - 1]
                u[t] = 3.0 * (r[t] - y[t])
            signals[lag] = u[:, None], y[:, None]
        refuted.append(
            [len(identify(model, *signals[lag], feedback=True).tests.failed) > 0 for lag in (0.0, 0.6)]
        )
    right, wrong = np.sum(refuted, axis=0)
    assert right <= 1
    assert wrong >= 3


LENGTHS = (250, 150)
FIR = one_channel([0, 1.0, 0.5])


def record(seed, *, distorted=lambda u: u, samples=400):
    """u, y (samples, 1): slow inputs, an FIR plant, and noise with a pole at 0.9."""
    rng = np.random.default_rng(seed)
    u = scipy.signal.lfilter([0.4], [1.0, -0.9], rng.standard_normal(samples))
    noise = scipy.signal.lfilter([0.1], [1.0, -0.9], rng.standard_normal(samples))
    return u[:, None], (scipy.signal.lfilter([0.0, 1.0, 0.5], [1.0], distorted(u)) + noise)[:, None]


def blamed(found):
    return {test.fault for test in (*found.tests.failed, *found.tests.answering)} - {"noise"}


@pytest.mark.slow
def test_slow_noise_is_not_mistaken_for_a_fault_of_the_plant():
    """The white-noise model is wrong in all records; the right plant fails no more often than the rate."""
    found = [identify(FIR, *record(seed), rest=True) for seed in range(25)]
    assert all(one.tests.coloured for one in found)
    assert sum(bool(blamed(one)) for one in found) <= scipy.stats.binom.ppf(0.999, len(found), RATE)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("fault", "distorted"),
    [
        ("nonlinear", lambda u: np.clip(u, -0.6, 0.6)),
        ("plant", lambda u: u + 0.3 * np.append(np.zeros(4), u[:-4])),
        ("change", lambda u: np.linspace(0.75, 1.25, u.size) * u),
        ("feedback", lambda u: u + 0.5 * np.append(u[3:], np.zeros(3))),
    ],
)
def test_faults_are_found_in_spite_of_slow_noise(fault, distorted):
    found = [blamed(identify(FIR, *record(seed, distorted=distorted), rest=True)) for seed in range(4)]
    assert sum(fault in one for one in found) >= 3


def test_an_autoregression_whitens_residuals_of_each_record_on_its_own():
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


def test_slopes_of_filtered_residuals_are_difference_quotients():
    v = np.random.default_rng(6).standard_normal((400, 1))
    whitening, step = Whitening((np.array([1.0, -0.4, 0.2]),), LENGTHS), 1e-6
    for k, slope in enumerate(whitening.slopes(v), start=1):
        moved = [whitening.filters[0] + sign * step * (np.arange(3) == k) for sign in (1.0, -1.0)]
        above, below = (Whitening((filter,), LENGTHS).through(v) for filter in moved)
        inside = np.r_[2:250, 252:400]
        assert slope[inside] == pytest.approx(((below - above) / (2.0 * step))[inside], abs=1e-6)


def test_the_arma_model_of_residuals_is_found():
    e = np.random.default_rng(7).standard_normal(4000)
    v = scipy.signal.lfilter([1.0, 0.5], [1.0, -0.8], e)[:, None]
    found = [one for (one,) in noises_of_residuals(v, (4000,))]
    coefficients = [C.size + D.size for C, D in found]
    assert coefficients == sorted(coefficients)
    C, D = next((C, D) for C, D in found if C.size == D.size == 2)
    assert pytest.approx([1.0, 0.5], abs=0.1) == C
    assert pytest.approx([1.0, -0.8], abs=0.1) == D


@pytest.mark.first(4)
@pytest.mark.parametrize("seed", [4, 5, 6, 8, 10, 16, 21, 24, 29])
def test_future_values_of_a_periodic_input_do_not_refute_the_model(seed):
    """The past of the input predicts its future; the rest is too small for a first-order correction."""
    rng = np.random.default_rng(seed)
    u = np.tile(np.repeat([1.0, -1.0], 6), 36)
    noise = scipy.signal.lfilter([0.045], [1.0, -0.85], rng.standard_normal(u.size))
    y = scipy.signal.lfilter([0.0, 0.0, 0.06], [1.0, -0.96], u) + noise + 0.05 * rng.standard_normal(u.size)
    one = np.ones(1)
    start = ((np.array([0.0, 0.0, 0.004, 0.001]),),), (np.array([1.0, -1.1, 0.2]),), ((one,),)
    armax = PolynomialModel(*start, (np.array([1.0, -0.7, 0.01]),), (one,), np.eye(1))
    assert not identify(armax, u[:, None], (y - y.mean())[:, None]).tests.answering


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", range(4))
def test_a_record_in_many_short_pieces_does_not_refute_its_model(seed):
    """Noise parameters explain nearly all of past residuals; a first-order mean of the rest is useless."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 8)
    noise = scipy.signal.lfilter([0.3], [1.0, -0.8], rng.standard_normal(u.size))
    y, one = scipy.signal.lfilter([0.0, 0.1], [1.0, -0.95], u) + noise, np.ones(1)
    F, C, D = (np.array([1.0, x]) for x in (-0.95, 0.05, -0.8))
    model = PolynomialModel(((np.array([0.0, 0.1]),),), (one,), ((F,),), (C,), (D,), np.eye(1))
    tests = identify(model, u[:, None], y[:, None], lengths=(40,) * 40).tests
    assert not failed(tests.scores)


@pytest.mark.parametrize(
    ("coloured", "powers", "refuted", "taken"),
    [
        (False, [1.0, 1.0], [], None),
        (True, [2.0, 1.0], [], 1),  # equal numbers of coefficients: the likelier
        (True, [1.0, 2.0], [], 0),
        (True, [1.0, 2.0, 0.1], [], 0),  # a smaller model is enough
        (True, [1.0, 2.0, 3.0], [0, 1], 2),
        (True, [2.0, 1.0], [0, 1, 2, 3, 4], 0),
    ],
)
def test_the_smallest_then_likeliest_noise_model_is_taken(coloured, powers, refuted, taken):
    """The first two noise models have one coefficient each; models with two and with four follow."""
    errors, tried = np.random.default_rng(1).standard_normal((400, 1)), []
    first = SimpleNamespace(errors=errors, lengths=(400,), tests=SimpleNamespace(coloured=coloured))

    def estimated(noises):
        number = len(tried)
        tried.append(noises)
        failed = [SimpleNamespace(fault="noise")] if number in refuted else []
        power = powers[number] if number < len(powers) else 4.0
        tests = SimpleNamespace(coloured=False, failed=failed)
        search = SimpleNamespace(converged=True)
        return SimpleNamespace(errors=power * errors, tests=tests, search=search), number

    assert with_larger_noise(first, estimated) == taken


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [9, 2, 3, 4, 7])
def test_short_records_that_begin_anywhere_do_not_refute_their_model(seed):
    """An F test of all starts does not refute rest, since each of the many unknowns explains little."""
    rng, parts = np.random.default_rng(seed), []
    for _ in range(12):
        u, e = np.repeat(rng.choice([-1.0, 1.0], 87), 4), 0.2 * rng.standard_normal(348)
        plant = 0.7 * scipy.signal.lfilter([0, 0, 0, 0, 0.12, 0.07], [1.0, -0.905], u)
        parts.append(np.stack([u, plant + scipy.signal.lfilter([1.0, 0.4], [1.0, -0.8], e)])[:, -50:])
    u, y = np.concatenate(parts, axis=1)
    B, one = np.array([0.0, 0.0, 0.0, 0.0, 0.084, 0.049]), np.ones(1)
    F, C, D = (np.array([1.0, x]) for x in (-0.905, 0.4, -0.8))
    model = PolynomialModel(((B,),), (one,), ((F,),), (C,), (D,), np.eye(1))
    assert not identify(model, u[:, None], y[:, None], lengths=(50,) * 12).tests.failed
