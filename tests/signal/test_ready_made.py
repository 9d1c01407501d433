"""Ready-made signals: what the textbooks say of them."""

import re

import numpy as np
import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.ready_made import ReadyMade, make_signal
from inputdesign_cli.signal.ready_made import equal_lines, excites, scaled
from inputdesign_cli.signal.settings import SignalSettings


def made(kind, samples, inputs=1, *more, odd=False, **settings):
    return equal_lines(
        SignalSettings(kind, phases="even", seed=5, **settings), samples, inputs, *more, odd=odd
    )


@pytest.mark.parametrize("bits", [3, 7, 10])
def test_a_prbs_is_white_over_its_period(bits):
    period = 2**bits - 1
    u = made("prbs", 2 * period, bits=bits)
    assert set(np.unique(u)) == {-1.0, 1.0}
    assert np.array_equal(u[:period], u[period:])
    lag = np.fft.irfft(np.abs(np.fft.rfft(u[:period, 0])) ** 2, period) / period
    assert lag[1:] == pytest.approx(np.full(period - 1, -1.0 / period), abs=1e-12)
    (found,) = excites(u)
    assert found.order == period - 1  # every line of the circle but the mean
    assert abs(found.mean) == pytest.approx(1.0 / period)
    assert found.power == pytest.approx(1.0 - 1.0 / period**2)


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


def test_ranges_are_those_asked_for():
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
def test_what_would_not_fit_is_refused_before_it_is_made(asked):
    with pytest.raises(SpecError) as caught:
        make_signal(asked)
    assert caught.value.diagnostics[0].code == "too-large"
    assert "at most" in caught.value.diagnostics[0].hint


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
            with pytest.raises(SpecError, match="follow from the others"):
                make_signal(asked)
            continue
        columns = make_signal(asked).tables["signal"].columns
        u = np.stack([values for name, values in columns.items() if name.startswith("u")], axis=1)
        singular = np.linalg.svd(u - u.mean(axis=0), compute_uv=False)
        assert singular[-1] > 0.1


def test_what_is_told_is_that_of_the_samples_that_are_made():
    """A hundred samples of a sequence of 31 end within a period: its mean, power and lines are others."""
    results = make_signal(ReadyMade("prbs", bits=5, samples=100))
    u, told = results.tables["signal"].columns["u1"], results.result["signal"]["channels"]["u1"]
    assert told["mean"] == pytest.approx(np.mean(u))
    assert told["power"] == pytest.approx(np.var(u))
    assert told["peak"] == pytest.approx(np.abs(u - np.mean(u)).max())
    circle = np.stack([np.roll(u - np.mean(u), lag) for lag in range(100)])
    assert told["order_of_excitation"] == np.linalg.matrix_rank(circle @ circle.T, hermitian=True)


@pytest.mark.parametrize("band", [(0.001, 0.01), (0.0, 0.02), (0.1, 1.0), (0.3, 0.4), (2.0, 3.1)])
def test_a_chirp_that_is_shorter_than_a_turn_is_refused_with_the_samples_that_cover_its_range(band):
    levels = ((20.0, 80.0),)
    with pytest.raises(SpecError, match="less than one turn") as caught:
        make_signal(ReadyMade("chirp", band=band, samples=2, levels=levels))
    (least,) = re.findall(r"--samples (\d+) or more", caught.value.diagnostics[0].hint)
    # A turn is 2 pi of phase, and the phase is the integral of the frequency.
    assert (int(least) - 1) * np.mean(band) < 2.0 * np.pi <= int(least) * np.mean(band)
    made = make_signal(ReadyMade("chirp", band=band, samples=int(least), levels=levels))
    u = made.tables["signal"].columns["u1"]
    ends = u.min() - 20.0, 80.0 - u.max()
    assert min(ends) == pytest.approx(0.0, abs=1e-9)
    if band[1] <= 1.0:  # a few samples for each turn
        assert max(ends) < 3.0
