"""What the other inputs leave of one."""

import numpy as np
import pytest

from inputdesign_cli.explore import left_of_inputs


@pytest.mark.parametrize("deviation", [0.02, 0.3, 1.0])
def test_an_input_that_follows_another_is_left_its_own_part(deviation):
    """u2(t) = u1(t - 3) + s e(t), both white: s^2 / (1 + s^2) of its power is its own."""
    rng = np.random.default_rng(1)
    one = rng.standard_normal(20_000)
    other = np.roll(one, 3) + deviation * rng.standard_normal(one.size)
    _, left = left_of_inputs([(np.column_stack([one, other]), one[:, None])])
    assert left == pytest.approx(deviation**2 / (1.0 + deviation**2), rel=0.05)


def test_inputs_that_move_by_themselves_are_left_whole():
    u = np.random.default_rng(2).standard_normal((20_000, 3))
    assert left_of_inputs([(u, u)]) == pytest.approx([1.0] * 3, abs=0.01)
    assert left_of_inputs([(u[:, :1], u)]) == [1.0]
    assert left_of_inputs([(u[:5], u[:5])]) == [1.0] * 3
