"""Delay and order of simulated plants are found; fits are those of their definition."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, strategies as st

from inputdesign_cli.errors import SpecError
from inputdesign_cli.explore import (
    answers_output,
    by_chance,
    explore_records,
    explore_structure,
    fits,
    order_of_excitation,
)
from inputdesign_cli.explore.division import divided
from inputdesign_cli.explore.regression import best_delays, output_error
from inputdesign_cli.plant import PolynomialModel

ONE = (np.ones(1),)


def siso(B, F=(1.0,), A=(1.0,), C=(1.0,), D=(1.0,), variance=1.0):
    rows = [np.array(p, dtype=float) for p in (B, F, A, C, D)]
    return PolynomialModel(
        ((rows[0],),), (rows[2],), ((rows[1],),), (rows[3],), (rows[4],), np.array([[variance]])
    )


def held(rng, samples, hold=6):
    return np.repeat(rng.choice([-1.0, 1.0], samples // hold + 1), hold)[:samples]


def lag_with_dead_time(rng, delay, samples=400, ratio=10.0):
    u = held(rng, samples)
    x = scipy.signal.lfilter(np.concatenate([np.zeros(delay), [0.15, 0.05]]), [1, -0.85], u)
    noise = np.std(x) / np.sqrt(ratio) * rng.standard_normal(samples)
    return u[:, None], (x + noise)[:, None]


@pytest.mark.parametrize("delay", [1, 4, 9, 17])
def test_the_delay_of_a_lag_is_found_at_ten_decibels(delay):
    for seed in range(5):
        record = lag_with_dead_time(np.random.default_rng(seed), delay)
        assert abs(best_delays([record], 1, 2, 60, (0,)).delays[0] - delay) <= 1


def test_the_best_delay_is_that_of_a_search_over_all():
    record = lag_with_dead_time(np.random.default_rng(9), 7)
    losses = [output_error([record], 1, 2, (d,)).loss for d in range(30)]
    found = best_delays([record], 1, 2, 29, (0,))
    assert found.loss <= min(losses) * 1.001


def test_order_and_family_of_a_simulated_plant():
    u, y = lag_with_dead_time(np.random.default_rng(3), 4, samples=600)
    found = explore_structure([(u[:360], y[:360])], [(u[360:], y[360:])])
    best = found.best
    assert abs(best.orders.order - 1) <= 1
    assert abs(best.orders.delays[0] - 4) <= 1
    ((low, high),) = found.ranges(best)
    assert low <= best.orders.delays[0] <= high
    # A candidate has a range of its own, and with more coefficients it is no narrower at its low end.
    assert len({found.ranges(c) for c in found.finalists}) > 1
    assert all(found.ranges(c)[0][0] <= 4 for c in found.finalists)
    noise_free = 100.0 * (1.0 - np.sqrt(1.0 / 11.0))
    assert best.validation == pytest.approx(noise_free, abs=5.0)


def test_a_level_and_a_start_cost_no_fit():
    """A simulation from any state about any level, without noise, explains everything."""
    rng = np.random.default_rng(5)
    u = rng.standard_normal(300)
    F = [1.0, -1.5, 0.7]
    y = 7.0 + scipy.signal.lfilter([0.0, 1.0, 0.5], F, u)
    model = siso([0.0, 1.0, 0.5], F)
    part = [(u[100:, None], y[100:, None])]
    assert fits(model, part).simulation[0] > 100.0 - 1e-6
    assert fits(model, part).prediction[0] > 100.0 - 1e-6


def test_the_fit_is_that_of_its_definition():
    rng = np.random.default_rng(6)
    u, e = rng.standard_normal((2, 2000))
    y = scipy.signal.lfilter([0.0, 1.0], [1.0, -0.5], u) + e
    found = fits(siso([0.0, 1.0], [1.0, -0.5]), [(u[:, None], y[:, None])])
    plain = 100.0 * (1.0 - np.linalg.norm(e) / np.linalg.norm(y - y.mean()))
    assert found.simulation[0] == pytest.approx(plain, abs=0.3)


def test_noise_explains_itself_by_chance_as_seldom_as_stated():
    """The best of 10 sets of three random signals explains that much in 5 % at most."""
    rng = np.random.default_rng(4)
    limit, above = by_chance(60, 3, 10), 0
    for _ in range(1000):
        y = rng.standard_normal(60)
        left = []
        for _ in range(10):
            basis = np.linalg.qr(rng.standard_normal((60, 3)))[0]
            left.append(np.linalg.norm(y - basis @ (basis.T @ y)))
        above += 100.0 * (1.0 - min(left) / np.linalg.norm(y)) > limit
    assert above <= 65


def test_an_unstable_model_has_no_simulation():
    rng = np.random.default_rng(7)
    u, y = rng.standard_normal((2, 3000, 1))
    assert fits(siso([0.0, 1.0], [1.0, -1.5]), [(u, y)]).simulation[0] < -1e3


def test_a_loop_is_noticed_and_an_open_one_is_not():
    rng = np.random.default_rng(10)
    e = rng.standard_normal(1500)
    y, u = np.zeros(1500), np.zeros(1500)
    for k in range(1, 1500):
        y[k] = 0.8 * y[k - 1] + 0.5 * u[k - 1] + e[k]
        u[k] = -0.6 * y[k] + 0.3 * rng.standard_normal()
    assert [j for j, _ in answers_output([(u[:, None], y[:, None])])] == [0]
    free = rng.standard_normal(1500)
    driven = scipy.signal.lfilter([0, 0.5], [1, -0.8], free) + e
    assert answers_output([(free[:, None], driven[:, None])]) == []


def looped(rng, samples, pattern, noise):
    """u = r - y without delay, about 0.3 q^-1 / (1 - 0.8 q^-1): u (n, 1), y (n, 1)."""
    e = 0.2 * rng.standard_normal(samples)
    v = scipy.signal.lfilter([1.0], [1.0, -0.8], e) if noise == "arx" else e
    r = held(rng, samples, 5) if pattern == "prbs" else np.repeat([0.0, 1, 0, 1, -1], samples // 5)
    u, y, x = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    for k in range(samples):
        x[k] = 0.8 * x[k - 1] + 0.3 * u[k - 1] if k else 0.0
        y[k] = x[k] + v[k]
        u[k] = r[k] - y[k]
    return u[:, None], y[:, None]


@pytest.mark.parametrize(
    ("pattern", "noise"),
    [
        ("prbs", "arx"),
        *(pytest.param(*pair, marks=pytest.mark.slow) for pair in (("steps", "oe"), ("prbs", "oe"))),
    ],
)
def test_a_controller_that_answers_at_once_is_not_taken_for_the_plant(pattern, noise):
    found = explore_records([looped(np.random.default_rng(1), 1000, pattern, noise)], feedback=True)
    (taken,) = found.taken
    assert taken.orders.delays == (1,)
    assert not taken.failed
    w = np.array([1e-4, 0.2])
    expected = 0.3 * np.exp(-1j * w) / (1.0 - 0.8 * np.exp(-1j * w))
    np.testing.assert_allclose(found.model.plant_at(w)[:, 0, 0], expected, rtol=0.15)


@pytest.mark.slow
def test_a_plant_that_acts_at_once_in_a_loop_that_answers_late():
    """Rows that hold what was applied and what it led to: u answers the row before."""
    rng = np.random.default_rng(3)
    e, r = 0.2 * rng.standard_normal(1000), held(rng, 1000, 5)
    u, y, x = np.zeros(1000), np.zeros(1000), 0.0
    for k in range(1000):
        u[k] = r[k] - y[k - 1]
        x = 0.8 * x + 0.3 * u[k]
        y[k] = x + e[k]
    found = explore_records([(u[:, None], y[:, None])], feedback=True)
    assert found.taken[0].orders.delays == (0,)


@pytest.mark.parametrize(
    ("hold", "delay"),
    [(1, 0), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in ((8, 2), (1, 2), (8, 0)))],
)
def test_a_static_gain_has_no_pole(delay, hold):
    rng = np.random.default_rng(1)
    u = held(rng, 1000, hold)
    y = 3.0 * np.concatenate([np.zeros(delay), u[: 1000 - delay]]) + 0.2 * rng.standard_normal(1000)
    record = (u[:, None], y[:, None])
    assert answers_output([record]) == []
    found = explore_records([record])
    assert found.taken[0].orders.order == 0
    assert found.taken[0].orders.delays == (delay,)
    assert found.model.names == (f"b{delay}",)
    assert found.model.theta == pytest.approx([3.0], abs=4.0 * 0.2 / np.sqrt(1000))


@pytest.mark.parametrize("hold", [5, 20, 60])
@pytest.mark.parametrize("pole", [0.7, 0.99])
def test_an_input_that_is_held_is_no_answer(hold, pole):
    """Its own past predicts it badly where that is cut off, and a plant that remembers it tells more."""
    rng = np.random.default_rng(hold)
    u = np.sign(rng.standard_normal(20000 // hold)).repeat(hold)
    e = scipy.signal.lfilter([1.0], [1.0, -0.8], 0.3 * rng.standard_normal(u.size))
    y = scipy.signal.lfilter([0.0, 0.0, 1.0 - pole], [1.0, -pole], u) + e
    assert answers_output([(u[:, None], y[:, None])]) == []


def test_a_long_record_of_a_held_input_is_no_loop():
    """What is new in y has u of a sample before those that u is regressed on, and a static gain shows it."""
    rng = np.random.default_rng(0)
    u = held(rng, 20000, 10)
    y = 0.5 * u + rng.standard_normal(20000)
    assert answers_output([(u[:, None], y[:, None])]) == []


def test_sinusoids_excite_twice_their_number():
    t = np.arange(400.0)
    u = sum(np.sin(2.0 * np.pi * k / 400.0 * t + k) for k in (25, 70, 130))
    assert order_of_excitation([(u[:, None], u[:, None])]) == 6
    noise = np.random.default_rng(1).standard_normal((400, 1))
    assert order_of_excitation([(noise, noise)], most=20) == 20


@pytest.mark.parametrize("digits", [5, 8, 15])
def test_a_part_of_a_period_tells_no_more_than_whole_ones(digits):
    """The mean of a sinusoid that ends within a period is no excitation, nor is what rounding adds."""
    u = np.round(np.sin(0.3 * np.arange(790.0) + 1.0) + 5.0, digits)[:, None]
    assert order_of_excitation([(u, u)]) == 2


@pytest.mark.parametrize("at", [12, 60, 150])
def test_a_step_excites_as_many_delays_as_stand_before_it(at):
    """And, behind it, as many as there are samples."""
    u = (np.arange(200) >= at)[:, None].astype(float)
    assert order_of_excitation([(u, u)]) == min(at, 50)


def test_every_input_moves_in_both_parts():
    u = np.zeros((1000, 2))
    u[:500, 0], u[500:, 1] = held(np.random.default_rng(1), 500), held(np.random.default_rng(2), 500)
    first, second, split, _ = divided([(u, u)])
    assert split == "blocks in turn"
    for part in (first, second):
        assert np.all(np.concatenate([x for x, _ in part]).std(axis=0) > 0)


@pytest.mark.parametrize("ramp", [1, 3, 8])
def test_a_single_step_is_not_cut_in_two(ramp):
    """Wherever it is: one edge of a block in its midst would let two parts seem to move."""
    flicker = 0.02 * np.random.default_rng(1).choice([-1.0, 1.0], (400, 1))
    for at in range(4, 390, 5):
        u = np.clip((np.arange(400.0)[:, None] - at) / ramp, 0.0, 1.0) + flicker
        assert divided([(u, u)])[2] == "none", at


@given(st.integers(20, 260), st.integers(40, 120))
def test_a_step_and_the_step_back_are_parted(at, width):
    u = ((np.arange(400) >= at) & (np.arange(400) < at + width)).astype(float)[:, None]
    first, second, split, _ = divided([(u, u)])
    assert split != "none"
    for part in (first, second):
        assert max(np.ptp(own) for own, _ in part) == 1.0


def test_an_input_that_never_moves_has_no_part_of_the_model():
    rng = np.random.default_rng(11)
    u, y = lag_with_dead_time(rng, 2, samples=300)
    found = explore_records([(np.column_stack([np.full(300, 3.0), u]), y)])
    assert found.still == (0,)
    assert not np.any(found.model.B[0][0])
    assert found.estimate.names == found.model.names
    assert found.ranges == (found.outputs[0].ranges(found.taken[0]),)
    with pytest.raises(SpecError, match="same value"):
        explore_records([(np.full((300, 1), 3.0), y)])


def test_too_short_a_record_is_refused():
    rng = np.random.default_rng(12)
    with pytest.raises(SpecError, match="too few"):
        explore_records([(rng.standard_normal((20, 1)), rng.standard_normal((20, 1)))])


@pytest.mark.parametrize(("at", "flicker"), [(20, 0.0), (110, 0.02)])
def test_a_record_of_a_single_step_estimates_and_judges_at_once(at, flicker):
    """A lag of ten samples, gain one; a part of it tells nothing, also where u flickers."""
    rng = np.random.default_rng(1)
    u = (np.arange(200) >= at)[:, None].astype(float)
    y = scipy.signal.lfilter([0, 0.1], [1, -0.9], u, axis=0) + 0.02 * rng.standard_normal((200, 1))
    found = explore_records([(u + flicker * rng.choice([-1.0, 1.0], u.shape), y)])
    assert found.split == "none"
    gain = float(abs(found.model.plant_at(np.array([1e-4]))[0, 0, 0]))
    at_corner = float(abs(found.model.plant_at(np.array([0.1]))[0, 0, 0]))
    assert gain == pytest.approx(1.0, abs=0.03)
    assert at_corner == pytest.approx(abs(0.1 / (1 - 0.9 * np.exp(-0.1j))), rel=0.1)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))])
def test_the_range_of_a_delay_holds_it(seed):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 5)[:, None]
    y = scipy.signal.lfilter([0, 0, 0, 0.2], [1, -1.2, 0.4], u, axis=0) + 0.3 * rng.standard_normal((300, 1))
    chosen = explore_structure([(u[:180], y[:180])], [(u[180:], y[180:])])
    for candidate in chosen.candidates:
        for delay, (low, high) in zip(candidate.orders.delays, chosen.ranges(candidate), strict=True):
            assert low <= delay
            assert high is None or delay <= high
    assert None not in sum(chosen.ranges(chosen.best), ())


def test_what_is_tried_next_is_unbiased_and_stable_first():
    """Where the best cannot be estimated from the whole record; within each kind, the best first."""
    rng = np.random.default_rng(3)
    u, y = rng.standard_normal((2, 40, 1))
    one = explore_structure([(u[:24], y[:24])], [(u[24:], y[24:])], physical=False)
    arx, oe = (next(c for c in one.candidates if c.orders.family == name) for name in ("ARX", "OE"))
    edge = replace(oe, steady=False, validation=95.0)
    biased = replace(arx, steady=True, failed=("trend",), validation=96.0)
    plain = replace(oe, steady=True, failed=(), validation=89.0)
    weak = replace(oe, steady=True, failed=("trend",), validation=80.0)
    chosen = replace(one, candidates=(edge, biased, plain, weak), finalists=(edge, biased))
    assert [c.validation for c in chosen.ranked] == [89.0, 80.0, 96.0, 95.0]
