"""Ratios of the further requirements against their definitions: r^2 M just meets each of them."""

import numpy as np
import pytest

from inputdesign_cli.accuracy import (
    Criterion,
    EllipsoidError,
    InformationTarget,
    ModelError,
    Relative,
    WeightedVariance,
)
from inputdesign_cli.accuracy.admissible import Absolute
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, Rational

DENSE = np.unique(np.concatenate([np.linspace(0.0, np.pi, 20001), np.geomspace(1e-4, np.pi, 20001)]))

BAND = (0.0, np.pi)


def information(size, seed, scale=1.0):
    root = np.random.default_rng(seed).normal(size=(size, size + 2))
    return scale * root @ root.T


def test_target_is_met_exactly_at_its_ratio():
    M, R = information(3, 1), information(3, 2)
    ratio = InformationTarget(R).ratio(M)
    slack = np.linalg.eigvalsh(ratio**2 * M - R)
    assert abs(slack[0]) < 1e-9 * slack[-1]


@pytest.mark.parametrize(
    ("letter", "value"),
    [
        ("D", lambda M: np.linalg.slogdet(M)[1]),
        ("A", lambda M: -np.trace(np.linalg.inv(M))),
        ("E", lambda M: np.linalg.eigvalsh(M)[0]),
        ("T", np.trace),
    ],
)
def test_criteria_are_the_textbook_ones(letter, value):
    """In scaled coordinates: M stands for G M G^T; and s M reaches level one at s = ratio^2."""
    M, G = information(4, 3), np.random.default_rng(4).normal(size=(4, 4))
    criterion = Criterion(letter, G)
    assert criterion.value(criterion.level(M)) == pytest.approx(value(G @ M @ G.T), rel=1e-9)
    assert criterion.level(criterion.ratio(M) ** 2 * M) == pytest.approx(1.0)


def test_weighted_variance_is_the_definition(flexible):
    """|W|^2 Lambda^* P Lambda over its limit, by complex arithmetic; the worst of a dense grid is found."""
    W = Rational.build([0.3, 0.1], [1, -0.5])
    model = flexible.model
    M = information(6, 5, 1e3)
    for relative in (False, True):
        requirement = WeightedVariance(
            experiment=flexible, band=BAND, entry=(0, 0), weight=W, limit=0.01, relative=relative
        )
        gradient = model.plant_gradient(DENSE)[:, :, 0, 0]
        expected = np.einsum("ni,ij,nj->n", gradient.conj(), np.linalg.inv(M), gradient).real
        expected *= np.abs(W.at(DENSE)) ** 2 / 0.01
        if relative:
            expected /= np.abs(model.plant_at(DENSE)[:, 0, 0]) ** 2
        np.testing.assert_allclose(requirement.ratios(M, DENSE) ** 2, expected, rtol=1e-9)
        worst = max(v.ratio for v in requirement.violations(M))
        assert worst**2 >= expected.max() * (1 - 1e-9)


def models():
    one = PolynomialModel.single([0, 3.6], F=[1, -0.7], C=[1, -0.9])
    two = PolynomialModel.single([0, 1.0, 0.5], A=[1, -1.5, 0.7], variance=0.1)
    return [one, two]


@pytest.mark.parametrize("against", ["relative", "absolute"])
@pytest.mark.parametrize("model", models(), ids=["bj", "arx"])
def test_ellipsoid_bound_holds_on_the_ellipsoid_and_is_attained(model, against):
    """Models sampled on the ellipsoid r^2 M never exceed the bound, and come close to it."""
    experiment = Experiment(model, 500)
    k = experiment.size
    M = information(k, 7, 300.0)
    admissible = Relative(model, 0.3) if against == "relative" else Absolute(0.4)
    requirement = EllipsoidError(
        experiment=experiment, band=BAND, entry=(0, 0), admissible=admissible, alpha=2.0, against=against
    )
    w = np.array([0.0, 0.2, 1.0, 2.5])
    ratio = requirement.ratios(M, w)
    half = np.linalg.inv(np.linalg.cholesky(M))
    directions = np.random.default_rng(8).normal(size=(200000, k))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    index = {name: i for i, name in enumerate(model.names)}
    for at, r in zip(w, ratio, strict=True):
        d = 2.0 / r * directions @ half
        q = np.exp(-1j * at)

        def polynomial(letter, coefficients, d=d, q=q):
            value = np.zeros(len(d), dtype=complex)
            for lag, c in enumerate(coefficients):
                change = d[:, index[f"{letter}{lag}"]] if f"{letter}{lag}" in index else 0.0
                value = value + (c + change) * q**lag
            return value

        G = polynomial("b", model.B[0][0]) / (polynomial("a", model.A[0]) * polynomial("f", model.F[0][0]))
        G0 = model.plant_at(np.array([at])).item()
        error = np.abs(G - G0) / (np.abs(G) * 0.3 if against == "relative" else 0.4)
        assert error.max() <= 1 + 1e-9
        assert error.max() >= 0.97


def test_ellipsoid_bound_is_the_first_order_one_in_the_limit():
    """For a vanishing ellipsoid the linearisation is exact."""
    model = models()[0]
    experiment = Experiment(model, 500)
    M = information(3, 9)
    w = np.linspace(0.0, np.pi, 50)
    exact, linear = (
        kind(
            experiment=experiment, band=BAND, entry=(0, 0), admissible=Relative(model, 1e-5), alpha=2.0
        ).ratios(M, w)
        for kind in (EllipsoidError, ModelError)
    )
    np.testing.assert_allclose(exact, linear, rtol=1e-4)
