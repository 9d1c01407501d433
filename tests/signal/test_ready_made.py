"""Ready-made signals and signals of few levels: shift registers, converters, ramps and switching times."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.questions.ready_made import ReadyMade, make_signal
from inputdesign_cli.signal.constraints import largest_move, ramped
from inputdesign_cli.signal.evaluation import Target
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.levels import few_levels
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.lines import DesignedSpectrum, grid_lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.prbs import register_length
from inputdesign_cli.signal.ready_made import equal_lines, excites, scaled
from inputdesign_cli.signal.selection import best_record, better_switching
from inputdesign_cli.signal.settings import Quantiser, SignalSettings
from inputdesign_cli.spectrum import FirBasis
from tests.support.refusals import code_of, refused
from tests.support.signals import COLOURED, block_spectrum, of_two_inputs, periodogram


def made(kind, samples, inputs=1, *more, odd=False, **settings):
    return equal_lines(
        SignalSettings(kind, phases="even", seed=5, **settings), samples, inputs, *more, odd=odd
    )


@pytest.mark.parametrize("bits", [2, 3, 7, 10])
def test_a_prbs_is_white_over_its_period(bits):
    period = 2**bits - 1
    u = made("prbs", 2 * period, bits=bits)
    assert register_length(period) == bits
    assert set(np.unique(u)) == {-1.0, 1.0}
    assert np.array_equal(u[:period], u[period:])
    lag = np.fft.irfft(np.abs(np.fft.rfft(u[:period, 0])) ** 2, period) / period
    assert lag[1:] == pytest.approx(np.full(period - 1, -1.0 / period), abs=1e-12)
    (found,) = excites(u)
    assert found.order == period - 1  # every line of the circle but the mean
    assert abs(found.mean) == pytest.approx(1.0 / period)
    assert found.power == pytest.approx(1.0 - 1.0 / period**2)


@pytest.mark.parametrize("kind", ["white", "multisine", "filtered_noise", "chirp"])
def test_a_held_signal_keeps_its_band_and_its_periods(kind):
    """Holding adds images beyond pi / hold only, so that below it the band of the spec is excited."""
    asked = ReadyMade(kind, band=(0.2, 1.0), samples=3000, hold=2, periods=3, sample_time=0.5)
    u = make_signal(asked).tables["signal"].columns["u1"]
    assert np.array_equal(u[:1000], u[1000:2000])
    power, w = np.abs(np.fft.rfft(u - u.mean())) ** 2, 2.0 * np.pi * np.arange(1501) / 3000 / 0.5
    inside = (w >= 0.2) & (w <= 1.0)
    assert power[inside].sum() > 0.95 * power[w <= np.pi].sum()
    assert power[(w > 0.8) & inside].sum() > 0.1 * power[inside].sum()


def test_inputs_of_a_prbs_are_hardly_correlated():
    u = made("prbs", 1023, 3, bits=10)
    gram = u.T @ u / 1023
    assert np.abs(gram - np.eye(3)).max() == pytest.approx(1.0 / 1023)


@pytest.mark.parametrize("odd", [False, True])
def test_a_multisine_has_equal_lines_of_a_low_peak(odd):
    u = made("multisine", 600, 1, (0.1, 2.0), 25, odd=odd)
    power = np.abs(np.fft.rfft(u[:, 0])) ** 2
    lines = np.flatnonzero(power > 1e-9 * power.max())
    assert lines.size == 25
    assert not odd or np.all(lines % 2 == 1)
    assert power[lines] == pytest.approx(np.full(25, power[lines[0]]))
    (found,) = excites(u)
    assert found.order == 50
    assert found.crest_factor < 1.8  # random phases: about 3
    low, high = found.band
    assert 0.1 <= low < high <= 2.0


def test_inputs_of_a_multisine_are_orthogonal():
    u = made("multisine", 3 * 128, 3, (0.0, np.pi), 10)
    gram = u.T @ u
    assert np.abs(gram - np.diag(np.diag(gram))).max() < 1e-9 * gram[0, 0]


def test_a_chirp_sweeps_its_band():
    u = made("chirp", 20000, 1, (0.1, 1.0))
    assert np.abs(u).max() <= 1.0
    (found,) = excites(u)
    # Power is even over the band, and a twentieth lies on either side.
    assert found.band == pytest.approx((0.145, 0.955), abs=0.01)
    assert found.crest_factor == pytest.approx(np.sqrt(2), rel=0.02)


def test_steps_take_every_level_once():
    u = made("steps", 600, 2, number=6)
    for channel in u.T:
        assert sorted(channel[50::100]) == pytest.approx(np.linspace(-1, 1, 6))
        assert np.count_nonzero(np.diff(channel)) == 5


def test_signals_are_scaled_to_the_requested_ranges():
    found = scaled(np.array([[-1.0, 1.0], [1.0, -1.0]]), [(0.0, 5.0), (2.0, 3.0)])
    assert found.tolist() == [[0.0, 3.0], [5.0, 2.0]]


def test_a_constant_excites_nothing():
    (found,) = excites(np.ones((10, 1)))
    assert (found.order, found.power, found.crest_factor) == (0, 0.0, 1.0)


@pytest.mark.parametrize(
    "asked",
    [
        ReadyMade("prbs", bits=30),
        ReadyMade("prbs", bits=4, hold=2_000_000_000),
        ReadyMade("multisine", number=5, samples=1_000_000_000),
        ReadyMade("chirp", samples=1_000_000_000),
        ReadyMade("steps", number=3, samples=9_000_000, levels=((0.0, 1.0),) * 2),
        ReadyMade("steps", number=1_000_000_000),
    ],
)
def test_a_signal_that_is_too_large_is_refused_before_it_is_made(asked):
    found = refused(make_signal, asked)
    assert found[0].code == "too-large"
    assert "at most" in found[0].hint


def test_levels_are_written_without_rounding():
    levels = scaled(made("steps", 11, number=11), [(40.0, 60.0)])[:, 0]
    assert sorted(levels.tolist()) == [float(x) for x in range(40, 61, 2)]
    tiny = scaled(np.array([[-1.0], [0.0], [1.0]]), [(0.0, 1e-20)])[:, 0]
    assert tiny == pytest.approx([0.0, 5e-21, 1e-20], rel=1e-12)


@pytest.mark.parametrize("bits", [2, 3, 4])
def test_inputs_of_a_period_are_independent_or_refused(bits):
    """A period of 2^bits - 1 samples about its mean has 2^bits - 2 directions."""
    for inputs in range(2, 2**bits + 2):
        asked = ReadyMade("prbs", bits=bits, levels=((-1.0, 1.0),) * inputs)
        if inputs > 2**bits - 2:
            assert code_of(make_signal, asked) == "bad-period"
            continue
        columns = make_signal(asked).tables["signal"].columns
        u = np.stack([values for name, values in columns.items() if name.startswith("u")], axis=1)
        singular = np.linalg.svd(u - u.mean(axis=0), compute_uv=False)
        assert singular[-1] > 0.1


def test_reported_properties_agree_with_the_samples_of_a_cut_sequence():
    """A hundred samples of a sequence of 31 end within a period, which changes mean, power and lines."""
    results = make_signal(ReadyMade("prbs", bits=5, samples=100))
    u, told = results.tables["signal"].columns["u1"], results.result["signal"]["channels"]["u1"]
    assert told["mean"] == pytest.approx(np.mean(u))
    assert told["power"] == pytest.approx(np.var(u))
    assert told["peak"] == pytest.approx(np.abs(u - np.mean(u)).max())
    circle = np.stack([np.roll(u - np.mean(u), lag) for lag in range(100)])
    assert told["order_of_excitation"] == np.linalg.matrix_rank(circle @ circle.T, hermitian=True)


@pytest.mark.parametrize("band", [(0.001, 0.01), (0.0, 0.02), (0.1, 1.0), (0.3, 0.4), (2.0, 3.1)])
def test_a_chirp_shorter_than_a_turn_is_refused_with_the_samples_it_needs(band):
    levels = ((20.0, 80.0),)
    (told,) = refused(make_signal, ReadyMade("chirp", band=band, samples=2, levels=levels))
    assert told.code == "bad-period"
    (least,) = re.findall(r"--samples (\d+) or more", told.hint)
    # A turn is 2 pi of phase, and the phase is the integral of the frequency.
    assert (int(least) - 1) * np.mean(band) < 2.0 * np.pi <= int(least) * np.mean(band)
    made = make_signal(ReadyMade("chirp", band=band, samples=int(least), levels=levels))
    u = made.tables["signal"].columns["u1"]
    ends = u.min() - 20.0, 80.0 - u.max()
    assert min(ends) == pytest.approx(0.0, abs=1e-9)
    if band[1] <= 1.0:  # a few samples for each turn
        assert max(ends) < 3.0


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize(("kind", "values"), [("binary", {-1.0, 1.0}), ("ternary", {-1.0, 0.0, 1.0})])
def test_signals_of_few_levels_at_one_input_come_near_the_spectrum(kind, values):
    """Few levels only, and a spectrum nearer to the wanted one than that of the signs of noise."""
    samples = 512
    lines = grid_lines(FirBasis(1, 3).density(COLOURED, 2 * np.pi * np.arange(257) / samples), samples, 1.0)
    power = lines.totals

    def misfit(x):
        found = np.sqrt(periodogram(x))
        wanted = np.sqrt(power)
        return 1 - (found @ wanted) ** 2 / (found @ found) / (wanted @ wanted)

    record = few_levels(lines, samples, rng(), kind_of(kind).nearest)[:, 0]
    assert set(np.unique(np.sign(record))) <= values
    assert np.unique(np.abs(record[record != 0.0])).size == 1
    signs = [
        misfit(np.sign(multisine_record(lines, samples, rng(seed), "orthogonal")[:, 0])) for seed in range(10)
    ]
    assert misfit(record) < 0.35 * min(signs)


@pytest.mark.parametrize(("kind", "number"), [("binary", 2), ("ternary", 3)])
@pytest.mark.parametrize("samples", [480, 481])
def test_signals_of_few_levels_at_two_inputs_come_near_the_spectrum(kind, number, samples):
    """Levels of the powers of the inputs, and a matrix spectrum nearer than that of clipped multisines."""
    lines = grid_lines(of_two_inputs(2 * np.pi * np.arange(121) / 240), 240, 1.0)
    record = few_levels(lines, samples, rng(), kind_of(kind).nearest)
    assert record.shape == (samples, 2)
    assert all(np.unique(column).size == number for column in record.T)
    np.testing.assert_allclose(np.mean(record[:480] ** 2, axis=0), lines.mean_squares, rtol=0.01)
    wanted = of_two_inputs(2 * np.pi * np.arange(121) / 240)

    def error(x):
        return np.linalg.norm(block_spectrum(x[:480], 2) - wanted) / np.linalg.norm(wanted)

    def signs(seed):
        return np.sign(multisine_record(lines, 480, rng(seed), "orthogonal")) * np.sqrt(lines.mean_squares)

    assert error(record) < 0.8 * min(error(signs(seed)) for seed in range(5))


def test_a_quantiser_rounds_to_its_steps_and_saturates():
    converter = Quantiser(bits=3, span=4.0, offset=1.4)  # values -4, -3, .., 3
    assert converter.step == 1.0
    assert converter.operating_point == 1.0
    np.testing.assert_array_equal(converter.steps(np.array([-9.0, -0.4, 0.6, 9.0])), [-5, 0, 1, 2])
    assert converter.reach() == 2.0


@pytest.mark.parametrize("rate", [0.3, 0.5, 3.0])
def test_far_switches_make_a_trapezoid(rate):
    """Straight lines between the corners: a switch at t leads to the other level 2 / rate samples after."""
    switches, level = [0, 13, 40, 71], 1.0
    values, corners, heights = np.empty(90), [-1.0], [0.0]
    for at in switches:
        values[at:] = level
        corners += [at - 1.0, at - 1.0 + (level - heights[-1]) * level / rate]
        heights += [heights[-1], level]
        level = -level
    expected = np.interp(np.arange(90), [*corners, 90.0], [*heights, heights[-1]])
    np.testing.assert_allclose(ramped(values, rate), expected, atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 5.0))
def test_slow_records_are_followed_as_they_are_and_others_at_full_speed(seed, rate):
    values = np.random.default_rng(seed).normal(size=60)
    found = ramped(values, rate)
    assert largest_move(found) <= rate * (1 + 1e-12)
    moves = np.abs(np.diff(found, prepend=0.0))
    assert np.all((found == values) | (moves >= rate * (1 - 1e-9)))
    np.testing.assert_array_equal(ramped(0.999 * found, rate), 0.999 * found)


def test_the_search_finds_switches_that_are_known():
    """The sign of a sinusoid has the largest product with it of all signals of two levels."""
    wave = np.sin(2 * np.pi * (np.arange(60) + 0.5) / 20)
    best = np.abs(wave).sum()
    start = np.where(np.random.default_rng(0).random((60, 1)) < 0.5, -2.0, 2.0)

    def figure(values):
        return 2.0 - float(wave @ values[:, 0]) / (2.0 * best) + 1e-12

    found = better_switching(start, figure, np.random.default_rng(1), 5000)
    np.testing.assert_array_equal(found[:, 0], 2.0 * np.sign(wave))


def test_the_search_keeps_the_best_values_and_ends_when_they_suffice():
    rng, start, asked = np.random.default_rng(2), np.ones((30, 2)), []

    def figure(values):
        asked.append(values)
        return 3.0 - float(np.mean(values[:, 1] < 0.0)) * 4.0

    found = better_switching(start, figure, rng, 300, 1.0)
    assert figure(found) == min(map(figure, list(asked))) <= 1.0
    assert set(np.unique(found)) <= {-1.0, 1.0}
    first = len(asked)
    better_switching(found, figure, rng, 300, 1.0)
    assert len(asked) == first + 1
    np.testing.assert_array_equal(start, 1.0)


def test_a_search_that_improves_too_slowly_or_runs_out_of_time_ends():
    start, asked = np.ones((40, 1)), []

    def figure(values):
        asked.append(values)
        return 2.0 - 1e-4 * len(asked)

    better_switching(start, figure, np.random.default_rng(3), 600, 1.0)
    assert len(asked) == 101
    better_switching(start, figure, np.random.default_rng(3), 600)
    assert len(asked) == 101 + 601
    with time_limit(0.0):
        assert better_switching(start, figure, np.random.default_rng(3), 600) is start


@pytest.mark.parametrize("quantiser", [None, Quantiser(5, 0.8)], ids=["plain", "converter"])
@pytest.mark.parametrize(("periods", "hold"), [(1, 1), (2, 1), (1, 2)])
def test_every_sample_is_at_a_level_or_moves_at_the_rate(first_order, quantiser, periods, hold):
    """The limits hold exactly with and without a converter; the height is the largest within them."""
    experiment = replace(first_order, samples=240)
    spectrum = DesignedSpectrum.of(FirBasis(1, 2), np.array([1.0, 0.7, 0.3]), inputs=1)
    settings = SignalSettings("slewed", periods=periods, hold=hold, candidates=1, most_candidates=1)
    bounds = Bounds(
        amplitude=np.array([0.72]),
        rate=np.array([0.32]),
        quantisers=() if quantiser is None else (quantiser,),
    )
    generator = SignalGenerator(spectrum, settings, 240)
    plant = FiniteRecord(experiment, 240)
    target = Target(lambda M: 1e6 / np.sqrt(np.trace(M)), meets=True)  # out of reach
    record = best_record(generator, plant, target, bounds)
    assert not record.met
    u = record.samples[::hold, 0]
    np.testing.assert_array_equal(np.repeat(u, hold), record.samples[:, 0])
    step = 0.05 if quantiser is not None else None
    most, fastest = (0.72, 0.32) if step is None else (0.7, 0.3)
    moves = np.abs(np.diff(u, prepend=0.0))
    assert np.abs(u).max() <= 0.72
    assert moves.max() <= 0.32
    levels = np.isclose(np.abs(u), most, rtol=1e-9)
    assert levels.any()
    assert np.all(levels | np.isclose(moves, fastest, rtol=1e-9))
    if step is not None:
        np.testing.assert_allclose(u / step, np.rint(u / step), atol=1e-9)
