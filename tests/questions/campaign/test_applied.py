"""Records against their plan: those with the usual faults of loggers match it, unrelated ones do not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli.questions.campaign.acceptance import matched, standing_in

PLANS = {"white": ([1.0], [1.0]), "slow": ([1.0], [1.0, -0.8]), "resonant": ([1.0], [1.0, -1.6, 0.94])}
LENGTHS = (30, 120)


def planned(kind, samples, seed):
    """(n,): white noise through a filter of PLANS, with a standard deviation of one."""
    b, a = PLANS[kind]
    x = lfilter(b, a, np.random.default_rng(seed).standard_normal(samples + 50))[50:]
    return x / np.std(x)


def compared(plan, record, rows=None):
    plan, record = plan.reshape(len(plan), -1), record.reshape(len(record), -1)
    rows = np.arange(len(record)) if rows is None else rows
    return matched(plan, record, rows, float(np.sqrt(np.mean(np.sum(plan**2, axis=1)))))


RECORDED = {
    "as planned": lambda p: p,
    "clipped": lambda p: np.clip(p, -1.0, 1.0),
    "with an offset": lambda p: p + 0.5,
    "about another level": lambda p: p + 40.0,
    "rounded": np.round,
    "with noise of the sensor": lambda p: p + 0.1 * np.random.default_rng(9).standard_normal(len(p)),
    "begun late": lambda p: p[5:],
    "begun early": lambda p: np.concatenate([np.zeros(2), p[:-2]]),
    "held one sample longer": lambda p: np.concatenate([[0.0], p[:-1]]),
    "a sample lost": lambda p: np.delete(p, len(p) // 2),
    "a sample written twice": lambda p: np.insert(p, len(p) // 3, p[len(p) // 3])[: len(p)],
    "several faults": lambda p: np.round(4 * np.clip(np.delete(p, len(p) // 4), -1.2, 1.2)) / 4 + 0.3,
}


@pytest.mark.first(24)
@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("samples", LENGTHS)
@pytest.mark.parametrize("kind", PLANS)
def test_records_with_the_usual_faults_of_loggers_match_their_plan(kind, samples, name):
    found = [compared(p, RECORDED[name](p)) for p in (planned(kind, samples, seed) for seed in range(20))]
    assert sum(not match.follows for match in found) <= 1
    assert sum(match.off for match in found) <= 2


@pytest.mark.parametrize(
    ("kind", "samples", "least"), [("white", 30, 19), ("slow", 120, 19), ("resonant", 400, 19)]
)
def test_unrelated_records_do_not_match_the_plan(kind, samples, least):
    for other in (kind, "white"):
        found = [
            compared(planned(kind, samples, seed), planned(other, samples, 100 + seed)) for seed in range(20)
        ]
        assert sum(not match.follows for match in found) >= least


@pytest.mark.parametrize(("kind", "most"), [("slow", 6), ("resonant", 8)])
@pytest.mark.parametrize("samples", [30, 50])
def test_few_unrelated_records_match_a_slow_plan_despite_chance_correlation(kind, samples, most):
    """Up to 23 of 40 correlate by 0.5 or more, shifted by a few samples; Cochrane-Orcutt rejects most."""
    found = [
        compared(planned(kind, samples, seed), planned(kind, samples, 1000 + seed)).follows
        for seed in range(40)
    ]
    assert sum(found) <= most


@pytest.mark.parametrize("scale", [0.1, 0.9, 1.1, -1.0, 25.4])
@pytest.mark.parametrize("kind", PLANS)
def test_a_record_at_another_scale_is_flagged_with_its_scale(kind, scale):
    plan = planned(kind, 60, 3)
    match = compared(plan, scale * np.round(50 * plan) / 50 + 0.2)
    assert match.off
    assert match.scale == pytest.approx(scale, rel=1e-2)


def test_every_channel_is_compared_with_its_own_plan():
    plan = np.column_stack([planned("white", 60, 1), 0.1 * planned("white", 60, 2)])
    assert compared(plan, plan).follows
    # The weaker channel alone is wrong: all samples together hardly show it.
    scaled, noise, swapped = plan * [1.0, 3.0], plan.copy(), plan[:, ::-1]
    noise[:, 1] = 0.1 * planned("white", 60, 7)
    match = compared(plan, scaled)
    assert (match.off, match.scale) == (True, pytest.approx(3.0))
    match = compared(plan, noise)
    assert (match.follows, match.channel) == (False, 2)
    assert stand_in(plan, swapped) == (1, "u2")
    # The same holds for strongly correlated channels.
    alike = np.column_stack([plan[:, 0], plan[:, 0] + 0.6 * planned("white", 60, 2)])
    assert stand_in(alike, alike[:, ::-1]) == (1, "u2")
    for other in (alike, alike + 0.05, noise):
        assert stand_in(other, other) is None
    # The second channel resembles the plan of the first, but its own still more.
    alike[:, 1] = plan[:, 0] + 0.3 * planned("white", 60, 2)
    assert stand_in(alike, alike + np.column_stack([planned("white", 60, 9), np.zeros(60)])) is None


def stand_in(plan, applied):
    found = standing_in(plan, applied, {f"u{j + 1}": column for j, column in enumerate(applied.T)})
    return None if found is None else found[:2]


def test_small_sensor_noise_follows_a_plan_at_rest_and_large_noise_does_not():
    rest, rng = np.zeros((40, 1)), np.random.default_rng(1)
    rows = np.arange(40)
    assert matched(rest, 0.05 * rng.standard_normal((40, 1)), rows, 1.0).follows
    assert not matched(rest, rng.standard_normal((40, 1)), rows, 1.0).follows


def test_rows_without_values_are_left_out_of_the_comparison():
    plan = planned("white", 80, 4)
    rows = np.delete(np.arange(80), [10, 11, 50])
    match = compared(plan, plan[rows], rows)
    assert match.likeness == pytest.approx(1.0)
    assert (match.begins, match.off) == (0, False)
    late = rows[20:]
    match = compared(plan, plan[late], late - late[0])
    assert match.begins == late[0]


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("kind", PLANS)
def test_columns_of_a_static_plant_are_not_taken_for_swapped(kind, name):
    """The output follows the plan too, but hardly better than the input does."""
    swapped = 0
    for seed in range(20):
        plan = planned(kind, 120, seed)
        u = RECORDED[name](plan)
        y = u + 0.05 * np.random.default_rng(50 + seed).standard_normal(len(u))
        plan = plan[: len(u)]
        assert standing_in(plan[:, None], u[:, None], {"u1": u, "y1": y}) is None
        found = standing_in(plan[:, None], 3.0 * lfilter([0.0, 1.0], [1.0, -0.5], u)[:, None], {"y1": u})
        swapped += found is not None and found[:2] == (1, "y1")
    assert swapped >= 19 or name not in ("as planned", "rounded", "with an offset")
