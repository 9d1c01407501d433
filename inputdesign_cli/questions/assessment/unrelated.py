"""Inputs that may not be those that moved the plant: they answer the outputs, or explain nothing of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.explore import answers_output, early_answers
from inputdesign_cli.identification import Estimate
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.refutations import chance
from inputdesign_cli.tasks.build.data import Data

_FREQUENCIES = 60
_LEAST_FREQUENCY = 1e-3
# G that is zero up to chance, and one that these data rule out.
_ZERO, _OTHERWISE = 1e-3, 1e-6
# Directions of G that are smaller than this, and what the parameters may leave of it.
_DEPENDENT, _LEFT = 1e-8, 1e-4


def answering(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence for every input that answers outputs, or comes after their answer; none of a loop."""
    if units.closed_loop:
        return []
    ends = np.cumsum(data.lengths)[:-1]
    parts = list(zip(np.split(data.u, ends), np.split(data.y, ends), strict=True))
    errors = np.split(estimate.errors, ends)
    answers = [
        f"prediction errors help to tell {signal_name('u', j, units.inputs)} (probability "
        f"{chance(probability)}), and no input in open loop answers the noise: it was logged late, columns "
        "are swapped, or the data come from a loop; mend the columns, or state the loop as "
        "experiment.controller"
        for j, probability in answers_output(parts, errors)
    ]
    return answers or late_inputs(parts)


def late_inputs(parts: Sequence[tuple[Array, Array]]) -> list[str]:
    """A sentence for every input before which an output moves: u (n, r), y (n, p) of an open loop."""
    inputs, outputs = parts[0][0].shape[1], parts[0][1].shape[1]
    return [
        f"{signal_name('y', one.output, outputs)} answers {signal_name('u', one.input, inputs)} up to "
        f"{one.samples} {'sample' if one.samples == 1 else 'samples'} before that moves (probability "
        f"{chance(one.probability)} by chance): the input was logged late, or the columns are not of one "
        "clock. See when the plant really gets its input, and write both at the same times"
        for one in early_answers(parts)
    ]


def idle(units: Units, nominal: Model, estimated: Model, estimate: Estimate) -> list[str]:
    """A sentence for every input that explains nothing, though at the plant of the spec it would.

    Args:
        nominal, estimated: of one structure.
    """
    w = np.geomspace(_LEAST_FREQUENCY, 1.0, _FREQUENCIES) * np.pi / units.step
    with np.errstate(all="ignore"):
        gradient, now, before = estimated.plant_gradient(w), estimated.plant_at(w), nominal.plant_at(w)
    told = []
    for j in range(units.inputs):
        change = _stacked(gradient[:, :, :, j].swapaxes(0, 1))
        probability = _chance(estimate, change, _stacked(now[None, :, :, j])[0], wholly=True)
        if probability is None or probability < _ZERO:
            continue
        expected = _chance(estimate, change, _stacked((now - before)[None, :, :, j])[0], wholly=False)
        if expected is not None and expected < _OTHERWISE:
            told.append(
                f"{signal_name('u', j, units.inputs)} explains nothing of what was measured: G cannot be "
                f"told from zero (probability {chance(probability)}), and the plant of the spec can: see "
                "whether the columns are those of one experiment; if the plant does not answer, correct the "
                "spec"
            )
    return told


def hardly_explained(units: Units, model: Model, estimate: Estimate) -> list[str]:
    """A sentence for outputs that are farther from the simulation than from their mean, and why they are."""
    far = [i for i, fit in enumerate(estimate.fit) if fit is not None and fit < 0.0]
    untold = driven_by_nothing(model, estimate, units.step) if far else []
    sentences = (
        "the inputs explain nothing of {} in this model: see whether the columns are those of the plant, in "
        "their order and their units, before anything is built on it",
        "what the inputs cause in {} is seen, but noise and drift move it more: simulated from the inputs "
        "alone, the model is farther off than the mean",
    )
    told = []
    for sentence, listed in zip(
        sentences, ([i for i in far if i in untold], [i for i in far if i not in untold]), strict=True
    ):
        outputs = " and ".join("y" if len(estimate.noise) == 1 else f"y{i + 1}" for i in listed)
        told += [sentence.format(outputs)] if listed else []
    return told


def driven_by_nothing(model: Model, estimate: Estimate, step: float = 1.0) -> list[int]:
    """The outputs (from zero) of a model whose row of G cannot be told from zero.

    Args:
        step: between samples, in the unit of time of the model.
    """
    return _like_nothing(model, estimate, step, [(i, slice(None)) for i in range(model.outputs)])


def driving_nothing(model: Model, estimate: Estimate, step: float = 1.0) -> list[int]:
    """The inputs (from zero) of a model whose column of G cannot be told from zero."""
    return _like_nothing(model, estimate, step, [(slice(None), j) for j in range(model.inputs)])


def chance_of_response(model: Model, estimate: Estimate, other: Model, step: float = 1.0) -> float | None:
    """The probability, if an estimate is right but for chance, of a G as far from its own as another model's.

    None where G is infinite, or no step of the parameters changes it.
    """
    w = np.geomspace(_LEAST_FREQUENCY, 1.0, _FREQUENCIES) * np.pi / step
    with np.errstate(all="ignore"):
        gradient, away = model.plant_gradient(w), other.plant_at(w) - model.plant_at(w)
    change = _stacked(gradient.swapaxes(0, 1))
    return _chance(estimate, change, _stacked(away[None])[0], wholly=False)


def _like_nothing(
    model: Model, estimate: Estimate, step: float, parts: Sequence[tuple[int | slice, int | slice]]
) -> list[int]:
    """The numbers of the parts of G that cannot be told from zero, and are not known to be zero."""
    w = np.geomspace(_LEAST_FREQUENCY, 1.0, _FREQUENCIES) * np.pi / step
    with np.errstate(all="ignore"):
        gradient, G = model.plant_gradient(w), model.plant_at(w)
    found = []
    for number, (i, j) in enumerate(parts):
        change = _stacked(gradient[:, :, i, j].swapaxes(0, 1))
        probability = _chance(estimate, change, _stacked(G[None, :, i, j])[0], wholly=True)
        if np.any(change) and probability is not None and probability > _ZERO:
            found.append(number)
    return found


def _stacked(G: ComplexArray) -> Array:
    """(m, 2 n p): real and imaginary parts of values (m, n, p)."""
    flat = G.reshape(len(G), -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _chance(estimate: Estimate, change: Array, away: Array, *, wholly: bool) -> float | None:
    """The probability, if the estimate is right but for chance, of G that differs from it by `away` (m,).

    The statistic is that of Wald: the least that a step of the parameters takes to get there, as far as any
    does, `change` (k, m) being the gradient of G. None where none leads there `wholly`.
    """
    if not all(np.all(np.isfinite(x)) for x in (change, away)):
        return None
    J = scipy.linalg.solve_triangular(estimate.factor, change, lower=True)
    _, sizes, right = np.linalg.svd(J, full_matrices=False)
    kept = sizes > _DEPENDENT * np.max(sizes, initial=0.0)
    along = right[kept] @ away
    if wholly and np.linalg.norm(away - along @ right[kept]) > _LEFT * np.linalg.norm(away):
        return None
    return float(scipy.special.chdtrc(np.count_nonzero(kept), np.sum((along / sizes[kept]) ** 2)))
