"""Information of several channels: against the SISO experiment, Monte Carlo free definitions, and laws."""

import numpy as np
import pytest
from channel_plants import arrays, arx, box_jenkins, paper_experiment, two_by_two

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, Loop, PolynomialModel
from inputdesign_cli.spectrum import FirBasis, FlatBasis, MatrixFirBasis

W = np.array([0.1, 0.9, 2.2])


def siso_pair():
    A, B, C, D, F = (np.array(p) for p in ([1, -0.5], [0, 2.0, 0.3], [1, 0.2], [1, 0.6], [1, -0.1, 0.4]))
    siso = PolynomialModel.single(A=A, B=B, C=C, D=D, F=F, variance=0.7)
    one = PolynomialModel(((B,),), (A,), ((F,),), (C,), (D,), 0.7 * np.eye(1))
    return Experiment(Loop(siso), 50), Experiment(one, 50)


def test_one_channel_is_the_siso_experiment():
    siso, one = siso_pair()
    np.testing.assert_allclose(one.information_density(W), siso.information_density(W), rtol=1e-12)
    np.testing.assert_allclose(one.baseline_information, siso.baseline_information, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one.power_density("output", W), siso.power_density("output", W))
    np.testing.assert_allclose(np.abs(one.whitened(2.0).factor), np.abs(siso.whitened(2.0).factor), rtol=1e-8)
    Y = np.diag(np.arange(1.0, one.size + 1))
    np.testing.assert_allclose(one.value_density(Y, W), siso.value_density(Y, W), rtol=1e-12)


@pytest.mark.parametrize("experiment", [paper_experiment(), Experiment(box_jenkins(), 10).whitened(1.0)])
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
    ours = np.einsum("nlmab,nba->nlm", experiment.information_density(W), phi)
    np.testing.assert_allclose(ours.imag, 0, atol=1e-9 * np.abs(ours).max())
    for n in range(3):
        np.testing.assert_allclose(
            experiment.to_raw(ours[n].real), raw[n], rtol=1e-9, atol=1e-11 * np.abs(raw).max()
        )
    Y = rng.normal(size=(k, k))
    Y = Y + Y.T
    value = np.einsum("nab,nba->n", experiment.value_density(Y, W), phi)
    np.testing.assert_allclose(value, np.einsum("nlm,lm->n", ours, Y), rtol=1e-10)


def test_channel_powers_add_up():
    experiment = Experiment(box_jenkins(), 10)
    for kind, number in (("input", 3), ("output", 2)):
        parts = sum(experiment.power_density(kind, W, channel=i) for i in range(number))
        np.testing.assert_allclose(parts, experiment.power_density(kind, W), atol=1e-14)


@pytest.mark.parametrize("power", [1.0, 30.0])
def test_whitening_makes_even_excitation_the_identity(power):
    for experiment in (Experiment(two_by_two(), 3, (0.2, 1.5)), Experiment(arx(), 40)):
        white = experiment.whitened(power)
        basis = FlatBasis(2, white.band)
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


def test_matrix_fir_of_one_channel_is_fir():
    siso, one = siso_pair()
    ours = MatrixFirBasis(1, 6).integrals(one.information_density, one.singularities)
    theirs = FirBasis(6).integrals(siso.information_density, siso.singularities)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_parameters_that_the_band_cannot_tell_apart_are_named():
    """(s + 1) / (s + 1)^2: the common factor leaves a direction without information."""
    model = ContinuousModel.monic(
        arrays([[[1.0, 1.0]], [[1.0]]]), arrays([[[1.0, 2.0, 1.0]], [[2.0, 1.0]]]), np.eye(2)
    )
    with pytest.raises(
        SpecError, match=r"within the band can tell.* b0\[1,1\], a0\[1,1\], a1\[1,1\]$"
    ) as caught:
        Experiment(model, 1, (0.0, 1.0)).whitened(1.0)
    assert caught.value.diagnostics[0].code == "not-identifiable"
