"""What drawn scenarios say of others: the sums of the papers, and linear programs of known risk."""

from math import comb

import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before, samples_for, unlikely


@pytest.mark.parametrize(("unknowns", "needed"), [(11, 476), (21, 752)])
def test_the_number_of_scenarios_before_the_design(unknowns, needed):
    """By the binomial sum itself: eps = 0.05 with confidence 0.999."""
    assert samples_for(0.05, 1e-3, unknowns) == needed

    def tail(number):
        return sum(comb(number, i) * 0.05**i * 0.95 ** (number - i) for i in range(unknowns))

    assert tail(needed) <= 1e-3 < tail(needed - 1)
    assert unlikely(0.05, needed, unknowns) == pytest.approx(tail(needed), rel=1e-9)
    assert risk_before(needed, 1e-3, unknowns) == pytest.approx(0.05, abs=2e-4)


@pytest.mark.parametrize(("support", "risk"), [(1, 0.0576), (3, 0.0786), (5, 0.0968)])
def test_the_risk_once_the_support_is_known(support, risk):
    """200 scenarios; and the root of the polynomial as the paper has it."""
    found = risk_after(200, 1e-3, support)
    assert found == pytest.approx(risk, abs=5e-5)
    t = 1.0 - found
    left = 1e-3 / 201 * sum(comb(m, support) * t ** (m - support) for m in range(support, 201))
    assert left == pytest.approx(comb(200, support) * t ** (200 - support), rel=1e-6)


def test_nothing_is_said_by_too_few():
    assert risk_before(5, 1e-3, 7) == risk_after(3, 1e-3, 3) == 1.0
    risks = [risk_after(100, 1e-3, k) for k in range(8)]
    assert risks == sorted(risks)


@pytest.mark.slow
def test_random_programs_keep_the_risk():
    """min c x subject to a x >= 1 for a on the unit circle's upper right: the violation is known exactly."""
    rng = np.random.default_rng(1)
    beta, number, broken = 0.05, 60, 0
    for _ in range(300):
        angles = rng.uniform(0.0, 0.5 * np.pi, number)
        rows = np.column_stack([np.cos(angles), np.sin(angles)])
        x = scipy.optimize.linprog([1.0, 1.0], A_ub=-rows, b_ub=-np.ones(number)).x
        support = int(np.sum(np.abs(rows @ x - 1.0) < 1e-9))
        phi = np.linspace(0.0, 0.5 * np.pi, 4001)
        violated = np.mean(np.cos(phi) * x[0] + np.sin(phi) * x[1] < 1.0)
        broken += violated > risk_after(number, beta, support)
    assert broken <= 300 * beta
