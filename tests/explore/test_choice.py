"""The simplest structure that explains a simulated plant is found, its parameters within their errors."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.division import divided
from inputdesign_cli.explore.joint import explore_records
from inputdesign_cli.explore.search import explore_structure, ranked
from inputdesign_cli.plant import SampledModel
from tests.explore.plants import column, held, with_noise
from tests.explore.test_sweep import drifting
from tests.support.loops import loop, pid
from tests.support.plants import lag_of
from tests.support.refusals import code_of

STEP = 0.5


def first_order(seed, samples=600, K=2.0, T=6.0, L=1.7, hold=10, ratio=10.0, pole=0.0):
    """Return a record of a lag with dead time, samples half a unit of time apart."""
    rng = np.random.default_rng(seed)
    u = held(rng, samples, hold)[:, None]
    x, _ = SampledModel(lag_of([K], [T, 1.0], L), STEP).simulate(u, np.zeros(u.shape), 1.0)
    return u, 30.0 + with_noise(rng, x, ratio, pole)


@pytest.fixture(scope="module")
def found():
    return explore_records([first_order(2, 400, ratio=25.0)], step=STEP)


def test_gain_time_constant_and_dead_time_are_found(found):
    assert found.model.names == ("K", "T", "L")
    deviations = (found.estimate.theta - [2.0, 6.0, 1.7]) / np.sqrt(np.diag(found.estimate.covariance))
    assert np.all(np.abs(deviations) < 4.0)
    assert not np.any(found.slopes)
    assert not found.wanders[0]


def test_delays_lie_within_their_ranges(found):
    """A dead time of 3.4 samples lets the input act from lag 4 on."""
    (chosen,) = found.outputs
    for candidate in chosen.candidates:
        ((low, high),) = candidate.ranges
        assert low <= candidate.orders.delays[0] <= high
    ((low, high),) = found.taken[0].ranges
    assert low <= 4 <= high


@pytest.mark.slow
def test_delays_and_orders_of_a_hundred_plants_at_ten_decibels():
    """Dead times to 15 samples, time constants of 4 to 25; delays within one sample in 95, orders in 95."""
    delays = orders = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        T, L, hold = STEP * rng.uniform(4.0, 25.0), STEP * rng.uniform(0.0, 15.0), int(rng.integers(4, 12))
        u, y = first_order(seed, 400, rng.uniform(0.5, 3.0), T, L, hold)
        best = explore_structure([(u[:240], y[:240])], [(u[240:], y[240:])], step=STEP).best
        delays += abs(best.orders.delays[0] - int(np.floor(L / STEP)) - 1) <= 1
        orders += abs(best.orders.order - 1) <= 1
    assert delays >= 95
    assert orders >= 95


@pytest.mark.slow
@pytest.mark.parametrize(
    "pole",
    [
        0.0,
        0.9,
        pytest.param(0.95, marks=pytest.mark.xfail(strict=True, reason="noise as slow as the plant: 4 of 6")),
    ],
)
def test_a_lag_with_dead_time_is_preferred_where_it_explains_as_well(pole):
    """At least five of six records lead to it, in noise of this pole."""
    families = [
        explore_records([first_order(seed, pole=pole)], step=STEP).taken[0].orders.family for seed in range(6)
    ]
    assert families.count("FOPDT") >= 5


def test_a_second_order_plant_is_not_taken_for_a_first_order_one():
    rng = np.random.default_rng(4)
    u = held(rng, 600, 12)
    x = scipy.signal.lfilter([0, 0, 0.05, 0.04], [1, -1.7, 0.8], u)
    found = explore_records([column(u, with_noise(rng, x, 30.0))])
    assert found.taken[0].orders.order == 2
    w = np.array([1e-3, 0.1, 0.3])
    q = np.exp(-1j * w)
    truth = (0.05 * q**2 + 0.04 * q**3) / (1 - 1.7 * q + 0.8 * q**2)
    np.testing.assert_allclose(found.model.plant_at(w)[:, 0, 0], truth, rtol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("hold", "delay"), [(1, 0), (8, 2)])
def test_a_static_gain_has_no_pole(delay, hold):
    rng = np.random.default_rng(1)
    u = held(rng, 1000, hold)
    y = 3.0 * np.concatenate([np.zeros(delay), u[: 1000 - delay]]) + 0.2 * rng.standard_normal(1000)
    found = explore_records([column(u, y)])
    assert (found.taken[0].orders.order, found.taken[0].orders.delays) == (0, (delay,))
    assert found.model.theta == pytest.approx([3.0], abs=4.0 * 0.2 / np.sqrt(1000))


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("only", "names"),
    [
        ("arx", ("a", "b")),
        ("integrator", ("K", "L")),
        ("sopdt", ("K", "T", "zeta", "L")),
        ("oe", ("b", "f")),
        ("bj", ("b", "c", "d", "f")),
        ("armax", ("a", "b", "c")),
    ],
)
def test_a_structure_that_is_asked_for_is_used(only, names):
    found = explore_records([first_order(3, 300)], step=STEP, only=only)
    letters = {name if names[0] == "K" else name.rstrip("0123456789") for name in found.model.names}
    assert set(names) <= letters <= {*names, "c1", "d1", "c2", "d2"}


def test_an_integrator_is_chosen_where_the_record_shows_no_time_constant():
    rng = np.random.default_rng(1)
    u = held(rng, 400, 8)
    y = np.cumsum(np.concatenate([[0.0], 0.02 * u[:-1]])) + 0.05 * rng.standard_normal(400)
    found = explore_records([column(u, y)])
    assert found.integrates == (0,)
    assert found.estimate.theta[0] == pytest.approx(0.02, rel=0.03)


def lagging_tank(rng, samples):
    """u, y (samples, 1): a tank of slope 0.02/s behind a lag of 20 s and a dead time of 8 s, by Euler."""
    u = held(rng, samples, 8)
    valve = scipy.signal.lfilter([0.0, 0.005], [1.0, -0.995], np.repeat(u, 50))
    level = np.cumsum(np.concatenate([np.zeros(80), 0.1 * 0.02 * valve]))[: 50 * samples : 50]
    return column(u, level + 0.05 * rng.standard_normal(samples))


@pytest.mark.parametrize("only", [None, "integrator"])
def test_an_integrator_behind_a_lag_is_found(only):
    found = explore_records([lagging_tank(np.random.default_rng(2), 600)], step=5.0, only=only)
    assert found.taken[0].orders.family == "integrator with a lag"
    assert found.integrates == (0,)
    # The steps of 0.1 s make time constant and dead time uncertain by about one of them.
    assert found.model.theta[:3] == pytest.approx([0.02, 20.0, 8.0], rel=0.03, abs=0.3)


@pytest.mark.slow
def test_a_lag_with_a_drift_is_found_in_two_records_with_a_gap():
    """Gain 1.7, pole 0.98, dead time of six samples, one line, noise that fades in twelve samples."""
    found = explore_records(drifting(2, 1e-3))
    K, T, L = found.estimate.theta[:3]
    assert found.taken[0].orders.family == "FOPDT"
    assert pytest.approx(1.7, rel=0.02) == K
    assert pytest.approx(-1.0 / np.log(0.98), rel=0.05) == T
    assert pytest.approx(6.0, abs=1.0) == L
    assert found.slopes == pytest.approx([1e-3], rel=0.15)


def test_steady_and_certain_candidates_rank_first_and_then_the_criterion(found):
    one = found.outputs[0].best
    plain = replace(one, validation=89.5, criterion=-1.0)
    rich = replace(one, validation=90.0, criterion=-0.9)
    edge = replace(one, validation=90.0, criterion=-2.0, steady=False)
    vague = replace(one, validation=90.0, criterion=-2.0, certain=False)
    weak = replace(one, validation=70.0, criterion=-3.0)
    every, good = ranked([weak, edge, vague, rich, plain])
    assert every == (plain, rich, vague, edge, weak)
    assert good == every[:4]
    # In a loop prediction errors alone rank steady and certain candidates.
    looped = ranked([weak, plain, rich], by_prediction=True)
    assert [c.criterion for c in looped[0]] == [-3.0, -1.0, -0.9]


def looped(rng, samples, noise):
    """Return u (n, 1), y (n, 1) of 0.3 q^-1 / (1 - 0.8 q^-1) under u = r - y, which has no delay."""
    e, r = 0.2 * rng.standard_normal(samples), held(rng, samples, 5)
    v = scipy.signal.lfilter([1.0], [1.0, -0.8], e) if noise == "arx" else e
    u, y, x = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    for k in range(samples):
        x[k] = 0.8 * x[k - 1] + 0.3 * u[k - 1] if k else 0.0
        y[k] = x[k] + v[k]
        u[k] = r[k] - y[k]
    return column(u, y)


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["arx", "oe"])
def test_a_controller_without_delay_is_not_taken_for_the_plant(noise):
    found = explore_records([looped(np.random.default_rng(1), 1000, noise)], feedback=True)
    assert found.taken[0].orders.delays == (1,)
    w = np.array([1e-4, 0.2])
    expected = 0.3 * np.exp(-1j * w) / (1.0 - 0.8 * np.exp(-1j * w))
    np.testing.assert_allclose(found.model.plant_at(w)[:, 0, 0], expected, rtol=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "law", "of"),
    [
        (2, pid(0.4, 0.012), {"pole": 0.95, "delay": 31, "held": 200, "samples": 1600}),
        (3, pid(0.3, 0.006), {"pole": 0.975, "delay": 51, "held": 300, "samples": 3000}),
    ],
)
def test_a_long_dead_time_is_found_in_a_loop_whose_reference_seldom_moves(seed, law, of):
    """Output errors of a loop have minima tens of samples, and of deviations, away."""
    found = explore_records([loop(seed, law, steps=1.0, **of)], feedback=True)
    estimate, truth = found.estimate, [1.0, -1.0 / np.log(of["pole"]), of["delay"] - 1]
    assert found.taken[0].orders.family == "FOPDT"
    assert not estimate.tests.failed
    assert np.all(np.abs(estimate.theta[:3] - truth) < 3.0 * np.sqrt(np.diag(estimate.covariance))[:3])


@pytest.mark.slow
def test_one_model_of_two_inputs_and_two_outputs_is_found():
    rng = np.random.default_rng(8)
    u = np.stack([held(rng, 600, 8), held(rng, 600, 13)], axis=1)
    G = [[([0, 0.2], 0.8), ([0, 0, -0.1], 0.9)], [([0, 0, 0, 0.3], 0.7), ([0, 0.1], 0.85)]]
    rows = [sum(scipy.signal.lfilter(b, [1, -p], u[:, j]) for j, (b, p) in enumerate(row)) for row in G]
    y = np.stack([with_noise(rng, x, 100.0) for x in rows], axis=1)
    found = explore_records([(u, y)])
    w = np.array([0.01, 0.2])
    q = np.exp(-1j * w)
    for i, row in enumerate(G):
        for j, (b, p) in enumerate(row):
            truth = sum(c * q**k for k, c in enumerate(b)) / (1.0 - p * q)
            np.testing.assert_allclose(found.model.plant_at(w)[:, i, j], truth, atol=0.06)


def test_a_constant_input_has_no_effect_in_the_model():
    u, y = first_order(11, 300)
    found = explore_records([(np.column_stack([np.full(300, 3.0), u]), y)], step=STEP)
    assert (found.still, found.moving) == ((0,), [1])
    assert not np.any(found.model.B[0][0])
    assert found.estimate.names == found.model.names
    assert code_of(explore_records, [(np.full((300, 1), 3.0), y)]) == "constant-input"


def test_too_short_a_record_is_refused():
    rng = np.random.default_rng(12)
    assert (
        code_of(explore_records, [(rng.standard_normal((20, 1)), rng.standard_normal((20, 1)))])
        == "too-few-samples"
    )


@pytest.mark.first(1)
@pytest.mark.parametrize(("at", "flicker"), [(20, 0.0), (110, 0.02)])
def test_the_whole_record_of_a_single_step_estimates_and_validates(at, flicker):
    """A lag of ten samples, gain one; a part without the step shows nothing, also where u flickers."""
    rng = np.random.default_rng(1)
    u = (np.arange(200) >= at)[:, None].astype(float)
    y = scipy.signal.lfilter([0, 0.1], [1, -0.9], u, axis=0) + 0.02 * rng.standard_normal((200, 1))
    found = explore_records([(u + flicker * rng.choice([-1.0, 1.0], u.shape), y)])
    assert found.split == "none"
    gain, corner = np.abs(found.model.plant_at(np.array([1e-4, 0.1]))[:, 0, 0])
    assert gain == pytest.approx(1.0, abs=0.03)
    assert corner == pytest.approx(abs(0.1 / (1 - 0.9 * np.exp(-0.1j))), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_dead_time_of_a_quarter_of_the_record_is_found(seed):
    rng = np.random.default_rng(seed)
    late = int(rng.integers(60, 100))
    u = held(rng, 400, 15)
    x = scipy.signal.lfilter([0.0] * late + [0.2], [1.0, -0.8], u)
    found = explore_records([column(u, with_noise(rng, x))])
    assert abs(found.taken[0].orders.delays[0] - late) <= 1


def test_an_interrupted_search_gives_the_candidates_tried_so_far(monkeypatch):
    from inputdesign_cli.explore import search

    tried = []

    def candidate(self, orders, own=search._Records.candidate):
        if len(tried) == 2:
            raise KeyboardInterrupt
        tried.append(own(self, orders))
        return tried[-1]

    monkeypatch.setattr(search._Records, "candidate", candidate)
    u, y = first_order(3, 300)
    chosen = explore_structure([(u[:180], y[:180])], [(u[180:], y[180:])], step=STEP)
    assert set(map(id, chosen.candidates)) == set(map(id, tried))


def record(u):
    u = np.asarray(u, dtype=float)
    return u.reshape(len(u), -1), np.arange(len(u), dtype=float)[:, None]


def pulse(samples, up, down):
    t = np.arange(samples)
    return ((t >= up) & (t < down)).astype(float)


@pytest.mark.parametrize(("up", "down"), [(50, 110), (20, 200), (100, 260), (130, 170), (30, 120)])
def test_a_single_pulse_is_divided_into_one_step_for_each_part(up, down):
    first, second, split = divided([record(pulse(300, up, down))])
    assert split.endswith("and the rest")
    assert len(first) == len(second) == 1
    cut = len(first[0][0])
    assert cut + len(second[0][0]) == 300
    # Each part has one of the steps, and no fewer than ten samples after it.
    assert up + 10 <= cut < down
    np.testing.assert_array_equal(np.concatenate([first[0][1], second[0][1]])[:, 0], np.arange(300))


def test_other_records_are_divided_at_60_percent_or_in_blocks_or_not():
    """The inputs move throughout, one after the other, or in a single step."""
    moves = np.tile([1.0, -1.0], 75)
    first, _, split = divided([record(np.random.default_rng(1).choice([-1.0, 1.0], 200))])
    assert (len(first[0][0]), split) == (120, "the first 60 % and the rest")
    both = np.column_stack([np.r_[moves, np.zeros(150)], np.r_[np.zeros(150), moves]])
    assert divided([record(both)])[2] == "blocks in turn"
    assert divided([record(pulse(300, 100, 300))])[2] == "none"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_single_pulse_determines_gain_and_time_constant(seed):
    """A lag of 45 samples with a dead time of six; a division in blocks gave two additional poles."""
    rng, pole = np.random.default_rng(seed), np.exp(-1.0 / 45.0)
    u = 30.0 + 10.0 * pulse(300, 50, 110)
    y = scipy.signal.lfilter(np.append(np.zeros(7), 0.8 * (1.0 - pole)), [1.0, -pole], u - 30.0)
    y += 0.05 * scipy.signal.lfilter([1.0], [1.0, -0.5], rng.standard_normal(300))
    found = explore_records([(u[:, None], y[:, None])])
    w = np.array([1e-3, 0.01, 0.03])
    truth = 0.8 * (1.0 - pole) * np.exp(-7j * w) / (1.0 - pole * np.exp(-1j * w))
    assert np.abs(found.model.plant_at(w)[:, 0, 0] / truth - 1.0).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("share", [3.0, 1.0, 0.3])
def test_a_tank_that_leaks_has_a_time_constant_and_no_drift(share):
    """Its time constant is `share` of the record. Gain over time constant is known far better than each."""
    rng, samples = np.random.default_rng(4), 1200
    T = share * samples * STEP
    u = held(rng, samples, 130, (-3.0, -1.0, 2.0, 4.0))[:, None]
    x, _ = SampledModel(lag_of([0.05 * T], [T, 1.0], 1.7), STEP).simulate(u, np.zeros(u.shape), 1.0)
    found = explore_records([(u, 60.0 + with_noise(rng, x, 4e3, 0.9))], step=STEP)
    assert not np.any(found.slopes)
    named = dict(zip(found.model.names, found.estimate.theta, strict=True))
    at = found.model.names.index("T")
    assert abs(named["T"] - T) < 4.0 * np.sqrt(found.estimate.covariance[at, at]) < 0.5 * T
    assert named["K"] / named["T"] == pytest.approx(0.05, rel=0.05)
