"""Controllers in s as a computer runs them: against scipy, and against plain recursions."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.plant import Rational, TransferMatrix, delayed, discretised, pid

H = 0.2
W = np.linspace(0.01, np.pi, 30)
SCIPY = {"tustin": "bilinear", "backward": "backward_diff", "zoh": "zoh"}


@pytest.mark.parametrize("rule", SCIPY)
@pytest.mark.parametrize("numerator", [[2.0, 3.0], [0.5], [1.0, 0.4, 2.0]])
def test_a_transfer_function_is_that_of_scipy(rule, numerator):
    factors = [[2.0, 1.0], [1.0, 0.7]]
    found = discretised(numerator, factors, H, rule)
    top, bottom, _ = scipy.signal.cont2discrete((numerator, np.polymul(*factors)), H, SCIPY[rule])
    _, expected = scipy.signal.freqz(np.pad(top[0], (bottom.size - top.size, 0)), bottom, W)
    np.testing.assert_allclose(found.at(W), expected, rtol=1e-10, atol=1e-12)
    assert all(factor[0] == 1.0 for factor in found.denominator)


@pytest.mark.parametrize("rule", SCIPY)
def test_a_pid_is_the_sum_of_its_parts(rule):
    """Each part by scipy; the integrator is exact."""
    Kp, Ti, Td, Tf = 2.0, 3.0, 0.5, 0.1
    found = pid(Kp, Ti, Td, Tf, H, rule)
    expected = Kp * np.ones(W.size, dtype=complex)
    for part in (([Kp / Ti], [1, 0]), ([Kp * Td, 0], [Tf, 1])):
        top, bottom, _ = scipy.signal.cont2discrete(part, H, SCIPY[rule])
        expected += scipy.signal.freqz(np.pad(top[0], (bottom.size - top.size, 0)), bottom, W)[1]
    np.testing.assert_allclose(found.at(W), expected, rtol=1e-10)
    assert found.denominator[0].tolist() == [1.0, -1.0]


def test_backward_differences_need_no_filter():
    found = pid(2.0, None, 0.5, 0.0, H, "backward")
    np.testing.assert_allclose(found.numerator, [2.0 + 2.0 * 0.5 / H, -2.0 * 0.5 / H])
    assert found.denominator == ()
    late = delayed(found, 2)
    np.testing.assert_allclose(late.at(W), found.at(W) * np.exp(-2j * W), rtol=1e-12)


def test_a_row_keeps_a_factor_that_entries_share_once():
    """Two PI controllers that drive one input have one integrator, and a third factor stays of its own."""
    rows = [
        [pid(2.0, 3.0, 0.0, 0.0, H, "zoh"), pid(1.0, 4.0, 0.5, 0.1, H, "zoh")],
        [Rational(np.zeros(1))] * 2,
    ]
    made = TransferMatrix.of(rows)
    for i in range(2):
        for j in range(2):
            np.testing.assert_allclose(made.at(W)[:, i, j], rows[i][j].at(W), rtol=1e-9, atol=1e-12)
    assert np.sum(np.abs(made.poles - 1.0) < 1e-9) == 1
