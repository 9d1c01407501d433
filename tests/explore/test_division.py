"""Which part of a record estimates, and which judges."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import explore_records
from inputdesign_cli.explore.division import divided


def record(u):
    u = np.asarray(u, dtype=float)
    return u.reshape(len(u), -1), np.arange(len(u), dtype=float)[:, None]


def pulse(samples, up, down):
    t = np.arange(samples)
    return ((t >= up) & (t < down)).astype(float)


@pytest.mark.parametrize(("up", "down"), [(50, 110), (20, 200), (100, 260), (130, 170), (30, 120)])
def test_the_steps_of_a_single_pulse_are_parted_with_what_comes_after_them(up, down):
    first, second, split = divided([record(pulse(300, up, down))])
    assert split.endswith("and the rest")
    assert len(first) == len(second) == 1
    cut = len(first[0][0])
    assert cut + len(second[0][0]) == 300
    # Each part has one of the steps, and no fewer than ten samples after it.
    assert up + 10 <= cut < down
    np.testing.assert_array_equal(np.concatenate([first[0][1], second[0][1]])[:, 0], np.arange(300))


def test_records_that_move_all_along_keep_the_first_three_fifths():
    u = np.random.default_rng(1).choice([-1.0, 1.0], 200)
    first, _, split = divided([record(u)])
    assert (len(first[0][0]), split) == (120, "the first 60 % and the rest")


def test_inputs_that_move_one_after_the_other_are_judged_in_blocks():
    both = np.column_stack(
        [np.r_[moves := np.tile([1.0, -1.0], 75), np.zeros(150)], np.r_[np.zeros(150), moves]]
    )
    assert divided([record(both)])[2] == "blocks in turn"


def test_a_single_step_judges_what_it_estimates():
    assert divided([record(pulse(300, 100, 300))])[2] == "none"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_bump_up_and_down_tells_gain_and_time_constant(seed):
    """A lag of 45 samples behind six, one pulse: parted in blocks, two poles were invented beside it."""
    rng, pole = np.random.default_rng(seed), np.exp(-1.0 / 45.0)
    u = 30.0 + 10.0 * pulse(300, 50, 110)
    y = scipy.signal.lfilter(np.append(np.zeros(7), 0.8 * (1.0 - pole)), [1.0, -pole], u - 30.0)
    y += 0.05 * scipy.signal.lfilter([1.0], [1.0, -0.5], rng.standard_normal(300))
    found = explore_records([(u[:, None], y[:, None])])
    w = np.array([1e-3, 0.01, 0.03])
    truth = 0.8 * (1.0 - pole) * np.exp(-7j * w) / (1.0 - pole * np.exp(-1j * w))
    assert np.abs(found.model.plant_at(w)[:, 0, 0] / truth - 1.0).max() < 0.05
