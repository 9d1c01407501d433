"""Estimates by linear regression that need no start: ARX, and output-error models with one denominator.

The second are those of [steiglitz-mcbride-1965]; B, the level and the state at the start are eliminated
from the cost, which is that of the output error. Before a record the inputs are taken for what they are at
its beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.plant.filtering import filtered

_ITERATIONS = 8
_RIDGE = 1e-12
_CONFIDENCE = 0.95
_WIDTH = 6
# The order of an ARX model that makes noise white.
_WHITENING = 20
LONG = 6
"""Delays beyond this part of a record are long."""
_COARSE = (0, 1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48, 64, 85, 113, 150)


@dataclass(frozen=True)
class SharedDenominator:
    """y = sum_j (B_j / F) u_j + level + start: F (n + 1,), the loss (mean square of the output error).

    `slope` is that of a line beside these, a sample, where one was asked for.
    """

    F: Array
    delays: tuple[int, ...]
    loss: float
    slope: float = 0.0


def output_error(
    parts: Parts, n: int, b: int, delays: Sequence[int], *, line: bool = False
) -> SharedDenominator:
    """The estimate of one output, y (N, 1), with one denominator of order n for all inputs.

    Args:
        line: whether the output drifts along one, of the same slope in all records.
    """
    begun = _begun(parts)
    F, best, least, slope = np.array([1.0]), np.array([1.0]), np.inf, 0.0
    for _ in range(_ITERATIONS):
        blocks = []
        for u, y in begun:
            smooth = filtered([1.0], F, y)
            past = [-_lagged(smooth, lag) for lag in range(1, n + 1)]
            if line:
                past.append(filtered([1.0], F, _line(len(y))))
            blocks.append((np.stack([*past, *_caused(u, len(y), F, n, b, delays)], axis=1), smooth))
        solution = _solve(blocks, own=n + line + len(delays) * b)
        if not np.all(np.isfinite(solution)):
            break
        F = reflected(np.concatenate([[1.0], solution[:n]]))
        loss, rises = _loss(begun, F, n, b, delays, line)
        if loss < least * (1.0 - 1e-6):
            best, least, slope = F, loss, rises
        elif loss > 1.5 * least:
            break
    return SharedDenominator(best, tuple(delays), least, slope)


def _caused(u: Array, samples: int, F: Array, n: int, b: int, delays: Sequence[int]) -> Iterator[Array]:
    """Through 1/F: the delays of all inputs, a level, n impulses at the start, and steps where inputs arrive.

    Before a long delay acts what held before the record, which may differ from its first value.
    """
    for x, delay in zip(filtered([1.0], F, u, axis=0).T, delays, strict=True):
        yield from (_lagged(x, delay + lag) for lag in range(b))
    held = filtered([1.0], F, np.ones(samples))
    yield held
    impulse = filtered([1.0], F, np.eye(1, samples)[0])
    yield from (_lagged(impulse, lag) for lag in range(n))
    yield from (_lagged(held, delay) for delay in _long(delays, samples))


def _loss(
    parts: Sequence[tuple[Array, Array]], F: Array, n: int, b: int, delays: Sequence[int], line: bool
) -> tuple[float, float]:
    """Mean square of the output error at F, and the slope of the line."""
    left, samples = 0.0, 0
    explained, slope = _explained(parts, F, n, b, delays, line=line)
    for (_, y), (caused, begun) in zip(parts, explained, strict=True):
        left += float(np.sum((y - caused - begun) ** 2))
        samples += len(y)
    return left / samples if np.isfinite(left) else np.inf, slope


def _explained(
    parts: Sequence[tuple[Array, Array]],
    F: Array,
    n: int,
    b: int,
    delays: Sequence[int],
    *,
    line: bool = False,
) -> tuple[list[tuple[Array, Array]], float]:
    """Of each record (n,), by least squares at F: what inputs and line cause, and what level and start do.

    With it the slope of the line.
    """
    blocks = list[tuple[Array, Array]]()
    for u, y in parts:
        lined = [_line(len(y))] if line else []
        blocks.append((np.stack([*lined, *_caused(u, len(y), F, n, b, delays)], axis=1), y))
    own = line + len(delays) * b
    solution = _solve(blocks, own=own)
    found, offset = [], own
    for columns, _ in blocks:
        extra = columns.shape[1] - own
        begun = columns[:, own:] @ solution[offset : offset + extra]
        found.append((columns[:, :own] @ solution[:own], begun))
        offset += extra
    return found, float(solution[0]) if line else 0.0


def numerators(parts: Parts, shared: SharedDenominator, b: int) -> Array:
    """(r, b): B of every input at an estimate's F, by least squares."""
    own = len(shared.delays) * b
    blocks = [
        (np.stack([*_caused(u, len(y), shared.F, shared.F.size - 1, b, shared.delays)], axis=1), y)
        for u, y in _begun(parts)
    ]
    return _solve(blocks, own=own)[:own].reshape(-1, b)


def from_rest(parts: Parts, shared: SharedDenominator, b: int) -> list[tuple[Array, Array]]:
    """Records with inputs counted from their first values, and outputs (n, 1) without level and start.

    While inputs from before the record still act through a long delay, the output is what the estimate makes
    of the others: nobody knows what they were.
    """
    begun, rested = _begun(parts), []
    found, _ = _explained(begun, shared.F, shared.F.size - 1, b, shared.delays)
    for (u, y), (caused, start) in zip(begun, found, strict=True):
        late = max(_long(shared.delays, len(y)), default=0)
        rested.append((u, np.append(caused[:late], (y - start)[late:])[:, None]))
    return rested


def _long(delays: Sequence[int], samples: int) -> Iterator[int]:
    """Those that are much of so many samples, not all of them."""
    return (delay for delay in delays if samples // LONG < delay < samples)


def _line(samples: int) -> Array:
    return np.asarray(np.arange(samples) - 0.5 * (samples - 1))


def _begun(parts: Parts) -> list[tuple[Array, Array]]:
    return [(u - u[0], y[:, 0] - y[:, 0].mean()) for u, y in parts]


def _solve(blocks: Sequence[tuple[Array, Array]], *, own: int) -> Array:
    """Least squares; the first `own` columns are shared by the blocks, the others belong to each alone."""
    extra = [columns.shape[1] - own for columns, _ in blocks]
    size = own + sum(extra)
    gram, moment = np.zeros((size, size)), np.zeros(size)
    offset = own
    with np.errstate(over="ignore", invalid="ignore"):
        for (columns, y), more in zip(blocks, extra, strict=True):
            at = np.concatenate([np.arange(own), np.arange(offset, offset + more)])
            gram[np.ix_(at, at)] += columns.T @ columns
            moment[at] += columns.T @ y
            offset += more
    return normal_solution(gram, moment)


def normal_solution(gram: Array, moment: Array) -> Array:
    """Of normal equations, columns scaled; NaN where they overflow."""
    if not (np.all(np.isfinite(gram)) and np.all(np.isfinite(moment))):
        return np.full(moment.shape, np.nan)
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / np.outer(scale, scale) + _RIDGE * np.eye(len(scale))
    return np.asarray(np.linalg.solve(scaled, moment / scale) / scale)


def whitened(parts: Parts) -> list[tuple[Array, Array]]:
    """The records through what makes the noise of the output white: A of a long ARX model.

    The plant between them is the same. Output errors of these records are prediction errors of the others, so
    that their sum of squares is a likelihood, and tells the plant in a loop as well ([ljung-1999], Section
    13.4). The samples that A needs to begin are lost.
    """
    inputs = parts[0][0].shape[1]
    order = max(min(_WHITENING, sum(len(y) for _, y in parts) // (10 * (inputs + 1))), 1)
    long = [(u, y) for u, y in _begun(parts) if len(y) > 2 * order]
    blocks = []
    for u, y in long:
        columns = [_lagged(x, lag) for x in (y, *u.T) for lag in range(1, order + 1)]
        blocks.append((np.stack([*columns, np.ones(len(y))], axis=1)[order:], y[order:]))
    solution = _solve(blocks, own=order * (inputs + 1))
    if not blocks or not np.all(np.isfinite(solution)):
        return list(parts)
    A = np.concatenate([[1.0], -solution[:order]])
    return [(filtered(A, [1.0], u, axis=0)[order:], filtered(A, [1.0], y)[order:, None]) for u, y in long]


def best_delays(
    parts: Parts, n: int, b: int, most: int, begin: Sequence[int], least: Sequence[int] | None = None
) -> SharedDenominator:
    """The delays of all inputs with the least output error, one input after the other, twice round.

    The loss is looked at on a coarse set of delays first, and then near the best of them.

    Args:
        least, most: delays to look at, of each input from the one (none: zero) to the other.
    """
    lowest = tuple(least) if least is not None else (0,) * len(begin)
    best = output_error(parts, n, b, begin)
    for _ in range(2 if len(begin) > 1 else 1):
        for j in range(len(begin)):
            tried = {best.delays[j]}
            steps = [delay for delay in _COARSE if lowest[j] <= delay <= most]
            while steps:
                for delay in steps:
                    tried.add(delay)
                    delays = (*best.delays[:j], delay, *best.delays[j + 1 :])
                    found = output_error(parts, n, b, delays)
                    if found.loss < best.loss:
                        best = found
                at = best.delays[j]
                below = max((d for d in tried if d < at), default=lowest[j] - 1)
                above = min((d for d in tried if d > at), default=most + 1)
                steps = sorted({(below + at) // 2, (at + above + 1) // 2, at - 1, at + 1})
                steps = [d for d in steps if below < d < above and d != at and lowest[j] <= d <= most]
    return best


def delay_ranges(
    parts: Parts, n: int, delays: tuple[int, ...], least: tuple[int, ...], most: int
) -> tuple[tuple[int, int], ...]:
    """The delays that 95 % of confidence leaves at an order n.

    By the likelihood ratio, one input after the other, within a few samples of what was chosen.
    """
    samples, b = sum(len(y) for _, y in parts), max(n, 2)
    # Of few samples the likelihood ratio of one parameter is that of F, not yet chi-squared.
    free = max(samples - n - b * len(delays) - len(parts) * (n + 1), 1)
    limit = samples * np.log1p(scipy.special.fdtri(1, free, _CONFIDENCE) / free)
    found = []
    for j, chosen in enumerate(delays):
        near = [d for d in range(chosen - _WIDTH, chosen + _WIDTH + 1) if least[j] <= d <= most]
        losses = {d: output_error(parts, n, b, (*delays[:j], d, *delays[j + 1 :])).loss for d in near}
        smallest = min(losses.values(), default=0.0)
        kept = [d for d, loss in losses.items() if samples * np.log(loss / max(smallest, 1e-300)) <= limit]
        # Another structure than that of the quick estimate may have settled elsewhere.
        found.append((min(*kept, chosen), max(*kept, chosen)) if kept else (chosen, chosen))
    return tuple(found)


def arx_grid(
    parts: Parts, most: int, delays: Sequence[tuple[int, ...]]
) -> Iterator[tuple[int, int, tuple[int, ...], Array]]:
    """All ARX models with orders of A and B up to `most`: (a, b, delays, coefficients), y being (N, 1)."""
    for lags in delays:
        size = most * (len(lags) + 1) + 1
        gram, moment, rows = np.zeros((size, size)), np.zeros(size), 0
        first = most + max(lags)
        for u, y in parts:
            if len(y) <= first + 1:
                continue
            x, out = u - u.mean(axis=0), y[:, 0] - y[:, 0].mean()
            columns = [-_lagged(out, lag) for lag in range(1, most + 1)]
            for j, delay in enumerate(lags):
                columns += [_lagged(x[:, j], delay + lag) for lag in range(most)]
            block = np.stack([*columns, np.ones(len(out))], axis=1)[first:]
            gram, moment = gram + block.T @ block, moment + block.T @ out[first:]
            rows += len(block)
        if rows <= size:
            continue
        for a in range(1, most + 1):
            for b in range(1, most + 1):
                at = [*range(a)]
                for j in range(len(lags)):
                    at += range(most * (j + 1), most * (j + 1) + b)
                at.append(most * (len(lags) + 1))
                yield a, b, lags, normal_solution(gram[np.ix_(at, at)], moment[at])[:-1]


def _lagged(x: Array, lag: int) -> Array:
    return np.concatenate([np.zeros(min(lag, x.size)), x[: max(x.size - lag, 0)]])
