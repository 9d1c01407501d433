"""Records of several inputs: their spectra are what was asked, and their information is their own."""

import numpy as np
import pytest
import scipy.signal
from channel_plants import arrays, arx, paper_experiment
from inputdesign_cli.signal.channels import orthogonal_columns

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant import MatrixController, PolynomialChannels, PolynomialLoop
from inputdesign_cli.signal import (
    Lines,
    RecordFilter,
    channel_outputs,
    channel_record_information,
    grid_lines,
    merged,
    multisine_record,
)


def hermitian_density(number, r, rng):
    X = rng.normal(size=(number, r, r)) + 1j * rng.normal(size=(number, r, r))
    return X @ X.conj().swapaxes(1, 2)


@pytest.mark.parametrize("r", [1, 2, 3, 4])
def test_orthogonal_periods_have_exactly_the_spectrum(r):
    rng = np.random.default_rng(0)
    period = 64
    phi = hermitian_density(period // 2 + 1, r, rng)
    record = multisine_record(grid_lines(phi, period, 1.0), r * period, rng, "orthogonal")
    blocks = np.fft.rfft(record.reshape(r, period, r), axis=1) / np.sqrt(period)
    mean = np.einsum("bni,bnj->nij", blocks, blocks.conj()) / r
    inside = slice(1, period // 2)
    np.testing.assert_allclose(mean[inside], phi[inside], atol=1e-10 * np.abs(phi).max())
    ends = np.trace(mean[[0, -1]], axis1=1, axis2=2).real
    if r != 3:  # signs are orthogonal there, so that the ends are exact too
        np.testing.assert_allclose(ends, np.trace(phi[[0, -1]], axis1=1, axis2=2).real, rtol=1e-9)


def test_random_phases_meet_the_spectrum_on_average_with_one_vector_a_line():
    rng = np.random.default_rng(1)
    period, draws = 16, 4000
    phi = hermitian_density(period // 2 + 1, 2, rng)
    lines = grid_lines(phi, period, 1.0)
    records = np.array([multisine_record(lines, period, rng, "random") for _ in range(draws)])
    X = np.fft.rfft(records, axis=1) / np.sqrt(period)
    outer = np.einsum("dni,dnj->dnij", X, X.conj())
    assert np.linalg.matrix_rank(outer[0, 3], tol=1e-9) == 1
    inside = slice(1, period // 2)
    deviation = outer.mean(axis=0)[inside] - phi[inside]
    error = outer.std(axis=0)[inside] / np.sqrt(draws)
    assert np.all(np.abs(deviation) < 5 * error + 1e-9)


def test_lines_anywhere_have_their_powers():
    powers = np.array([[[2.0, 0.5j], [-0.5j, 1.0]]], dtype=complex)
    lines = Lines(np.array([0.3]), powers)
    rng = np.random.default_rng(2)
    record = multisine_record(lines, 2 * 20000, rng, "orthogonal")
    np.testing.assert_allclose(record.T @ record / len(record), powers[0].real, atol=2e-3)


def test_lines_that_a_record_cannot_tell_apart_become_one():
    powers = np.array([np.eye(2), 2 * np.eye(2), 3 * np.eye(2)], dtype=complex)
    found = merged(Lines(np.array([1.0, 1e-9, 2e-7]), powers), 100)
    assert found.frequencies[1] == 1.0
    assert 0 < found.frequencies[0] < 1e-6
    np.testing.assert_allclose(found.powers, [5 * np.eye(2), np.eye(2)])
    record = multisine_record(found, 200, np.random.default_rng(0), "orthogonal")
    assert np.mean(record**2) == pytest.approx(6.0, rel=0.05)


def test_columns_are_orthogonal_and_of_modulus_one():
    for order in range(1, 7):
        Q = orthogonal_columns(order)
        np.testing.assert_allclose(Q.conj().T @ Q, order * np.eye(order), atol=1e-12)
        np.testing.assert_allclose(np.abs(Q), 1.0)


def test_information_of_a_record_is_that_of_simulated_regressors():
    """For ARX the gradient of the prediction is the regressor itself, filtered by nothing."""
    model = arx()
    experiment = ChannelExperiment(model, 100).whitened(1.0)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(300, 2))
    y = np.stack(
        [sum(scipy.signal.lfilter(model.B[i][j], model.A[i], u[:, j]) for j in range(2)) for i in range(2)],
        axis=1,
    )
    np.testing.assert_allclose(channel_outputs(experiment, u, 1.0), y, atol=1e-9)

    def late(x, lag):
        return np.concatenate([np.zeros(lag), x[: x.size - lag]])

    psi = np.zeros((300, experiment.size, 2))
    for index, parameter in enumerate(model.parameters):
        for i, j in set(parameter.places):
            source = late(u[:, j], parameter.power) if parameter.letter == "b" else -late(y[:, i], 1)
            psi[:, index, i] = source
    precision = np.linalg.inv(model.covariance)
    expected = np.einsum("tki,ij,tlj->kl", psi, precision, psi)
    noise = ChannelExperiment(model, 300).baseline_information
    ours = experiment.to_raw(channel_record_information(experiment, u, 1.0))
    np.testing.assert_allclose(ours, expected + noise, atol=1e-8 * np.abs(expected).max())


def test_a_long_record_in_continuous_time_has_the_information_of_its_spectrum():
    experiment = paper_experiment()
    period, step = 2048, 1.0
    w = 2 * np.pi * np.arange(period // 2 + 1) / (period * step)
    phi = np.where((w > 0.1) & (w < 1.8), 1.0, 0.0)[:, None, None] * np.array([[2.0, 0.5], [0.5, 1.0]])
    lines = grid_lines(phi, period, step)
    record = multisine_record(lines, 2 * period, np.random.default_rng(4), "orthogonal")
    densities = experiment.information_density(lines.frequencies / step)
    expected = np.einsum("nklab,nba->kl", densities, lines.powers).real
    ours = channel_record_information(experiment, record, step) / len(record)
    np.testing.assert_allclose(ours, expected, atol=0.02 * np.abs(expected).max())


SLOW = PolynomialChannels(
    arrays([[[0, 1.0, 0.4], [0, 0.3]], [[0, 0.5], [0, 1.2]]]),
    (np.array([1.0, -0.99999]), np.array([1.0, -0.5])),
    arrays([[[1.0], [1.0]], [[1.0], [1.0, -1.9, 0.9995]]]),
    (np.ones(1),),
    (np.ones(1),),
    np.eye(2),
)


def test_a_plant_that_remembers_longer_than_the_record_is_filtered_exactly():
    """An almost integrating and a lightly damped entry, against the difference equations."""
    u = np.random.default_rng(0).standard_normal((300, 2))
    plant = RecordFilter(ChannelExperiment(SLOW, 300), 300, 1.0)
    wanted = np.zeros((300, 2))
    for i in range(2):
        right = sum(scipy.signal.lfilter(SLOW.B[i][j], SLOW.F[i][j], u[:, j]) for j in range(2))
        wanted[:, i] = scipy.signal.lfilter([1.0], SLOW.A[i], right)
    np.testing.assert_allclose(plant.signals("output", u), wanted, atol=1e-11 * np.abs(wanted).max())
    v = np.random.default_rng(1).standard_normal((300, 2))
    assert np.sum(plant.adjoint("output", v) * u) == pytest.approx(np.sum(wanted * v), rel=1e-10)


def test_a_slow_loop_is_filtered_exactly_and_at_once():
    """Integrators of gain 1e-5 settle in a million samples; the record has 200."""
    model = arx()
    gains = 1e-5 * np.linalg.inv(model.plant_at(np.zeros(1))[0].real)
    controller = MatrixController.build([[[g] for g in row] for row in gains], [[[1, -1]] * 2] * 2)
    loop = PolynomialLoop(model, controller)
    loop.check_stability()
    r = np.random.default_rng(1).standard_normal((200, 2))
    plant = RecordFilter(ChannelExperiment(model, 200, loop=loop), 200, 1.0)
    y, u = loop.signals(r, np.zeros((200, 2)))
    np.testing.assert_allclose(plant.signals("output", r), y, atol=1e-10)
    np.testing.assert_allclose(plant.signals("input", r), u, atol=1e-10)
    assert plant._length <= 2048
