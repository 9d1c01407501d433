"""Information: against the definition, textbook formulas and laws, of one channel and of several."""

import numpy as np
import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, PolynomialModel
from inputdesign_cli.spectrum import FirBasis, FlatBasis
from tests.support.plants import arrays, arx, box_jenkins, paper_experiment, two_by_two
from tests.support.random_plants import random_case

W = np.array([0.1, 0.9, 2.2])


def single() -> Experiment:
    """One input and one output, every polynomial present."""
    model = PolynomialModel.single(
        [0, 2.0, 0.3], A=[1, -0.5], C=[1, 0.2], D=[1, 0.6], F=[1, -0.1, 0.4], variance=0.7
    )
    return Experiment(model, 50)


def as_matrices(density, inputs):
    """(n, .., r, r), of one input too."""
    return density[..., None, None] if inputs == 1 else density


@pytest.mark.parametrize(
    "experiment", [paper_experiment(), Experiment(box_jenkins(), 10).whitened(1.0), single().whitened(2.0)]
)
def test_densities_are_the_definition(experiment):
    """(3) of the spectral design paper, for a random Hermitian spectrum at each frequency."""
    rng = np.random.default_rng(0)
    r, k = experiment.inputs, experiment.size
    X = rng.normal(size=(3, r, r)) + 1j * rng.normal(size=(3, r, r))
    phi = X @ X.conj().swapaxes(1, 2)
    H_inverse_dG = experiment.model.input_gradient(W)
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


@pytest.mark.parametrize("experiment", [Experiment(box_jenkins(), 10), single()])
def test_channel_powers_add_up(experiment):
    for kind, number in (("input", experiment.model.inputs), ("output", experiment.model.outputs)):
        parts = sum(experiment.power_density(kind, W, channel=i) for i in range(number))
        np.testing.assert_allclose(parts, experiment.power_density(kind, W), atol=1e-14)


@pytest.mark.parametrize("power", [1.0, 30.0])
def test_whitening_makes_even_excitation_the_identity(power):
    for experiment in (Experiment(two_by_two(), 3, (0.2, 1.5)), Experiment(arx(), 40), single()):
        white = experiment.whitened(power)
        basis = FlatBasis(white.inputs, white.band)
        information = (
            white.baseline_information
            + power * basis.integrals(white.information_density, white.singularities)[0]
        )
        np.testing.assert_allclose(information, np.eye(white.size), atol=1e-9)


def test_noise_alone_informs_about_arx_parameters_as_a_lyapunov_equation_says():
    """y_i = -a y_i(t-1) + e: E y^2 = s^2 / (1 - a^2); errors are correlated across outputs."""
    model = arx()
    M0 = Experiment(model, 1).baseline_information
    covariance, precision = model.covariance, np.linalg.inv(model.covariance)
    for i, a in enumerate((-0.7, 0.4)):
        for j, b in enumerate((-0.7, 0.4)):
            expected = precision[i, j] * covariance[i, j] / (1 - a * b)
            assert M0[i, j] == pytest.approx(expected, rel=1e-10)
    assert np.all(M0[2:] == 0)


def test_parameters_that_the_band_cannot_tell_apart_are_named():
    """(s + 1) / (s + 1)^2: the common factor leaves a direction without information."""
    model = ContinuousModel.monic(
        arrays([[[1.0, 1.0]], [[1.0]]]), arrays([[[1.0, 2.0, 1.0]], [[2.0, 1.0]]]), np.eye(2)
    )
    with pytest.raises(
        SpecError, match=r"within the band can distinguish.* b0\[1,1\], a0\[1,1\], a1\[1,1\]$"
    ) as caught:
        Experiment(model, 1, (0.0, 1.0)).whitened(1.0)
    assert caught.value.diagnostics[0].code == "not-identifiable"


def test_information_of_an_arx_model_with_white_input():
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


def test_loop_norms_of_the_flexible_transmission(flexible):
    """||S||^2 and ||G S||^2 (H2), recomputed independently in docs/errata.md."""
    basis = FirBasis(1, 0)
    for kind, expected in (("input", 1.0606348409), ("output", 1.8022202466)):
        value = basis.integrals(lambda w, k=kind: flexible.power_density(k, w), flexible.singularities)[0]
        assert value == pytest.approx(expected, abs=6e-11)


@pytest.mark.parametrize("seed", [1, 8, 9, 15])
def test_whitened_coordinates(seed):
    """White excitation gives the identity, and the way back to raw parameters gives the raw matrix."""
    raw = random_case(seed).experiment()
    white = raw.whitened(2.5)
    basis = FirBasis(1, 0)

    def information(experiment):
        gain = basis.integrals(experiment.information_density, experiment.singularities)[0]
        return experiment.baseline_information + 2.5 * gain

    M = information(white)
    np.testing.assert_allclose(M, np.eye(white.size), atol=1e-9)
    direct = information(raw)
    np.testing.assert_allclose(white.to_raw(M), direct, atol=1e-10 * np.abs(direct).max())
    P = white.raw_covariance(M)
    np.testing.assert_allclose(P @ direct, np.eye(white.size), atol=1e-5)


def test_prior_information_adds():
    model = PolynomialModel.single([0.0, 1.0, 0.5])
    prior = np.array([[4.0, 1.0], [1.0, 3.0]])
    with_prior = Experiment(model, 10, prior=prior)
    np.testing.assert_allclose(with_prior.baseline_information, prior)
    white = with_prior.whitened(1.0)
    np.testing.assert_allclose(white.to_raw(white.baseline_information), prior, rtol=1e-12)


def test_parameters_that_cannot_be_told_apart_are_named():
    """A common factor of B and F."""
    model = PolynomialModel.single(B=np.convolve([0.0, 1.0], [1, -0.5]), F=np.convolve([1, -0.5], [1, 0.3]))
    with pytest.raises(SpecError) as error:
        Experiment(model, 100).whitened(1.0)
    diagnostic = error.value.diagnostics[0]
    assert diagnostic.code == "not-identifiable"
    assert "b2, f1, f2" in diagnostic.message  # moving the common root changes just these
