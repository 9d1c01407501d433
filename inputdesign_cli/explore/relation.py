"""Regressions without a model: do inputs excite a plant, move the outputs, depend on them; is it unstable?

Past innovations of the outputs help to predict an input in a loop only ([ljung-1999], Section 13.4). Two
signals that wander, drift, or follow one cycle agree for long though neither moves the other
([granger-newbold-1974]). The innovations of the output then do not depend on the input.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.explore.fits import Parts, output_error_form
from inputdesign_cli.identification.checks import check_noisy, check_varying
from inputdesign_cli.plant import Model

_LAGS, _PER_LAG, _PER_INPUT = 20, 12, 10  # the most lags; samples per lag, and per lag and input
# Significance levels: an input depends on outputs; an input helps to predict an output.
_CERTAIN, _HELPS = 1e-4, 1e-3
# An input follows from outputs and its own past if they leave less than this share of its power.
_FOLLOWS = 1e-9
# Innovations of u and y depend on each other beyond this correlation.
_TOGETHER = 0.1
# A jump is this multiple of an input's median innovation. Fewer jumps do not show their own scatter; the
# other samples are as many per lag at least.
_JUMP, _FEWEST = 6.0, 5
# The gain of -2 log likelihood by chance in a choice among some thousands of structures and delays.
_BY_CHOICE = 25.0
_HIGHEST = 5  # the highest order of an ARX model
# Standard deviations beyond the circle, and the step, in deviations, for the derivative of a pole.
_BEYOND, _STEP = 5.0, 0.01
# A mode that grows by a smaller factor over the whole record may be drift, or several integrators.
_GROWN = 1e4
_DEPENDENT = 1e-9
# The fewest samples to choose a structure. The least squared singular value, per delay, of exciting inputs.
_FEWEST_SAMPLES, _INDEPENDENT = 30, 1e-9
_UNKNOWN = ("gain and dynamics",)


def answers_output(parts: Parts) -> list[tuple[int, float]]:
    """Return the inputs u (n, r) that answer outputs y (n, p), with the probability of that by chance.

    Each input is regressed on its own past and the other inputs', then on past innovations of the outputs as
    well. An input that follows exactly from outputs and its own past is the output of a controller, too.
    """
    lags = _lags(parts)
    kept = _centred(parts, 3 * lags)
    if not kept:
        return []
    own = np.concatenate([past(u, 2 * lags) for u, _ in kept])
    more = np.concatenate([past(e, lags) for e in _innovations(kept, lags)[1]])
    targets = np.concatenate([u[2 * lags :] for u, _ in kept])
    laws, at_once = only_answers(parts), _moved_at_once(kept, lags)
    chances = [
        0.0 if j in laws else min(_by_chance(own, more, x), at_once[j]) for j, x in enumerate(targets.T)
    ]
    return [(j, probability) for j, probability in enumerate(chances) if probability < _CERTAIN]


def check_unpredictable(parts: Parts) -> None:
    """Check that past outputs and inputs, a level and a line do not predict an output to the last digit.

    Raises:
        SpecError: `noise-free-data`.
    """
    signals = _lagged([part for part in parts if np.ptp(part[1])], _lags(parts))
    if signals is None or sum(len(y) for _, y in parts) < _FEWEST_SAMPLES:
        return
    _, y, past_u, past_y = signals
    line = np.column_stack([np.ones(len(y)), np.linspace(-1.0, 1.0, len(y))])
    (errors,) = residuals([np.column_stack([past_y, past_u, line])], [y])
    check_noisy(np.diag(np.mean(errors**2, axis=0)), y)


def only_answers(parts: Parts) -> list[int]:
    """Return the inputs that are an exact linear function of present and past outputs and of past inputs.

    Inputs that follow from past inputs alone are not among them.
    """
    signals = _lagged(parts, min(_lags(parts), 5))
    if signals is None:
        return []
    u, y, own, past_y = signals
    every, powers = np.column_stack([own, y, past_y]), np.sum(u**2, axis=0)
    return [
        j
        for j, (x, power) in enumerate(zip(u.T, powers.tolist(), strict=True))
        if power > 0.0 and _rss(own, x) > 1e-3 * power and _rss(every, x) <= _FOLLOWS * power
    ]


def autoregression(parts: Parts) -> Array:
    """Return A (m,) of a long ARX model of one output y (n, 1), which a loop does not bias.

    It whitens the noise without a model of the plant ([ljung-1999], Section 13.4).
    """
    lags = _lags(parts)
    signals = _lagged(parts, lags)
    if signals is None:
        return np.ones(1)
    _, y, past_u, past_y = signals
    solution = np.linalg.lstsq(np.column_stack([past_y, past_u]), y[:, 0], rcond=1e-10)[0]
    return np.append(1.0, -solution[:lags])


def _moved_at_once(parts: Parts, lags: int) -> list[float]:
    """Return for each input the probability, by chance, that it answers y(t) between jumps of its own.

    Between two steps of its reference, a controller moves u by present innovations of y, beside their pasts.
    If y depended on u at once instead, innovations at the jumps would have the same ratio.
    """
    new_u, new_y = (np.concatenate(new) for new in _innovations(parts, lags))
    found = []
    for x in new_u.T:
        jumps, chance = np.abs(x) > _JUMP * np.median(np.abs(x)), 1.0
        for e in new_y.T if np.any(jumps) and np.sum(~jumps) >= lags * _FEWEST else ():
            least = float(np.std(e[~jumps])) if np.sum(jumps) < _FEWEST else 0.0
            (small, own), (large, other) = _slope(x[~jumps], e[~jumps]), _slope(x[jumps], e[jumps], least)
            apart = min(abs(small) / own, abs(small - large) / np.hypot(own, other))
            chance = min(chance, float(scipy.special.erfc(apart / np.sqrt(2.0))))
        found.append(chance)
    return found


def _slope(x: Array, y: Array, least: float = 0.0) -> tuple[float, float]:
    """Return the slope of y (n,) over x (n,), and its deviation if errors deviate by `least` at least."""
    power = max(float(x @ x), 1e-300)
    slope = float(x @ y) / power
    return slope, max(float(np.std(y - slope * x)), least, 1e-150) / np.sqrt(power)


def like_answers(parts: Parts, output: int, j: int) -> bool:
    """Return whether u(t) may depend on y(t): both have simultaneous innovations, and u is not prescribed.

    An input that is held, white, or follows from its own past was prescribed independently of the output.
    """
    moves = np.concatenate([np.diff(u[:, j]) != 0.0 for u, _ in parts])
    lags = _lags(parts)
    long = _centred(parts, 3 * lags)
    if not long or np.mean(moves) < 0.5:
        return False
    new_u, new_y = (np.concatenate(new) for new in _innovations(long, lags))
    size = float(np.linalg.norm(new_u[:, j]) * np.linalg.norm(new_y[:, output]))
    lagged = np.concatenate([past(u[:, j : j + 1], 5) for u, _ in long])
    now = np.concatenate([u[5:, j] for u, _ in long])
    own = _rss(lagged, now) <= 1e-6 * float(now @ now)
    white = _by_chance(np.ones((len(now), 1)), lagged, now) > 0.01
    return abs(float(new_u[:, j] @ new_y[:, output])) > _TOGETHER * max(size, 1e-300) and not (own or white)


def _by_chance(own: Array, more: Array, target: Array) -> float:
    """Return the probability that columns `more` explain as much by chance beside `own` (n, m).

    The smaller of likelihood ratio and score statistic counts, since a held target moves at few samples only.
    The covariance of the score allows for errors whose variance changes with time ([white-1980]).
    """
    both = np.column_stack([own, more])
    alone, together = _rss(own, target), _rss(both, target)
    if alone <= 1e-12 * float(target @ target) or len(target) <= both.shape[1]:
        return 1.0  # the input follows from its own past: a deterministic signal
    ratio = (len(target) - both.shape[1]) * float(np.log(alone / max(together, 1e-300)))
    (errors,), (rest,) = residuals([own], [target]), residuals([own], [more])
    weighted = rest * errors[:, None]
    total = weighted.sum(axis=0)
    score = float(total @ np.linalg.lstsq(weighted.T @ weighted, total, rcond=1e-10)[0])
    return float(scipy.special.chdtrc(more.shape[1], min(ratio, score)))


def _rss(*regression: Array) -> float:
    """Return the sum of squares of the residual of a target (n,) regressed on columns (n, m)."""
    (errors,) = residuals(*([one] for one in regression))
    return float(errors @ errors)


def _lags(parts: Parts) -> int:
    channels = parts[0][0].shape[1] + parts[0][1].shape[1]
    return max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * channels)), 1)


def _centred(parts: Parts, shortest: int) -> list[tuple[Array, Array]]:
    """Return the records of more than `shortest` samples, about their means."""
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts if len(y) > shortest]


def _lagged(parts: Parts, lags: int) -> tuple[Array, Array, Array, Array] | None:
    """Return inputs and outputs of all records about their means, and their pasts; None for short records."""
    kept = _centred(parts, 3 * lags)
    if not kept:
        return None
    now = [np.concatenate([part[k][lags:] for part in kept]) for k in (0, 1)]
    before = [np.concatenate([past(part[k], lags) for part in kept]) for k in (0, 1)]
    return now[0], now[1], before[0], before[1]


def _innovations(parts: Parts, lags: int) -> tuple[list[Array], list[Array]]:
    """Return the residuals of inputs and outputs regressed on their pasts, (n - lags, ..) each."""
    rows = [np.column_stack([past(u, lags), past(y, lags)]) for u, y in parts]
    return residuals(rows, [u[lags:] for u, _ in parts]), residuals(rows, [y[lags:] for _, y in parts])


def unhelpful(model: Model, parts: Parts) -> list[int]:
    """Return the outputs (from zero) whose prediction the simulated effect of the inputs does not improve.

    An output is predicted from its own past, a level and a line, with and without the simulation of the model
    (F test). Without a further parameter, the error of the simulation is predicted from its own past as well.
    """
    lags = min(_LAGS, sum(len(y) for _, y in parts) // _PER_LAG)
    long = [part for part in parts if len(part[1]) > 3 * lags]
    if lags < 1 or not long:
        return []
    form = output_error_form(model)
    with np.errstate(over="ignore", invalid="ignore"):
        caused = [form.simulate(u - u.mean(axis=0), np.zeros(y.shape), 1.0)[0] for u, y in long]
    if not all(np.all(np.isfinite(x)) for x in caused):
        return []
    signals = [(y, x, y - x) for (_, y), x in zip(long, caused, strict=True)]
    return [i for i in range(model.outputs) if _idle([[x[:, [i]] for x in one] for one in signals], lags)]


def _idle(signals: Sequence[Sequence[Array]], lags: int) -> bool:
    """Return whether x (n, 1) does not help to predict y (n, 1), nor y - x itself: records y, x, y - x."""
    levels = [np.column_stack([np.ones(len(y)), np.linspace(-1.0, 1.0, len(y))])[lags:] for y, *_ in signals]
    pasts = [np.concatenate([past(one[k], lags) for one in signals]) for k in range(3)]
    y, x, rest = (np.concatenate([one[k][lags:] for one in signals]) for k in range(3))
    own = np.column_stack([np.concatenate(levels), pasts[0]])
    more = np.column_stack([own, x, pasts[1]])
    errors = np.column_stack([np.concatenate(levels), pasts[2]])
    alone, along, simulated = (
        max(_rss(rows, target[:, 0]), 1e-300) for rows, target in ((own, y), (more, y), (errors, rest))
    )
    free = y.size - more.shape[1]
    statistic = (alone - along) / (lags + 1) / (along / max(free, 1))
    unlikely = scipy.special.fdtrc(lags + 1, max(free, 1), max(statistic, 0.0)) > _HELPS
    return bool(free > 0 and unlikely and y.size * np.log(simulated / alone) > -_BY_CHOICE)


def past(signal: Array, lags: int) -> Array:
    """Return the `lags` samples before each sample of a signal (n, channels): (n - lags, lags channels)."""
    shifted = [signal[lags - lag : len(signal) - lag] for lag in range(1, lags + 1)]
    return np.stack(shifted, axis=1).reshape(len(signal) - lags, -1) if lags else np.zeros((len(signal), 0))


def residuals(rows: Sequence[Array], targets: Sequence[Array]) -> list[Array]:
    """Return the residuals of a regression of targets (n,) or (n, p) on (n, m), all parts together."""
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=1e-10)[0]
    return [target - own @ solution for own, target in zip(rows, targets, strict=True)]


def moving_in(parts: Parts) -> tuple[tuple[int, ...], list[tuple[Array, Array]]]:
    """Return the inputs that never move, and the records without them.

    Raises:
        SpecError: `too-few-samples`, `constant-input` or `constant-output`.
    """
    u, y = (np.concatenate(signals) for signals in zip(*parts, strict=True))
    rest = np.ptp(u, axis=0) <= 1e-12 * np.abs(u).max(axis=0) if len(u) else []
    still = tuple(int(j) for j in np.flatnonzero(rest))
    moving = [j for j in range(u.shape[1]) if j not in still]
    for needed in (_FEWEST_SAMPLES, _FEWEST_SAMPLES * (len(moving) + 1) // 2):
        check_enough(y, needed)
        check_varying(_UNKNOWN, u[:, moving] if moving else u, y)
    return still, [(part_u[:, moving], part_y) for part_u, part_y in parts]


def check_enough(y: Array, needed: int = _FEWEST_SAMPLES) -> None:
    """Check that outputs y (n, p) have samples to judge a model; raise `SpecError` (`too-few-samples`)."""
    if len(y) < needed:
        are = "1 sample is" if len(y) == 1 else f"{len(y)} samples are"
        raise bad_spec(
            "too-few-samples",
            f"{are} too few to choose a structure or to judge one: take {needed} at least",
            hint="record more; or identify a structure that you know: idesign identify DATA --spec SPEC",
            key="u",
        )


def order_of_excitation(parts: Parts, most: int = 50) -> int:
    """Return the order to which all inputs together are persistently exciting, `most` at most.

    It is the largest n for which n delays of every input, and a level, are linearly independent
    ([ljung-1999], Section 13.2). A sinusoid over a part of a period has a mean, which counts as a level.
    """
    longest = max((u for u, _ in parts), key=len)
    x = longest - longest.mean(axis=0)
    for delays in range(max(min(most, len(x) // (3 * x.shape[1])), 1), 1, -1):
        columns = np.hstack([x[delays - lag : len(x) - lag] for lag in range(delays)])
        columns = columns - columns.mean(axis=0)
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-150)
        if np.linalg.svd(columns / scale, compute_uv=False)[-1] ** 2 > _INDEPENDENT * delays:
            return delays
    return 1


def left_of_inputs(parts: Parts) -> list[float]:
    """Return the share of each input's power that the other inputs and their pasts do not explain."""
    inputs, samples = parts[0][0].shape[1], sum(len(u) for u, _ in parts)
    lags = min(_LAGS, samples // (_PER_INPUT * inputs))
    kept = [u for u, _ in _centred(parts, 3 * lags)]
    if inputs < 2 or lags < 1 or not kept:
        return [1.0] * inputs
    every = np.concatenate(
        [np.stack([u[lags - k : len(u) - k] for k in range(lags + 1)]) for u in kept], axis=1
    )
    power = np.maximum(np.sum(every[0] ** 2, axis=0), 1e-300)
    others = [np.concatenate(np.delete(every, j, axis=2), axis=1) for j in range(inputs)]
    return [_rss(other, every[0][:, j]) / power[j] for j, other in enumerate(others)]


def unstable_pole(parts: Parts, output: int) -> tuple[complex, float] | None:
    """Return the unstable pole of one output y (n, p), and the deviation of its radius; None: it is stable.

    BIC chooses the order. A loop that stabilises an unstable plant excites it, and the predictor of an ARX
    model is stable wherever its poles are ([ljung-1999], Section 13.4).
    """
    long = [(u, y[:, output : output + 1]) for u, y in _centred(parts, 4 * _HIGHEST)]
    best, found = np.inf, None
    for n in range(1, _HIGHEST + 1) if long else ():
        rows = [np.column_stack([past(y, n), past(u, n)])[_HIGHEST - n :] for u, y in long]
        columns, target = np.concatenate(rows), np.concatenate([y[_HIGHEST:, 0] for _, y in long])
        left, sizes, right = np.linalg.svd(columns, full_matrices=False)
        if sizes[-1] <= _DEPENDENT * sizes[0] or len(target) <= 2 * sizes.size:
            continue
        theta = (target @ left / sizes) @ right
        variance = max(float(np.mean((target - columns @ theta) ** 2)), 1e-300)
        criterion = np.log(variance) + theta.size * np.log(len(target)) / len(target)
        if criterion < best:
            best, pole = criterion, _farthest(theta[:n])
            spread = np.sqrt(variance) * right / sizes[:, None]
            moved = [abs(_farthest((theta + _STEP * way)[:n])) - abs(pole) for way in spread]
            found = pole, float(np.linalg.norm(moved)) / _STEP
    if found is None:
        return None
    samples = sum(len(y) for _, y in long)
    beyond = max(1.0 + _BEYOND * found[1], _GROWN ** (1.0 / samples))
    return found if abs(found[0]) > beyond else None


def _farthest(regressed: Array) -> complex:
    """Return the pole farthest from the origin of y(t) = sum_k a_k y(t - k)."""
    roots = np.roots(np.concatenate([[1.0], -regressed]))
    return complex(roots[np.argmax(np.abs(roots))])
