"""Whether inputs answer the outputs: the signs of a loop.

A reference moves in few steps, mostly, and an input in a loop with it moves a lot at these steps and little
between them. By least squares the steps hide what it answers. So samples at which an input jumps are also
left out, by least absolute deviations from what its own past tells; and what it does at the steps tells a
controller, which answers y(t) by u(t), from a plant that answers u(t) by y(t).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.busiest import busiest
from inputdesign_cli.explore.held import of_moves
from inputdesign_cli.explore.inputs import left_over, past, untold
from inputdesign_cli.explore.laws import TOGETHER, answers_between_moves, correlation_at_once, repeats_apart
from inputdesign_cli.explore.relays import told_by_levels
from inputdesign_cli.explore.switched import switched_by

_LAGS = 20
_CERTAIN = 1e-4
# Five tests share the level.
_TESTS = 5
# A jump is beyond so many robust standard deviations; an input of which its past leaves less than this share
# between its jumps does not move there.
_JUMP, _HELD = 4.0, 1e-6
_FEWEST_JUMPS = 4
# Least absolute deviations by weighted least squares: rounds, and the share of the scale below which errors
# weigh alike.
_ROUNDS, _SMOOTH = 15, 0.1
_TO_DEVIATION = 1.4826
# Of longer records the stretch in which the inputs move most tells jumps.
_MOST_SAMPLES = 4000
# A correlation from one sample to the next beyond which what is left of an input is no noise.
_PATTERN = 0.5
# Samples to a column, at least, where jumps are left out.
_PER_COLUMN = 3
Parts = Sequence[tuple[Array, Array]]


def answers_output(parts: Parts, innovations: Sequence[Array] | None = None) -> list[tuple[int, float]]:
    """Inputs that the noise of the outputs helps to predict, with the probability of that by chance.

    That hints of a loop. Each input is regressed on its own past and the other inputs', then on past
    innovations of the outputs as well ([ljung-1999], Section 13.4), with its jumps and without them. Not
    outputs but what is new in them: outputs remember inputs longer than the regression does, and so they
    would help to predict one that is held. A third test is that of an answer at once, see `_at_once`, a
    fourth and a fifth those of a relay, see `switched_by` and `told_by_levels`. An input that follows the
    outputs exactly between moves of a reference tells nothing new of itself, and is seen by that, see
    `answers_between_moves`. One that repeats while the outputs do not is never one: what a nonlinear plant
    adds at every period looks new in an output, and goes together with what is left of the input, see
    `repeats_apart`. Where inputs move at every k-th sample only, records of these samples are looked at, see
    `of_moves`: a regression takes the samples between for ones at which the input might have moved.

    Args:
        parts: records u (n, r), y (n, p).
        innovations: of the outputs of every part, (n, p), where a model tells them; else those of a
            regression on past inputs and outputs.
    """
    looks = of_moves(parts)
    if not looks:
        return _answers(parts, innovations)
    found = dict[int, float]()
    for j, probability in [answer for look in looks for answer in _answers(look, None)]:
        if len(looks) * probability < _CERTAIN and not repeats_apart(parts, j):
            found[j] = min(found.get(j, 1.0), len(looks) * probability)
    return sorted(found.items())


def _answers(parts: Parts, innovations: Sequence[Array] | None) -> list[tuple[int, float]]:
    """Of records as they are, see `answers_output`."""
    lags = _lags(parts, parts[0][1].shape[1])
    long = [len(y) > 3 * lags for _, y in parts]
    centred = [
        (u - u.mean(axis=0), y - y.mean(axis=0)) for (u, y), kept in zip(parts, long, strict=True) if kept
    ]
    if not centred:
        return []
    if innovations is None:
        new = _innovations(centred, lags)
    else:
        new = [e[lags:] for e, kept in zip(innovations, long, strict=True) if kept]
    # As far back as what is new in the outputs remembers inputs.
    own = np.concatenate([past(u, 2 * lags) for u, _ in centred])
    more = np.concatenate([past(e, lags) for e in new])
    targets = np.concatenate([u[2 * lags :] for u, _ in centred])
    brief = [(u, y) for u, y in busiest(centred, _MOST_SAMPLES) if len(y) > 3 * lags]
    found = []
    for j, target in enumerate(targets.T):
        if repeats_apart(parts, j):
            continue
        probability = min(
            _foretold(own, more, target),
            *_between_jumps(brief, lags, j),
            switched_by(brief, j),
            told_by_levels(brief, j),
        )
        if _TESTS * probability < _CERTAIN:
            found.append((j, _TESTS * probability))
    seen = {j for j, _ in found}
    return sorted([*found, *(law for law in answers_between_moves(centred) if law[0] not in seen)])


def _lags(parts: Parts, outputs: int) -> int:
    return max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (parts[0][0].shape[1] + outputs))), 1)


def _foretold(own: Array, more: Array, target: Array) -> float:
    """The probability that columns beside those of a regression (n, m) tell as much by chance.

    Both the test of the likelihood ratio and a score test whose covariance allows for errors of any size at
    any time ([white-1980]) must say so. An input that is held moves at few samples only; where the output
    follows at once, what is new there is large at the same samples, and the first test errs.
    """
    both = np.column_stack([own, more])
    left = [left_over(columns, target) for columns in (own, both)]
    if left[0] <= 1e-12 * float(np.sum(target**2)):
        return 1.0  # the input follows from its own past: a deterministic signal
    statistic = (len(target) - both.shape[1]) * np.log(left[0] / max(left[1], 1e-300))
    statistic = min(statistic, _score(own, more, target))
    return float(scipy.special.chdtrc(more.shape[1], statistic))


def _score(own: Array, more: Array, target: Array) -> float:
    """Of columns beside those of a regression, chi-squared where they tell nothing of its errors."""
    errors = _without(own, target)
    weighted = _without(own, more) * errors[:, None]
    total = weighted.sum(axis=0)
    return float(total @ np.linalg.lstsq(weighted.T @ weighted, total, rcond=1e-10)[0])


def _between_jumps(parts: Parts, lags: int, j: int) -> tuple[float, float]:
    """The probabilities that what is new in outputs neither foretells input j between its jumps nor moves it.

    One where it does not move there.
    """
    if not parts:
        return 1.0, 1.0
    new = _innovations(parts, lags)
    own, more = (
        np.concatenate(columns)
        for columns in ([past(u, 2 * lags) for u, _ in parts], [past(e, lags) for e in new])
    )
    target = np.concatenate([u[2 * lags :, j] for u, _ in parts])
    both = np.column_stack([own, more])
    still = _still(own, target)
    if still is None or np.sum(still) < _PER_COLUMN * both.shape[1] or _repeats(own, target, still):
        return 1.0, 1.0
    foretold = _foretold(own[still], more[still], target[still])
    still = _still(both, target)
    if still is None or np.sum(still) < _PER_COLUMN * both.shape[1]:
        return foretold, 1.0
    y = np.concatenate([y[2 * lags :] for _, y in parts])
    known = np.column_stack([own, np.concatenate([past(y, 2 * lags) for _, y in parts])])
    moved = target - both @ np.linalg.lstsq(both[still], target[still], rcond=1e-10)[0]
    fresh = y - known @ np.linalg.lstsq(known[still], y[still], rcond=1e-10)[0]
    return foretold, min(1.0, y.shape[1] * min(_at_once(moved, e, still) for e in fresh.T))


def _repeats(own: Array, target: Array, still: NDArray[np.bool_]) -> bool:
    """Whether what the past of an input leaves between its jumps is no noise: its values go together in time.

    Of an input that answers noise its past leaves what is new. Of a periodic one, or of one that is held, it
    leaves a pattern that comes with every jump, and so does what is left of the outputs that follow.
    """
    left = target - own @ np.linalg.lstsq(own[still], target[still], rcond=1e-10)[0]
    pairs = still[1:] & still[:-1]
    before, after = left[:-1][pairs], left[1:][pairs]
    return bool(abs(before @ after) > _PATTERN * np.sqrt((before @ before) * (after @ after)))


def _at_once(moved: Array, fresh: Array, still: NDArray[np.bool_]) -> float:
    """The probability that an input does not answer an output at once, by what is new in both (n,).

    Between its jumps the two go together, be it that a controller answers y(t) by u(t) or that the plant
    answers u(t) by y(t). The plant answers the jumps, too; a controller made them, or its reference, and the
    output of a plant with a delay knows nothing of them yet ([shimizu-2006]).
    """
    if np.sum(~still) < _FEWEST_JUMPS:
        return 1.0
    slopes, variances = [], []
    for at in (still, ~still):
        x, e = moved[at], fresh[at]
        slopes.append(float(x @ e) / max(float(x @ x), 1e-300))
        errors = e - slopes[-1] * x
        least = float(np.mean((fresh[still] - slopes[0] * moved[still]) ** 2)) / float(x @ x)
        variances.append(max(float(np.sum((x * errors) ** 2)) / float(x @ x) ** 2, least))
    between, of_jumps = slopes
    if abs(of_jumps) > 0.5 * abs(between):
        return 1.0
    statistic = min(between**2 / variances[0], (between - of_jumps) ** 2 / sum(variances))
    return float(scipy.special.chdtrc(1, statistic))


def _still(columns: Array, target: Array) -> NDArray[np.bool_] | None:
    """Where a regression by least absolute deviations finds no jump; None where nothing else is left."""
    size, weights = float(np.std(target)), np.ones(len(target))
    for _ in range(_ROUNDS):
        solution = np.linalg.lstsq(columns * weights[:, None], target * weights, rcond=1e-10)[0]
        errors = np.abs(target - columns @ solution)
        scale = _TO_DEVIATION * float(np.median(errors))
        if scale <= _HELD * size:
            return None
        weights = 1.0 / np.sqrt(np.maximum(errors / scale, _SMOOTH))
    return np.asarray(errors <= _JUMP * scale)


def acts_late(parts: Parts, gains: Array) -> list[bool]:
    """Of each input in a loop, whether a delay of the plant is to be taken for granted.

    Where a controller answers y(t) by u(t), what is new in the two goes together, and a model with a delay of
    zero takes the controller for the plant ([ljung-1999], Section 13.4). A controller that holds a plant
    opposes it: what goes together with the sign of the plant's gain is not of its making.

    Args:
        parts: u (n, r), y (n, 1).
        gains: (r,), of the plant, estimated with delays.
    """
    return [bool(x <= TOGETHER) for x in correlation_at_once(parts)[0] * np.sign(gains)]


def _innovations(parts: Parts, lags: int) -> list[Array]:
    """What past inputs and outputs do not tell of the outputs: (n - lags, p) of every part (n, ..)."""
    rows = [np.column_stack([past(u, lags), past(y, lags)]) for u, y in parts]
    return untold(rows, [y[lags:] for _, y in parts])


def _without(columns: Array, targets: Array) -> Array:
    """What a regression leaves."""
    return untold([columns], [targets])[0]
