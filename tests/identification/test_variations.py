"""Gains that are not always the same: regressions on the altered input, and plants that do change."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import Moves, identify, that_matter
from inputdesign_cli.levels import level
from tests.support.identification_systems import SYSTEMS, data, one_channel
from tests.support.records import shifted


def varying(found):
    return {one.test.name: one for one in found.tests.directed if one.test.fault in ("change", "nonlinear")}


def through(u, *, samples=800, noise=0.05, seed=2):
    """A first-order plant of gain one on which `u` acts, and its record about a level."""
    rng = np.random.default_rng(seed)
    y = scipy.signal.lfilter([0, 0.2], [1, -0.8], u)
    return 7.0 + y + scipy.signal.lfilter([1], [1, -0.7], noise * rng.standard_normal(samples))


def estimated(u, y):
    return identify(one_channel([0, 0.2], F=[1, -0.8], D=[1, -0.7]), u[:, None], y[:, None])


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("u rising", lambda u: (np.arange(u.size) / u.size - 0.5) * u),
        ("u after half", lambda u: np.where(np.arange(u.size) >= u.size / 2, u, 0.0)),
        ("u^2", np.square),
        ("u^3", lambda u: u**3),
        ("sign of u", np.sign),
        ("last move of u", lambda u: np.sign(np.diff(u, prepend=u[1]))),
    ],
)
def test_of_arx_it_is_the_score_test_of_a_regression(name, signal):
    """A y = B (u + x f) + e: to first order x b_k f(t - k) joins, with x alone unknown."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal(400)
    u = (u - u.mean()) / u.std()
    e = rng.standard_normal(400)
    y = scipy.signal.lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u) + scipy.signal.lfilter([1], [1, -1.5, 0.7], e)
    found = identify(SYSTEMS["arx"], u[:, None], y[:, None], rest=True)
    f = signal(u)
    if "after" not in name and name != "u rising":
        f = f - np.polyval(np.polyfit(u, f, 1), u)
    own = np.stack([shifted(-y, 1), shifted(-y, 2), shifted(u, 1), shifted(u, 2)], axis=1)
    b1, b2 = found.theta[2:]
    column = b1 * shifted(f, 1) + b2 * shifted(f, 2)
    left = column - own @ np.linalg.lstsq(own, column, rcond=None)[0]
    score = left @ found.errors[:, 0] / (np.linalg.norm(left) * np.sqrt(np.mean(found.errors**2)))
    test = varying(found)[name].test
    assert test.statistic == pytest.approx(score**2, rel=1e-6)
    assert test.probability == pytest.approx(scipy.stats.chi2.sf(score**2, 1), rel=1e-6)
    assert varying(found)[name].size == pytest.approx(left @ found.errors[:, 0] / (left @ left), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "gain"),
    [("u after half", np.repeat([1.0, 1.3], 400)), ("u rising", np.linspace(0.85, 1.15, 800))],
    ids=["jumps", "rises"],
)
def test_a_gain_that_changes_is_found_with_both_values(name, gain):
    u = np.random.default_rng(1).standard_normal(800)
    found = estimated(u, through(gain * u))
    one = varying(found)[name]
    assert one.test in found.tests.failed
    model = one_channel([0, 0.2], F=[1, -0.8], D=[1, -0.7]).at(found.theta)
    w = np.array([0.01, 0.1])
    ends = (model.plant_at(w) + one.moves(model, w))[..., 0, 0]
    true = scipy.signal.freqz([0, 0.2], [1, -0.8], w)[1]
    for end, expected in zip(ends, gain[[0, -1]], strict=True):
        assert np.abs(end / true) == pytest.approx([expected] * 2, abs=0.04)


def backlash(u, width):
    at, out = 0.0, np.empty_like(u)
    for t, now in enumerate(u):
        out[t] = at = min(max(at, now - width), now + width)
    return out


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("names", "distort"),
    [
        ({"u^3", "sign of u"}, lambda u: np.clip(u, -1.0, 1.0)),
        ({"u^3", "sign of u"}, lambda u: u - np.clip(u, -0.3, 0.3)),
        ({"u^2"}, lambda u: np.where(u > 0.0, 1.0, 0.7) * u),
        ({"last move of u"}, lambda u: backlash(u, 0.2)),
    ],
    ids=["saturation", "dead zone", "two gains", "backlash"],
)
def test_actuators_that_are_not_linear_are_found(names, distort):
    u = scipy.signal.lfilter([0.6], [1, -0.8], np.random.default_rng(1).standard_normal(800))
    found = estimated(u, through(distort(u)))
    failing = {one.test.name for one in varying(found).values() if one.test in found.tests.failed}
    assert names <= failing


def test_an_input_of_two_values_has_no_powers():
    """Joined records have levels of their own, which make four values of two."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 4)
    y = through(u)
    y[400:] += 3.0
    model = one_channel([0, 0.2], F=[1, -0.8], D=[1, -0.7])
    u[400:] += 0.5
    found = identify(model, u[:, None], y[:, None], lengths=(400, 400))
    changes = {name for name in varying(found) if "after" in name} | {"u rising"}
    assert varying(found).keys() - changes == {"direction of y"}
    assert not found.tests.failed


def one_way(u, x, *, delay=1, pole=0.8):
    """A lag of gain one whose output approaches what u asks for more slowly where it rises, by a share x."""
    y, speeds = np.zeros(u.size), (1.0 - pole) * np.array([1.0 + x, 1.0, 1.0 - x])
    for k in range(delay, u.size):
        missing = u[k - delay] - y[k - 1]
        y[k] = y[k - 1] + speeds[1 + int(np.sign(missing))] * missing
    return y


def test_of_a_plant_slower_one_way_it_is_the_finite_difference():
    """Up to what a level and another gain explain: these are taken off."""
    u = np.repeat(np.random.default_rng(6).choice([-1.0, 0.3, 1.0], 80), 5)
    y = one_way(u, 0.0) + 1e-3 * np.random.default_rng(7).standard_normal(u.size)
    found = identify(one_channel([0, 0.2], F=[1, -0.8]), u[:, None], y[:, None], rest=True)
    (way,) = varying(found)["direction of y"].alternatives
    column = way.column[:, 0]
    difference = (one_way(u, 1e-4) - one_way(u, -1e-4)) / 2e-4
    through_plant = [scipy.signal.lfilter([0, 0.2], [1, -0.8], x) for x in (np.ones(u.size), u)]
    known = np.column_stack([difference, *through_plant])
    left = column - known @ np.linalg.lstsq(known, column, rcond=None)[0]
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(column)


@pytest.mark.first(1)
@pytest.mark.parametrize("delay", [1, 12])
@pytest.mark.parametrize("levels", [[-1.0, 1.0], [-1.0, -0.4, 0.2, 1.0]], ids=["two", "four"])
def test_a_plant_that_is_slower_one_way_is_found(levels, delay):
    rng = np.random.default_rng(9)
    u = np.repeat(rng.choice(levels, 60), 10)
    B = np.append(np.zeros(delay), 0.2)
    model, noise = one_channel(B, F=[1, -0.8]), 0.03 * rng.standard_normal(u.size)
    slower = identify(model, u[:, None], (one_way(u, 0.3, delay=delay) + noise)[:, None])
    assert varying(slower)["direction of y"].test.probability < 1e-6
    alike = identify(model, u[:, None], (one_way(u, 0.0, delay=delay) + noise)[:, None])
    assert not alike.tests.failed


def test_how_such_a_plant_moves_g_is_told_of_both_ways():
    """In each way G is a lag with its own pole: the derivative of it, a line in G apart."""
    u = np.repeat(np.random.default_rng(6).choice([-1.0, 0.3, 1.0], 80), 5)
    y = one_way(u, 0.0) + 1e-3 * np.random.default_rng(7).standard_normal(u.size)
    model = one_channel([0, 0.2], F=[1, -0.8])
    found = identify(model, u[:, None], y[:, None], rest=True)
    (way,) = varying(found)["direction of y"].alternatives
    w = np.linspace(0.01, 3.0, 40)
    falls, rises = way.slopes(model, w)[:, :, 0, 0]
    z, step = np.exp(-1j * w), 1e-6
    lag = [a * z / (1.0 - (1.0 - a) * z) for a in (0.2 - step, 0.2 + step)]
    expected = (lag[1] - lag[0]) / (2 * step)
    # A line in u, of the same slope both ways, was taken off.
    assert np.std((rises - falls) / expected) < 1e-6 * np.abs(np.mean((rises - falls) / expected))
    assert np.std((rises + falls) / lag[0]) < 1e-4 * max(np.abs(np.mean((rises + falls) / lag[0])), 1e-12)


def test_what_matters_shares_a_level_among_its_like():
    u = np.random.default_rng(5).standard_normal(800)
    found = estimated(u, through(np.clip(u, -1.0, 1.0)))
    tried = list(found.tests.directed)
    far, near = ([Moves(*np.full((3, 1), size))] * len(tried) for size in (2.0, 0.9))
    changes = [i for i in that_matter(tried, far) if tried[i].test.fault in ("change", "nonlinear")]
    among = sum(one.test.fault in ("change", "nonlinear") for one in tried)
    assert [tried[i].test.probability * among < 0.005 for i in changes] == [True] * len(changes)
    assert changes
    assert not set(that_matter(tried, near)) & set(changes)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "runs"), [("arx", 600), ("bj", 150)])
def test_right_models_fail_no_more_often_than_the_level_allows(name, runs):
    """All single parameters share a level, and all tests together the sum of the levels."""
    rng = np.random.default_rng(11)
    model = SYSTEMS[name]
    u, y = data(name, 300, rng, runs=runs)
    found = [identify(model, u[i], y[i], start=model.theta, rest=True) for i in range(runs)]
    directed = sum(any(one.test in f.tests.failed for one in f.tests.directed) for f in found)
    every = sum(bool(f.tests.failed) for f in found)
    assert scipy.stats.binomtest(directed, runs, level("one parameter"), "greater").pvalue > 1e-2
    assert (
        scipy.stats.binomtest(
            every, runs, sum(map(level, ("one parameter", "many signals", "level shift"))), "greater"
        ).pvalue
        > 1e-2
    )
    rising = [varying(f)["u rising"].test.probability for f in found]
    assert scipy.stats.kstest(rising, "uniform").pvalue > 1e-3
