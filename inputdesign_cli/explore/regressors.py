"""Regressions on the pasts of signals, and how well the inputs of a record excite a plant."""

from __future__ import annotations

import bisect
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.identification.checks import check_varying

_FEWEST = 30
_UNKNOWN = ("gain and dynamics",)
_FAINT = 1e-9
# The past of another input that an input may follow, and samples to a regressor, at least.
_PAST, _PER_LAG = 20, 10


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
    _check_length(len(y), _FEWEST)
    still = tuple(int(j) for j in np.flatnonzero(np.ptp(u, axis=0) <= 1e-12 * np.abs(u).max(axis=0)))
    moving = [j for j in range(u.shape[1]) if j not in still]
    check_varying(_UNKNOWN, u[:, moving] if moving else u, y)
    _check_length(len(y), _FEWEST * (len(moving) + 1) // 2)
    return still, [(part_u[:, moving], part_y) for part_u, part_y in parts]


def _check_length(samples: int, needed: int) -> None:
    """Raise `SpecError` (`too-few-samples`) if there are fewer samples than needed."""
    if samples < needed:
        are = "1 sample is" if samples == 1 else f"{samples} samples are"
        raise bad_spec(
            "too-few-samples",
            f"{are} too few to choose a structure and to judge it: take {needed} at least",
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
    most = max(min(most, len(x) // (3 * x.shape[1])), 1)

    def dependent(delays: int) -> bool:
        columns = np.hstack([x[delays - lag : len(x) - lag] for lag in range(delays)])
        columns = columns - columns.mean(axis=0)
        gram = columns.T @ columns
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        return bool(np.linalg.eigvalsh(gram / np.outer(scale, scale))[0] <= _FAINT * delays)

    # Rows of few delays include all rows of more: a step may stand there.
    if not dependent(most):
        return most
    return bisect.bisect_left(range(1, most), True, key=dependent)


def left_of_inputs(parts: Parts) -> list[float]:
    """Return the share of each input's power that the other inputs and their pasts do not explain."""
    inputs, samples = parts[0][0].shape[1], sum(len(u) for u, _ in parts)
    lags = min(_PAST, samples // (_PER_LAG * inputs))
    long = [u - u.mean(axis=0) for u, _ in parts if len(u) > 3 * lags]
    if inputs < 2 or lags < 1 or not long:
        return [1.0] * inputs
    found = []
    for j in range(inputs):
        others, own = [np.delete(u, j, axis=1) for u in long], [u[lags:, j] for u in long]
        left = residuals([np.column_stack([other[lags:], past(other, lags)]) for other in others], own)
        found.append(sum(float(e @ e) for e in left) / max(sum(float(x @ x) for x in own), 1e-300))
    return found
