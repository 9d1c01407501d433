"""Families of spectra: integrals against quadrature, faces inside the cone, prices attained."""

import numpy as np
import pytest
import scipy.linalg

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, graded_grid
from inputdesign_cli.spectrum import (
    FirBasis,
    FlatBasis,
    Functional,
    LinesBasis,
    PolynomialBasis,
    directed_scale,
    hmat,
    hvec,
    smat,
    svec,
)
from inputdesign_cli.spectrum.directions import best_directions, every_direction
from tests.support.plants import arx, paper_experiment

DISCRETE = Experiment(arx(), 20).whitened(1.0)
PAPER = paper_experiment()
SINGLE = Experiment(PolynomialModel.single([0, 1.0, 0.4], A=[1, -1.2, 0.8], variance=0.5), 20).whitened(1.0)
FAMILIES = {
    "fir of one input": (FirBasis(1, 6), SINGLE),
    "polynomial of one input": (PolynomialBasis(1, 5, (0.2, 2.0), True), SINGLE),
    "fir": (FirBasis(2, 6), DISCRETE),
    "polynomial": (PolynomialBasis(2, 5, (0.0, 2.0)), PAPER),
    "complex polynomial": (PolynomialBasis(2, 5, (0.0, 2.0), True), PAPER),
    "polynomial on a band": (PolynomialBasis(2, 3, (0.5, 1.5), True), DISCRETE),
}


def matrices(values):
    """The values as matrices (n, r, r), for one input too."""
    return values[:, None, None] if values.ndim == 1 else values


def functionals(basis, experiment):
    Y = np.diag(np.arange(1.0, experiment.size + 1))

    def power(w):
        return experiment.power_density("input", w) + 0.1 * experiment.power_density("output", w)

    def value(w):
        return experiment.value_density(Y, w)

    return [Functional(basis.integrals(d, experiment.singularities), d) for d in (power, value)]


def random_gram(basis, rng):
    n = basis.gram_order
    factor = rng.normal(size=(n, n)) + (1j * rng.normal(size=(n, n)) if basis.hermitian else 0)
    return factor @ factor.conj().T


def of_gram(basis, Q):
    values, vectors = np.linalg.eigh(Q)
    return sum(value * basis.products(v[:, None])[:, 0] for value, v in zip(values, vectors.T, strict=True))


@pytest.mark.parametrize("name", FAMILIES)
def test_integrals_agree_with_quadrature_of_the_density(name):
    basis, experiment = FAMILIES[name]
    rng = np.random.default_rng(3)
    x = of_gram(basis, random_gram(basis, rng))
    lo, hi = getattr(basis, "band", (0.0, np.pi))
    nodes, weights = np.polynomial.legendre.leggauss(300)
    w, weights = lo + (hi - lo) * (nodes + 1) / 2, weights * (hi - lo) / (2 * np.pi)
    phi = matrices(basis.density(x, w))
    for functional in functionals(basis, experiment):
        expected = np.einsum("n,nab,nba->", weights, matrices(functional.density(w)), phi).real
        assert functional.at(x) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", FAMILIES)
def test_gram_is_the_functional_on_gram_matrices(name):
    basis, experiment = FAMILIES[name]
    Q = random_gram(basis, np.random.default_rng(4))
    for functional in functionals(basis, experiment):
        G = basis.gram(functional.vector)
        assert np.trace(G @ Q).real == pytest.approx(functional.at(of_gram(basis, Q)), rel=1e-10)
        np.testing.assert_allclose(G, G.conj().T, atol=1e-12 * np.abs(G).max())


@pytest.mark.parametrize("name", FAMILIES)
def test_faces_hold_spectra_and_the_white_one_has_power_one(name):
    basis, experiment = FAMILIES[name]
    price, _ = functionals(basis, experiment)
    face = basis.first_face(price)
    rng = np.random.default_rng(5)
    Y = rng.normal(size=(face.order, 3))
    x = face.columns @ svec(Y @ Y.T)
    lo, hi = getattr(basis, "band", (0.0, np.pi))
    eigenvalues = np.linalg.eigvalsh(matrices(basis.density(x, np.linspace(lo, hi, 200))))
    assert eigenvalues.min() >= -1e-9 * eigenvalues.max()
    power = basis.integrals(lambda w: experiment.power_density("input", w), experiment.singularities)
    assert power @ basis.even == pytest.approx(1.0, rel=1e-10)
    np.testing.assert_allclose(price.vector @ face.columns, svec(np.eye(face.order)), atol=1e-9)
    factor = basis.factor(face, svec(Y @ Y.T))
    np.testing.assert_allclose(of_gram(basis, factor @ factor.conj().T), x, atol=1e-9 * np.abs(x).max())


@pytest.mark.parametrize("name", FAMILIES)
def test_the_price_is_attained_and_never_exceeded(name):
    basis, experiment = FAMILIES[name]
    price, value = functionals(basis, experiment)
    pricing = basis.price(price, value, np.linspace(0.01, 2.0, 300))
    everywhere = np.linspace(*getattr(basis, "band", (0.0, np.pi)), 4001)
    assert pricing.scale >= directed_scale(price, value, everywhere)[0] - 1e-12
    best = basis.products(pricing.directions[:, -1:])[:, 0]
    assert price.at(best) == pytest.approx(pricing.scale * value.at(best), rel=1e-9)
    rng = np.random.default_rng(6)
    for _ in range(20):
        x = of_gram(basis, random_gram(basis, rng))
        assert price.at(x) >= pricing.scale * value.at(x)


@pytest.mark.parametrize("hermitian", [False, True])
def test_enlarged_faces_keep_the_solution(hermitian):
    basis = PolynomialBasis(2, 20, (0.0, 2.0), hermitian)
    price, value = functionals(basis, PAPER)
    face = basis.first_face(price)
    assert face.order < basis.gram_order
    Y = np.random.default_rng(7).normal(size=(face.order, 4))
    x = face.columns @ svec(Y @ Y.T)
    pricing = basis.price(price, value, np.linspace(0.01, 2.0, 300))
    _, larger = basis.enlarge(face, svec(Y @ Y.T), pricing.directions, price)
    residual = np.linalg.lstsq(larger.columns, x, rcond=None)[0]
    np.testing.assert_allclose(larger.columns @ residual, x, atol=1e-8 * np.abs(x).max())


def test_functionals_of_a_lower_order_are_the_first_entries_of_a_higher_one():
    for basis in (FirBasis(2, 6), PolynomialBasis(2, 6, (0.0, 2.0), True)):
        experiment = DISCRETE if isinstance(basis, FirBasis) else PAPER
        lower = basis.of_order(2)
        for whole, part in zip(functionals(basis, experiment), functionals(lower, experiment), strict=True):
            np.testing.assert_allclose(whole.vector[: lower.size], part.vector, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("kind", ["legendre", "chebyshev", "monomial"])
@pytest.mark.parametrize("hermitian", [False, True])
def test_coefficients_in_any_basis_are_the_same_spectrum(kind, hermitian):
    basis = PolynomialBasis(2, 6, (0.3, 2.0), hermitian)
    x = of_gram(basis, random_gram(basis, np.random.default_rng(8)))
    S = basis.coefficients(x, kind)
    w = np.linspace(0.3, 2.0, 9)
    z = 2 * (w - 0.3) / 1.7 - 1
    p = {
        "legendre": lambda: basis.functions(w),
        "chebyshev": lambda: np.polynomial.chebyshev.chebvander(z, 6),
        "monomial": lambda: np.vander(z, 7, increasing=True),
    }[kind]()
    blocks = S.reshape(7, 2, 7, 2)
    np.testing.assert_allclose(
        0.5 * np.einsum("na,aibj,nb->nij", p, blocks, p), basis.density(x, w), rtol=1e-8
    )


@pytest.mark.parametrize(("vector", "matrix", "turn"), [(svec, smat, 0.0), (hvec, hmat, 1.0j)])
def test_vectors_of_matrices_keep_inner_products(vector, matrix, turn):
    rng = np.random.default_rng(9)
    A, B = (rng.normal(size=(5, 5)) + turn * rng.normal(size=(5, 5)) for _ in range(2))
    A, B = A + A.conj().T, B + B.conj().T
    assert vector(A) @ vector(B) == pytest.approx(np.trace(A @ B).real)
    np.testing.assert_allclose(matrix(vector(A)), A)


@pytest.mark.parametrize("experiment", [PAPER, SINGLE], ids=["two inputs", "one input"])
@pytest.mark.parametrize("free", [False, True])
def test_added_atoms_attain_the_best_ratio_of_price_to_value(free, experiment):
    grid, r = graded_grid(experiment.singularities, 0.01, 2.0), experiment.inputs
    basis = LinesBasis.anywhere(0.01, 2.0, r) if free else LinesBasis.at(np.linspace(0.1, 2.0, 12), r)
    price, value = functionals(basis, experiment)
    assert basis.even.sum() == pytest.approx(1.0)
    pricing = basis.price(price, value, grid)
    grown, face = basis.enlarge(basis.first_face(price), np.zeros(0), pricing.directions, price)
    if r > 1:  # for one input the first lines may contain the best one
        assert grown.size > basis.size
    assert face.order == grown.size
    larger = functionals(grown, experiment)
    ratios = larger[0].vector / larger[1].vector
    assert ratios.min() == pytest.approx(pricing.scale, rel=1e-8)
    again, _ = grown.enlarge(face, np.zeros(0), pricing.directions, price)
    assert again is grown
    frequencies, powers = grown.lines(np.ones(grown.size))
    assert np.all(np.diff(frequencies) > 0)
    assert np.trace(powers, axis1=1, axis2=2).real.sum() == pytest.approx(grown.size)


def test_flat_basis_prices_its_one_spectrum():
    basis = FlatBasis(2, PAPER.band)
    price, value = functionals(basis, PAPER)
    w = np.array([0.5, 2.5])
    np.testing.assert_allclose(basis.density(np.ones(1), w)[:, 0, 0], [np.pi / 4, 0.0])
    assert basis.price(price, value, w).scale == pytest.approx(price.at(basis.even) / value.at(basis.even))


def test_integrals_of_lines_are_the_density_at_their_frequencies():
    lines = LinesBasis.at(np.array([0.3, 1.0, 2.0]), 1)
    np.testing.assert_allclose(lines.integrals(lambda w: w**2, np.zeros(0)), [0.09, 1.0, 4.0])


def test_each_frequency_has_its_own_ratio_and_one_without_a_price_is_left_out():
    rng = np.random.default_rng(5)
    half = rng.standard_normal((6, 2, 3, 2)) @ np.array([1.0, 1.0j])
    price, value = (np.einsum("nij,nkj->nik", h, h.conj()) for h in (half, half[::-1]))
    price[0] = 0.0
    ratios, directions = best_directions(price, value)
    assert ratios[0] == -np.inf
    for n in range(6):
        ratio, direction = best_directions(price[[n]], value[[n]])
        assert ratio[0] == ratios[n]
        np.testing.assert_allclose(np.abs(direction[0] @ directions[n].conj()), 1.0)
    expected = [scipy.linalg.eigh(value[n], price[n], eigvals_only=True)[-1] for n in range(1, 6)]
    np.testing.assert_allclose(ratios[1:], expected, rtol=1e-9)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e-15, 1e9])
def test_ratios_do_not_depend_on_the_units_of_the_channels(unit):
    """v^* value v / v^* price v is the same for v and for the same input in another unit."""
    rng = np.random.default_rng(11)
    roots = rng.standard_normal((2, 5, 3, 3)) + 1j * rng.standard_normal((2, 5, 3, 3))
    price, value = roots @ roots.conj().swapaxes(2, 3)
    expected = np.array(
        [scipy.linalg.eigh(v, p, eigvals_only=True) for v, p in zip(value, price, strict=True)]
    )
    scale = np.diag([1.0, unit, 1.0])
    ratios, _ = every_direction(scale @ price @ scale, scale @ value @ scale)
    np.testing.assert_allclose(ratios, expected, rtol=1e-9)


def test_an_expensive_channel_does_not_change_the_ratio_of_a_cheap_one():
    """A share of the total price, added to each channel, once made a bound wrong by 2e6."""
    price, value = np.diag([1e30, 1.0])[None], np.diag([1e30, 2.0])[None]
    ratios, _ = best_directions(price, value)
    np.testing.assert_allclose(ratios, 2.0, rtol=1e-9)


@pytest.mark.parametrize("corner", [1e-4, 1e-2, 1.0])
@pytest.mark.parametrize("next_to_zero", [[], [1e-18], [2e-13], [3e-14, 1e-9]])
def test_the_best_frequency_beside_one_that_costs_nothing_has_a_price(corner, next_to_zero):
    """price w^2, value w^2 / (1 + (w / corner)^2): the best is w -> 0, wherever the grid has its points."""

    def functional(density):
        return Functional(np.zeros(1), density)

    price, value = functional(lambda w: w**2), functional(lambda w: w**2 / (1.0 + (w / corner) ** 2))
    grid = np.concatenate([[0.0], next_to_zero, np.geomspace(3e-6, np.pi, 400)])
    scale, peaks = directed_scale(price, value, grid)
    assert scale == pytest.approx(1.0, rel=1e-9)
    # The peak is as good as zero itself, at the highest price for which that holds.
    assert peaks[0] == pytest.approx(1e-5 * corner, rel=0.3)
