"""Bounds on the share of plants, not drawn, at which a design for drawn scenarios fails.

A convex program in d unknowns with N constraints drawn independently has at most d support constraints, whose
removal changes the optimum. Its solution violates a fresh constraint with a probability that itself depends
on the draws. All statements here are about the distribution that was drawn from, and none about the true
plant.
"""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.arrays import Array


def unlikely(risk: float, scenarios: int, unknowns: int) -> float:
    """Bound the probability that the solution violates more than `risk`.

    sum_{i < d} C(N, i) risk^i (1 - risk)^(N - i), [campi-garatti-2008], Theorem 1.
    """
    if scenarios < unknowns:
        return 1.0
    return float(scipy.special.bdtr(unknowns - 1, scenarios, risk))


def samples_for(risk: float, beta: float, unknowns: int) -> int:
    """Return the fewest scenarios whose violation stays below `risk` with probability 1 - beta."""
    few, many = 0, unknowns
    while unlikely(risk, many, unknowns) > beta:
        few, many = many, 2 * many
    while many - few > 1:
        middle = (few + many) // 2
        few, many = (middle, many) if unlikely(risk, middle, unknowns) > beta else (few, middle)
    return many


def risk_before(scenarios: int, beta: float, unknowns: int) -> float:
    """Return the violation that holds with probability 1 - beta before the design; one for too few draws."""
    if scenarios <= unknowns:
        return 1.0
    return float(scipy.special.bdtri(unknowns - 1, scenarios, beta))


def risk_after(scenarios: int, beta: float, support: int) -> float:
    """Return the risk once the number of support constraints is known: wait and judge.

    The risk is 1 - t, t in (0, 1) the root of beta / (N + 1) sum_{m=k}^{N} C(m, k) t^(m - k) = C(N, k) t^(N -
    k) [campi-garatti-2018], Theorem 2. It holds for programs that are not degenerate.
    """
    if support >= scenarios:
        return 1.0
    m = np.arange(support, scenarios + 1, dtype=float)
    weights = _log_binomial(m, support)

    def excess(t: float) -> float:
        """Return the log of the left side over the right side: positive near zero, negative near one."""
        left = scipy.special.logsumexp(weights + (m - support) * np.log(t))
        return float(np.log(beta / (scenarios + 1)) + left - weights[-1] - (scenarios - support) * np.log(t))

    return 1.0 - float(scipy.optimize.brentq(excess, 1e-12, 1.0 - 1e-12, xtol=1e-14))


def _log_binomial(n: Array, k: int) -> Array:
    return np.asarray(
        scipy.special.gammaln(n + 1.0) - scipy.special.gammaln(k + 1.0) - scipy.special.gammaln(n - k + 1.0)
    )
