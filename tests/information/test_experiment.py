"""Information: against the definition, textbook formulas and laws, of one channel and of several."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import (
    Experiment,
    joint_information,
    joint_noise,
    jointly_whitened,
    mean_cost,
)
from inputdesign_cli.information.experiment import WeightedProducts, factor_of, taking_part
from inputdesign_cli.plant import (
    ContinuousModel,
    PolynomialModel,
    close_loop,
    disturbance_gradients,
    excitation_gradients,
    excited,
    input_gradients,
)
from inputdesign_cli.plant.transfer import Rational, TransferMatrix
from inputdesign_cli.spectrum import FirBasis, FlatBasis, LinesBasis
from tests.support.convex_designs import around, moved
from tests.support.plants import arrays, arx, box_jenkins, every_polynomial, paper_experiment, two_by_two
from tests.support.random_plants import random_case

W = np.array([0.1, 0.9, 2.2])


def single() -> Experiment:
    return Experiment(every_polynomial(), 50)


def as_matrices(density, inputs):
    """The densities as matrices (n, .., r, r), for one input too."""
    return density[..., None, None] if inputs == 1 else density


@pytest.mark.parametrize(
    "experiment", [paper_experiment(), Experiment(box_jenkins(), 10).whitened(1.0), single().whitened(2.0)]
)
def test_information_densities_agree_with_their_definition(experiment):
    """(3) of the spectral design paper, for a random Hermitian spectrum at each frequency."""
    rng = np.random.default_rng(0)
    r, k = experiment.inputs, experiment.size
    X = rng.normal(size=(3, r, r)) + 1j * rng.normal(size=(3, r, r))
    phi = X @ X.conj().swapaxes(1, 2)
    H_inverse_dG = input_gradients([experiment.model], W)[0]
    precision = np.linalg.inv(experiment.model.covariance)
    raw = (
        np.einsum(
            "pq,nlqa,nab,nmpb->nlm", precision, H_inverse_dG, phi, H_inverse_dG.conj(), optimize=True
        ).real
        * experiment.samples
    )
    ours = np.einsum("nlmab,nba->nlm", as_matrices(experiment.information_density(W), r), phi)
    np.testing.assert_allclose(ours.imag, 0, atol=1e-9 * np.abs(ours).max())
    for n in range(3):
        np.testing.assert_allclose(
            experiment.to_raw(ours[n].real), raw[n], rtol=1e-9, atol=1e-11 * np.abs(raw).max()
        )
    Y = rng.normal(size=(k, k))
    Y = Y + Y.T
    value = np.einsum("nab,nba->n", as_matrices(experiment.value_density(Y, W), r), phi)
    np.testing.assert_allclose(value, np.einsum("nlm,lm->n", ours, Y), rtol=1e-10)


def test_the_noise_information_of_an_arx_model_follows_from_a_lyapunov_equation():
    """y_i = -a y_i(t-1) + e: E y^2 = s^2 / (1 - a^2); errors are correlated across outputs."""
    model = arx()
    M0 = Experiment(model, 1).baseline_information
    covariance, precision = model.covariance, np.linalg.inv(model.covariance)
    for i, a in enumerate((-0.7, 0.4)):
        for j, b in enumerate((-0.7, 0.4)):
            expected = precision[i, j] * covariance[i, j] / (1 - a * b)
            assert M0[i, j] == pytest.approx(expected, rel=1e-10)
    assert np.all(M0[2:] == 0)


def test_information_of_an_arx_model_with_white_input_has_its_closed_form():
    """y + a y(t-1) = b u(t-1) + e: E y^2 = (b^2 P + sigma^2) / (1 - a^2), E y u(t-.) at lag one of phi: 0."""
    a, b, variance, power, N = -0.7, 2.0, 0.5, 1.3, 100
    model = PolynomialModel.single([0.0, b], A=[1.0, a], variance=variance)
    experiment = Experiment(model, N)
    basis = FirBasis(1, 0)
    M = (
        experiment.baseline_information
        + power * basis.integrals(experiment.information_density, experiment.singularities)[0]
    )
    y_power = (b * b * power + variance) / (1 - a * a)
    np.testing.assert_allclose(M, N / variance * np.diag([y_power, power]), rtol=1e-10, atol=1e-8)


def test_loop_norms_of_the_flexible_transmission_agree_with_the_errata(flexible):
    """||S||^2 and ||G S||^2 (H2), recomputed independently in docs/errata.md."""
    basis = FirBasis(1, 0)
    for kind, expected in (("input", 1.0606348409), ("output", 1.8022202466)):
        value = basis.integrals(lambda w, k=kind: flexible.power_density(k, w), flexible.singularities)[0]
        assert value == pytest.approx(expected, abs=6e-11)


RAW = {
    **{f"random {seed}": random_case(seed).experiment() for seed in (1, 8, 9, 15)},
    "continuous": Experiment(two_by_two(), 3, (0.2, 1.5)),
    "arx": Experiment(arx(), 40),
    "single": single(),
}


@pytest.mark.parametrize("name", RAW)
@pytest.mark.parametrize("power", [1.0, 2.5, 30.0])
def test_white_excitation_has_identity_information_in_whitened_coordinates(name, power):
    """White excitation gives the identity, and the way back to raw parameters gives the raw matrix."""
    raw = RAW[name]
    white, basis = raw.whitened(power), FlatBasis(raw.inputs, raw.band)

    def information(experiment):
        gain = basis.integrals(experiment.information_density, experiment.singularities)[0]
        return experiment.baseline_information + power * gain

    M, direct = information(white), information(raw)
    np.testing.assert_allclose(M, np.eye(white.size), atol=1e-9)
    np.testing.assert_allclose(white.to_raw(M), direct, atol=1e-10 * np.abs(direct).max())
    np.testing.assert_allclose(white.raw_covariance(M) @ direct, np.eye(white.size), atol=1e-5)


def test_prior_information_adds():
    model = PolynomialModel.single([0.0, 1.0, 0.5])
    prior = np.array([[4.0, 1.0], [1.0, 3.0]])
    with_prior = Experiment(model, 10, prior=prior)
    np.testing.assert_allclose(with_prior.baseline_information, prior)
    white = with_prior.whitened(1.0)
    np.testing.assert_allclose(white.to_raw(white.baseline_information), prior, rtol=1e-12)


COMMON = PolynomialModel.single(B=np.convolve([0.0, 1.0], [1, -0.5]), F=np.convolve([1, -0.5], [1, 0.3]))
CANCELLED = ContinuousModel.monic(  # (s + 1) / (s + 1)^2
    arrays([[[1.0, 1.0]], [[1.0]]]), arrays([[[1.0, 2.0, 1.0]], [[2.0, 1.0]]]), np.eye(2)
)


@pytest.mark.parametrize(
    ("experiment", "named"),
    [
        (Experiment(COMMON, 100), "b2, f1, f2"),  # moving the common root changes just these
        (
            Experiment(CANCELLED, 1, (0.0, 1.0)),
            r"within the band can distinguish.* b0\[1,1\], a0\[1,1\], a1\[1,1\]$",
        ),
    ],
)
def test_parameters_that_a_common_factor_leaves_without_information_are_named(experiment, named):
    with pytest.raises(SpecError, match=named) as caught:
        experiment.whitened(1.0)
    assert caught.value.diagnostics[0].code == "not-identifiable"


def test_all_parameters_that_cannot_be_distinguished_are_named():
    """The pairs p1, p2 and p3, p4 are named for any basis of the space of these directions."""
    names, rng = ("p1", "p2", "p3", "p4", "p5"), np.random.default_rng(1)
    space = np.array([[1.0, -1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 2.0, 0.0]]).T
    for _ in range(20):
        assert taking_part(names, space @ rng.standard_normal((2, 2))) == "p1, p2, p3, p4"
    null = np.linalg.qr(space)[0]
    rows = rng.standard_normal((50, 5)) @ (np.eye(5) - null @ null.T)
    with pytest.raises(SpecError, match=r"^(?!.*p5).*p1, p2, p3, p4"):
        factor_of(rows, names, excitation="excitation")


@pytest.mark.parametrize("frequencies", [0, 1, 300])
@pytest.mark.parametrize("inputs", [1, 2])
@pytest.mark.parametrize("silent", [(), (0,), (0, 1)])
def test_weighted_products_are_the_sums_over_outputs(frequencies, inputs, silent):
    rng = np.random.default_rng(3)
    F = rng.standard_normal((frequencies, 4, 2, inputs, 2)) @ np.array([1.0, 1.0j])
    F[:, 2, 1] = 0.0
    F[:, :, list(silent)] = 0.0
    w, Y = np.arange(frequencies, dtype=float), np.diag([1.0, 2.0, 3.0, 4.0]) + 0.5
    got = WeightedProducts.of(lambda at: F[at.astype(int)], w, 100).at(Y)  # in parts
    assert got.shape == (frequencies, inputs, inputs)
    np.testing.assert_allclose(got, np.einsum("nkpa,kl,nlpb->nab", F.conj(), Y, F), atol=1e-12)


OUTPUT_ERROR = PolynomialModel.single([0, 0.5], F=[1, -0.8])
SLOW, INTEGRATING = ([0.4], [1, -0.95]), ([0.2], [1, -1])


def controlled(model, controller):
    numerator, denominator = map(np.array, controller)
    return close_loop(model, TransferMatrix.diagonal(Rational.build(numerator, denominator), 1))


CASES = {
    "every polynomial": single(),
    "output error": Experiment(OUTPUT_ERROR, 50),
    "in a loop": Experiment(OUTPUT_ERROR, 50, loop=controlled(OUTPUT_ERROR, SLOW)),
    "under integral action": Experiment(OUTPUT_ERROR, 50, loop=controlled(OUTPUT_ERROR, INTEGRATING)),
    "several channels": Experiment(arx(), 50),
}


@pytest.fixture(params=CASES)
def plants(request):
    nominal = CASES[request.param]
    return [nominal, *(moved(nominal, theta) for theta in around(nominal, 40, 0.03))]


def test_each_plant_has_identity_information_in_its_own_coordinates(plants):
    """White excitation of power two gives the identity, by the integrals of each plant alone."""
    for white in jointly_whitened(plants, 2.0):
        basis = FlatBasis(white.inputs, white.band)
        told = basis.integrals(white.information_density, white.singularities, white.information_factor)
        np.testing.assert_allclose(
            white.noise_information + 2.0 * told[0], np.eye(white.size), rtol=0, atol=1e-9
        )


def test_joint_noise_information_equals_that_of_each_plant_alone(plants):
    told = joint_noise(plants)
    for own, plant in zip(told, plants, strict=True):
        alone = replace(plant).noise_information
        np.testing.assert_allclose(own, alone, rtol=1e-9, atol=1e-10 * np.abs(alone).max())


@pytest.mark.parametrize("basis", [FirBasis(1, 7), LinesBasis.at(np.array([0.1, 0.9, 2.2]), 1)])
def test_joint_information_equals_the_integrals_of_each_plant_alone(plants, basis):
    if plants[0].inputs > 1:
        basis = LinesBasis.at(np.array([0.1, 0.9, 2.2]), 2)
    white = jointly_whitened(plants, 1.0)
    told = joint_information(white, basis.integrals)
    assert told.shape == (basis.size, len(plants), white[0].size, white[0].size)
    for number, plant in enumerate(white):
        alone = basis.integrals(plant.information_density, plant.singularities)
        np.testing.assert_allclose(told[:, number], alone, rtol=0, atol=1e-10 * np.abs(alone).max())


@pytest.mark.parametrize("samples", [3, 3000])
def test_the_mean_cost_is_the_mean_of_the_powers(plants, samples):
    w = np.linspace(0.01, 3.1, samples)
    weights = [("input", None, 1.0), ("output", 0, 0.3), ("excitation", None, 0.1)]
    each = [
        sum(weight * p.power_density(kind, w, channel) for kind, channel, weight in weights) for p in plants
    ]
    np.testing.assert_allclose(mean_cost(plants, weights, w), np.mean(each, axis=0), rtol=1e-10)


def test_joint_loop_responses_are_g_s_at_the_output_and_s_at_the_input():
    """G S at y and S at u, with S = 1 / (1 + C G), also where one of the plants integrates."""
    w = np.array([0.3, 1.2, 2.9])
    q = np.exp(-1j * w)
    models = [PolynomialModel.single([0, b], F=[1, -f]) for b, f in ((0.5, 0.8), (0.4, 1.0), (0.3, 0.5))]
    for numerator, denominator in (SLOW, INTEGRATING):
        C = numerator[0] / (denominator[0] + denominator[1] * q)
        y, u = excited([controlled(model, (numerator, denominator)) for model in models], w)
        for number, model in enumerate(models):
            G = model.plant_at(w)[:, 0, 0]
            np.testing.assert_allclose(u[number, :, 0, 0], 1.0 / (1.0 + C * G), rtol=1e-12)
            np.testing.assert_allclose(y[number, :, 0, 0], G / (1.0 + C * G), rtol=1e-12)


@pytest.mark.parametrize("samples", [3, 700])  # few frequencies, and many
@pytest.mark.parametrize("controllers", [(SLOW, SLOW, SLOW), (INTEGRATING,) * 3, (SLOW, INTEGRATING, SLOW)])
def test_gradients_of_loops_are_the_derivatives_of_the_predictor(samples, controllers):
    """y = G S r + .. and u = S r put into (D A / C) y - (D B / (C F)) u, by finite differences.

    The last coefficients of the first plant are zero; the other plants have none that is zero.
    """
    w = np.linspace(0.2, 3.0, samples)
    models = [
        PolynomialModel.single([0, 0.5, b2], A=[1, -0.4, a2], C=[1, 0.2], D=[1, d1])
        for a2, b2, d1 in ((0.0, 0.0, 0.3), (0.1, 0.2, 0.1), (-0.2, 0.1, 0.5))
    ]
    loops = [controlled(model, controller) for model, controller in zip(models, controllers, strict=True)]
    q = np.exp(-1j * w)

    def filters(model, theta):
        at = model.at(theta)
        A, B, C, D = (np.polynomial.polynomial.polyval(q, c) for c in (at.A[0], at.B[0][0], at.C[0], at.D[0]))
        return D * A / C, D * B / C

    of_r, of_e = excitation_gradients(loops, w), disturbance_gradients(loops, w)
    for number, (model, (above, below)) in enumerate(zip(models, controllers, strict=True)):
        C = above[0] / (below[0] + below[1] * q)
        G, H = model.plant_at(w)[:, 0, 0], model.noise_at(w)[:, 0, 0]
        S = 1.0 / (1.0 + C * G)
        for index in range(len(model.theta)):
            step = np.zeros(len(model.theta))
            step[index] = 1e-6
            (Y1, U1), (Y0, U0) = filters(model, model.theta + step), filters(model, model.theta - step)
            dY, dU = (Y1 - Y0) / 2e-6, (U1 - U0) / 2e-6
            for found, y, u in ((of_r, G * S, S), (of_e, S * H, -C * S * H)):
                # epsilon = dY y - dU u, and the gradient of the prediction is minus that.
                np.testing.assert_allclose(found[number, :, index, 0, 0], dU * u - dY * y, rtol=0, atol=1e-7)
