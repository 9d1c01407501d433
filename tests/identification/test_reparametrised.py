"""Starts in coefficients come back as parameters, however far from any parameters they are."""

from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli.expressions import Expression
from inputdesign_cli.identification.derived import brought_back
from inputdesign_cli.plant import Parametrisation

# Numerator and denominator of parameters p, q: none has a negative one, whose infimum lies at infinity.
OUT_OF_REACH = [("exp(p)", "exp(q)"), ("p*p", "1/(q*q)"), ("exp(p)/q", "1/q"), ("exp(p + q)", "exp(q)")]


@pytest.mark.first(1)
@pytest.mark.parametrize("terms", OUT_OF_REACH)
def test_a_start_that_no_parameters_reach_is_brought_back_all_the_same(terms):
    at = Parametrisation(
        ("p", "q"), ("p", "q"), np.array([1.0, 1.0]), np.ones(2, dtype=bool), tuple(map(Expression.of, terms))
    )
    rng = np.random.default_rng(4)
    for _ in range(60):
        root = rng.standard_normal((2, 2)) * 10.0 ** rng.uniform(-3, 3, 2)
        theta = -(10.0 ** rng.uniform(-6, 2, 2)) * rng.choice([-1, 1], 2)
        point = SimpleNamespace(theta=theta, cost=1.0, hessian=root.T @ root)
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            assert np.all(np.isfinite(brought_back(at, point)))
