"""Cycles that act on an output by themselves, and modes that inputs move."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.cycles import _modes, _residues, own_cycles
from inputdesign_cli.identification.estimators import identify
from inputdesign_cli.plant import PolynomialModel

SAMPLES, PERIOD = 400, 100.0
NOISE = 1e-4 * np.eye(1)
LITTLE = np.eye(6)  # so little is known that no damping is told from none


def output_error(*terms):
    """The sum of gain q^-1 / (1 - pole q^-1), pairs of complex poles with their conjugates."""
    pairs = [t for gain, pole in terms for t in {(gain, pole), (np.conj(gain), np.conj(pole))}]
    F = np.real(np.poly([pole for _, pole in pairs]))
    B = sum(gain * np.atleast_1d(np.poly([p for _, p in pairs if p != pole])) for gain, pole in pairs)
    return PolynomialModel.single(np.concatenate([[0.0], np.real(B)]), F=F)


def record(model, cycle=0.0):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 20), 20)[:, None]
    y = model.simulate(u - u.mean(), np.zeros(u.shape), 1.0)[0]
    return u, y + cycle * np.sin(2.0 * np.pi / PERIOD * np.arange(SAMPLES) + 0.5)[:, None]


def mode(losing=0.02):
    """A pole that loses so many nepers over the record."""
    return np.exp(-losing / SAMPLES + 2j * np.pi / PERIOD)


@pytest.mark.parametrize("losing", [1e-7, 0.001, 0.02, 1.5])
def test_a_cycle_that_zeros_hide_from_the_input_is_told_with_its_period(losing):
    lag = (0.15, 0.92)
    parts = [record(output_error(lag), cycle=0.8)]
    # Nearly a common factor: from the input the mode has next to nothing.
    (cycle,) = _modes(output_error(lag, (1e-4, mode(losing))), parts, LITTLE, NOISE)
    assert (cycle.output, cycle.is_mode) == (0, True)
    np.testing.assert_allclose(cycle.period, PERIOD, rtol=1e-3)


@pytest.mark.parametrize("losing", [0.02, 1.5, 4.0])
def test_a_mode_that_inputs_move_is_no_cycle(losing):
    model = output_error((0.15, 0.92), (0.05 + 0.02j, mode(losing)))
    assert _modes(model, [record(model)], LITTLE, NOISE) == []
    # Two records of one plant, and a cycle that is small beside what the input does.
    assert _modes(model, [record(model, cycle=0.05), record(model)], LITTLE, NOISE) == []


def test_a_cycle_that_dies_out_within_the_record_is_not_one():
    model = output_error((0.15, 0.92), (1e-4, mode(6.0)))
    assert _modes(model, [record(output_error((0.15, 0.92)), cycle=0.8)], LITTLE, NOISE) == []


def test_plants_without_ringing_have_no_cycle():
    parts = [record(output_error((0.15, 0.92)), cycle=0.8)]
    assert _modes(output_error((0.15, 0.92)), parts, LITTLE, NOISE) == []
    assert _modes(output_error((0.15, 0.92), (0.1, -0.999)), parts, LITTLE, NOISE) == []


@pytest.mark.parametrize("index", range(3))
def test_residues_are_those_of_partial_fractions(index):
    terms = [(0.3, 0.5), (0.1 - 0.2j, 0.8 + 0.3j), (0.04 + 0.01j, mode())]
    model, (gain, pole) = output_error(*terms), terms[index]
    upper = np.array([p for _, p in terms])
    np.testing.assert_allclose(_residues(model, pole, upper), [[gain]], rtol=1e-9)
    B, F = model.B[0][0], model.F[0][0]
    residues, poles, _ = scipy.signal.residue(B[1:], F)
    np.testing.assert_allclose(residues[np.argmin(np.abs(poles - pole))], gain, rtol=1e-6)


@pytest.mark.parametrize("period", [25.0, 60.0, 133.3])
def test_a_cycle_that_is_left_and_moves_the_parameters_is_told(period):
    model, rng = output_error((0.15, 0.92)), np.random.default_rng(int(period))
    u, y = record(model)
    y = y + 0.1 * rng.standard_normal(y.shape)
    waves = 0.5 * np.sin(2.0 * np.pi / period * np.arange(SAMPLES) + 0.5)[:, None]
    factor = 10.0 * np.sqrt(SAMPLES) * np.eye(2)
    noise = 0.01 * np.eye(1)
    (cycle,) = own_cycles(model, [(u, y + waves)], factor, noise)
    assert (cycle.output, cycle.is_mode) == (0, False)
    np.testing.assert_allclose(cycle.period, period, rtol=0.15)
    # No cycle; one that the input has as well; and one that moves nothing, for the parameters are unknown.
    assert own_cycles(model, [(u, y)], factor, noise) == []
    assert own_cycles(model, [(u + 6.0 * waves, y + waves)], factor, noise) == []
    assert own_cycles(model, [(u, y + waves)], 1e6 * factor, noise) == []


def test_noise_alone_seldom_has_a_line():
    """Of 300 records, whose noise has a memory: 0.03 expected."""
    rng, model = np.random.default_rng(5), output_error((0.15, 0.92))
    found = 0
    for _ in range(300):
        u = rng.standard_normal((300, 1))
        e = scipy.signal.lfilter([1.0], [1.0, -0.8], rng.standard_normal((300, 1)), axis=0)
        y = model.simulate(u, np.zeros(u.shape), 1.0)[0] + e
        found += bool(own_cycles(model, [(u, y)], 1e-3 * np.eye(2), np.eye(1)))
    assert found == 0


def test_of_two_outputs_the_one_with_the_cycle_is_told():
    lag, cycling = output_error((0.15, 0.92)), output_error((0.15, 0.92), (1e-4, mode()))
    u, y = record(output_error((0.15, 0.92)), cycle=0.8)
    still = lag.simulate(u - u.mean(), np.zeros(u.shape), 1.0)[0]
    both = PolynomialModel(
        (*lag.B, *cycling.B), (np.ones(1),), (*lag.F, *cycling.F), (np.ones(1),), (np.ones(1),), np.eye(2)
    )
    (found,) = _modes(both, [(u, np.concatenate([still, y], axis=1))], np.eye(8), 1e-4 * np.eye(2))
    assert found.output == 1


@pytest.mark.parametrize("damping", [0.002, 0.01])
def test_a_plant_that_rings_from_before_the_record_is_told_by_its_damping(damping):
    """The start makes more of the mode than the inputs do, and the record tells what it loses."""
    w, samples = 0.3, 300
    pole = np.exp(-damping * w + 1j * w)
    F = np.real(np.poly([pole, np.conj(pole)]))
    model = PolynomialModel.single([0.0, 0.5 * F.sum(), 0.5 * F.sum()], F=F)
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], samples // 5), 5)[:, None]
    ringing = 20.0 * np.real(pole ** np.arange(samples))[:, None]
    y = model.simulate(u, 0.1 * rng.standard_normal(u.shape), 1.0)[0] + ringing
    y += 0.1 * rng.standard_normal(y.shape)
    estimate = identify(model, u, y, rest=False)
    found = model.at(estimate.theta, estimate.noise)
    assert own_cycles(found, [(u, y)], estimate.factor, estimate.noise) == []
