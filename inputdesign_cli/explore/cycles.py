"""Cycles that act on an output by themselves, as of days.

A model takes them for a mode of the plant: without damping, hardly moved by the inputs and set in motion by
the unknown state at the start, it explains any sinusoid. A ringing of the plant, begun before the record,
looks alike, but for its damping, which the record tells. Or they are left, and move the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.explore.fits import Parts, output_error_form, simulate_free
from inputdesign_cli.explore.one_line import strongest, wave
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records
from inputdesign_cli.plant import Model

# A mode that loses more than this, in nepers, over the record is no cycle, nor is less than half a turn.
_DECAYS, _LEAST_TURN = 3.0, np.pi
# What a mode does from the start is that much of what the inputs make of it; its squares, in units of the
# variance of the noise, are beyond chance.
_OF_ITSELF, _SEEN = 0.5, 20.0
# Its damping is told from none by so many deviations, and not below so many nepers over the record; of fewer
# turns no share tells anything.
_DAMPED, _UNDAMPED, _FEW_TURNS = 10.0, 0.01, 2.0
_STEP = 1e-7
# Of a circle about poles, on which G is as smooth as it is far from others.
_POINTS, _HALF = 64, 0.5
_DEPENDENT = 1e-9
# A line stands out of those about it, beyond where a window spreads it, with this probability by chance at
# most; an input has it with that. It moves the parameters by so many deviations.
_SURELY, _ALSO, _MOVED = 1e-4, 1e-2, 3.0
_FIRST, _SPREAD, _ABOUT = 2, 3, 20
_FEWEST = 4 * _ABOUT


@dataclass(frozen=True)
class Cycle:
    """One that acts on an output, its period in samples; whether it is a mode of the model, or left."""

    output: int
    period: float
    is_mode: bool


def own_cycles(model: Model, parts: Parts, factor: Array, noise: Array) -> list[Cycle]:
    """Cycles of outputs that no input makes: modes that go on by themselves, or what is left of an output.

    Args:
        parts: the records u (n, r), y (n, p) that the model is estimated from.
        factor: L (k, k), their information about the parameters is L L^T.
        noise: (p, p), the covariance of the prediction errors.

    Raises:
        TypeError: see `output_error_form`.
    """
    modes = _modes(model, parts, factor, noise)
    taken = {one.output for one in modes}
    return modes + [one for one in _left(model, parts, factor, noise) if one.output not in taken]


def _left(model: Model, parts: Parts, factor: Array, noise: Array) -> list[Cycle]:
    """Lines of prediction errors that no input has, and that move the parameters."""
    u, y = max(parts, key=lambda part: len(part[1]))
    records = Records((estimator(model, 1.0).kind.record(u - u.mean(axis=0), y - y.mean(axis=0)),))
    with np.errstate(all="ignore"):
        near = records.begun_freely(records.lateness(model.theta)).at(model.theta)
    if len(y) < _FEWEST or not (np.all(np.isfinite(near.errors)) and np.all(np.isfinite(near.psi))):
        return []
    told, weights = [], np.linalg.inv(noise)
    for i, e in enumerate(near.errors.T):
        line = _line_of(e)
        if line is None or any(_stands_out(x, line) < _ALSO for x in u.T):
            continue
        columns = wave(strongest(e, np.zeros((len(e), 0))), len(e))
        sine = columns @ np.linalg.lstsq(columns, e)[0]
        # What the sine adds to the slope of the cost, in standard deviations of the parameters.
        slope = np.einsum("knp,p,n->k", near.psi, weights[i], sine)
        moved = scipy.linalg.solve_triangular(factor, slope, lower=True)
        if moved @ moved > _MOVED**2:
            told.append(Cycle(i, len(e) / line, is_mode=False))
    return told


def _line_of(x: Array) -> int | None:
    """The line of the spectrum of x (n,) that stands out of those about it; None where none does."""
    line = int(np.argmax(_windowed(x)[_FIRST:])) + _FIRST
    return line if _stands_out(x, line) < _SURELY else None


def _stands_out(x: Array, line: int) -> float:
    """The probability, of noise without lines, that any has as much more power than those about it.

    The window spreads a line over its neighbours, which do not count. Noise may be flat about the line, or
    fall as that of a random walk does.
    """
    power = _windowed(x)
    here = slice(line - 1, line + 2)
    about = np.r_[max(line - _ABOUT, 1) : line - _SPREAD, line + _SPREAD + 1 : line + _ABOUT]
    about = about[(about > 0) & (about < len(power))]
    ratios = []
    for falls in (0.0, 2.0):
        level = np.arange(len(power)) ** falls * power
        ratios.append(float(np.max(level[here])) / max(float(np.mean(level[about])), 1e-300))
    # The slow lines, which move most models most, have half of the level.
    tried = 2 * min(_ABOUT if line <= _ABOUT else len(power), len(power))
    return min(tried * float(scipy.special.fdtrc(2.0, 2.0 * len(about), min(ratios))), 1.0)


def _windowed(x: Array) -> Array:
    return np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) ** 2


def _modes(model: Model, parts: Parts, factor: Array, noise: Array) -> list[Cycle]:
    """Modes that go on by themselves rather than by what the inputs do, without a damping that is told."""
    plant = output_error_form(model)
    upper = _poles(plant)
    longest = max(len(y) for _, y in parts)
    turns, decays = np.angle(upper) * longest, _damping(upper) * longest
    told = []
    for pole in upper[(turns > _LEAST_TURN) & (np.angle(upper) < np.pi) & (decays < _DECAYS)]:
        if _is_damped(model, pole, factor, longest):
            continue
        moved, free = np.zeros((2, model.outputs))
        for u, y in parts:
            by_inputs, by_start = _of_mode(plant, pole, upper, u - u.mean(axis=0), y)
            moved += np.sum(by_inputs**2, axis=0)
            free += np.sum(by_start**2, axis=0)
        period = float(2.0 * np.pi / np.angle(pole))
        few = np.angle(pole) * longest < 2.0 * np.pi * _FEW_TURNS
        share = np.where(few & (moved > _SEEN * np.diag(noise)), np.inf, free / np.maximum(moved, 1e-300))
        going = np.flatnonzero((share > _OF_ITSELF**2) & (free > _SEEN * np.diag(noise)))
        told += [Cycle(int(i), period, is_mode=True) for i in going]
    return told


def _poles(plant: Model) -> ComplexArray:
    """Poles of a stable plant on and above the real axis, those of a pair once."""
    return np.asarray(np.unique(np.exp(1j * plant.singularities.real - plant.singularities.imag)))


def _damping(poles: ComplexArray) -> Array:
    """Nepers per sample."""
    return -np.log(np.abs(poles))


def _is_damped(model: Model, pole: complex, factor: Array, samples: int) -> bool:
    """Whether the damping of a mode is told from none, its deviation by differences."""
    damping = float(_damping(np.array(pole)))
    if damping * samples < _UNDAMPED:  # the other side of the circle would be mirrored
        return False
    slope = np.zeros(model.theta.size)
    for k, value in enumerate(model.theta):
        away = _STEP * max(abs(float(value)), _STEP) * np.eye(slope.size)[k]
        ends = []
        for theta in (model.theta + away, model.theta - away):
            poles = _poles(output_error_form(model.at(theta, model.covariance)))
            ends.append(float(_damping(poles[np.argmin(np.abs(poles - pole))])))
        slope[k] = (ends[0] - ends[1]) / (2.0 * away[k])
    return damping > _DAMPED * float(np.linalg.norm(scipy.linalg.solve_triangular(factor, slope, lower=True)))


def _of_mode(plant: Model, pole: complex, upper: ComplexArray, u: Array, y: Array) -> tuple[Array, Array]:
    """(n, p) twice: what inputs u (n, r) make of the mode, and what the start makes of it."""
    driven = scipy.signal.lfilter([0.0, 1.0], [1.0, -pole], u.astype(complex), axis=0)
    by_inputs = 2.0 * (driven @ _residues(plant, pole, upper).T).real
    explained, late = simulate_free(plant, u, y)
    left = (explained - plant.simulate(u, np.zeros(y.shape), 1.0)[0])[late:]
    times = np.arange(len(y) - late)[:, None]
    # The level, and every mode as it goes on by itself.
    waves = upper**times
    columns = np.concatenate([waves.real, waves.imag[:, upper.imag > 0.0], np.ones_like(times)], axis=1)
    own = np.abs(upper - pole) * len(y) < 1.0
    its = np.concatenate([own, own[upper.imag > 0.0], [False]])
    return by_inputs, columns[:, its] @ np.linalg.lstsq(columns, left, rcond=_DEPENDENT)[0][its]


def _residues(plant: Model, pole: complex, upper: ComplexArray) -> ComplexArray:
    """(p, r): the residues of G at a pole, by Cauchy's integral on a circle that holds no other."""
    others = np.concatenate([upper, upper.conj()])
    away = np.abs(others - pole)
    around = _HALF * float(np.min(away[away > 0.0])) * np.exp(2j * np.pi * np.arange(_POINTS) / _POINTS)
    G = plant.plant_at(-1j * np.log(pole + around))
    return np.asarray(np.tensordot(around, G, 1) / _POINTS)
