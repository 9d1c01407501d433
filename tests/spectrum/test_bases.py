"""Faces stay in the cone, prices are exact, lines pick up what sinusoids pick up."""

import numpy as np
import pytest

from inputdesign_cli.spectrum import FirBasis, Functional, LinesBasis, directed_scale, smat, svec

W = np.linspace(0, np.pi, 4001)


def functional(basis, density):
    """By a fine trapezoidal rule, which is exact for smooth periodic functions."""
    w = np.linspace(-np.pi, np.pi, 8193)[:-1]
    values = density(np.abs(w))
    functions = np.array([basis.density(x, w) for x in np.eye(basis.size)])
    return Functional(functions @ values / w.size, density)


def test_svec_is_an_isometry():
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 5, 5))
    A, B = A + A.T, B + B.T
    assert svec(A) @ svec(B) == pytest.approx(np.trace(A @ B))
    np.testing.assert_allclose(smat(svec(A)), A)


@pytest.mark.parametrize("order", [0, 1, 5, 30])
def test_every_member_of_a_face_is_a_nonnegative_spectrum(order):
    """v(w)^* Q v(w) >= 0, and the columns are the autocovariances of the pairs of generators."""
    rng = np.random.default_rng(order)
    basis = FirBasis(1, order)
    unit = functional(basis, np.ones_like)
    face = basis.first_face(unit)
    root = rng.normal(size=(face.order, face.order))
    x = face.columns @ svec(root @ root.T)
    v = np.exp(-1j * np.outer(W, np.arange(order + 1))) @ face.generators @ root
    np.testing.assert_allclose(basis.density(x, W), np.sum(np.abs(v) ** 2, axis=1), rtol=1e-9, atol=1e-9)


def test_face_cost_is_the_trace():
    basis = FirBasis(1, 6)
    price = functional(basis, lambda w: 1.5 + np.cos(w))
    face = basis.first_face(price)
    np.testing.assert_allclose(price.vector @ face.columns, svec(np.eye(7)), atol=1e-12)


@pytest.mark.parametrize("order", [2, 7, 25])
def test_price_bounds_every_spectrum_and_is_attained(order):
    """s is the least ratio price / value over |v|^2; no random v beats it, and the direction attains it."""
    rng = np.random.default_rng(order)
    basis = FirBasis(1, order)
    price = functional(basis, lambda w: 1.2 + np.cos(w))
    value = functional(basis, lambda w: np.exp(np.sin(3 * w) ** 2))
    pricing = basis.price(price, value, W)

    def ratio(v):
        c = np.correlate(v, v, mode="full")[order:]
        return (price.vector @ c) / (value.vector @ c)

    assert min(ratio(rng.normal(size=order + 1)) for _ in range(300)) >= pricing.scale
    assert min(ratio(v) for v in pricing.directions.T) == pytest.approx(pricing.scale, rel=1e-9)
    # a richer family can only lower it, down to the pointwise ratio
    assert pricing.scale >= directed_scale(price, value, W)[0] - 1e-12


def test_lines_pick_up_the_density_at_their_frequencies():
    lines = LinesBasis.at(np.array([0.3, 1.0, 2.0]), 1)
    np.testing.assert_allclose(lines.integrals(lambda w: w**2, np.zeros(0)), [0.09, 1.0, 4.0])


def test_free_lines_grow_where_value_exceeds_price():
    basis = LinesBasis.anywhere(0.0, np.pi, 1)
    price = Functional(np.ones(basis.size), np.ones_like)

    def bump(w):
        return 1 / (1 + 100 * (w - 1.2345) ** 2)

    pricing = basis.price(price, Functional(bump(basis.frequencies), bump), W)
    assert pricing.scale == pytest.approx(1.0)
    grown, face = basis.enlarge(basis.first_face(price), np.ones(basis.size), pricing.directions, price)
    assert np.min(np.abs(grown.frequencies - 1.2345)) < 1e-5
    assert face.columns.shape == (grown.size, grown.size)
