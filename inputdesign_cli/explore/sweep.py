"""Choose delays and orders by linear regressions: output errors with one denominator for all inputs.

The regressions follow [steiglitz-mcbride-1965]. The products of all lags of y and u, through 1/F, give
the errors of every delay at once. Levels, drift and the state at the start of each record are projected out.
Before a record the inputs count as constant at their first values.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.identification.polynomial_starts import noise_polynomials
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.identification.white import Whitening
from inputdesign_cli.plant.filtering import filtered

_WIDE, _ROUNDS, _POLISH, _BESIDE = 3, 8, 3, 5  # wide sweeps; rounds for F, and per near delay; near delays
_RIDGE = 1e-12
# The rounds have settled if no coefficient of F changes by more.
_SETTLED = 1e-6
# A sweep ends after this number of successive orders that BIC does not prefer.
_WORSE = 2
# The longest delay that is tried: in samples, and the longest record divided by _SHARE, or first by _LONG.
_MOST_DELAY, _SHARE, _LONG = 300, 2, 6
_CONFIDENCE = 0.95
# A root that decays by fewer time constants within a record may as well integrate.
_FADES = 8.0
_MOST_NOISE = 2  # the highest order of C and D


@dataclass(frozen=True)
class Regression:
    """Holds a regression y = sum_j (B_j / F) u_j + level + start.

    Attributes:
        F: (n + 1,).
        B: (r, n + 1), from the lags `delays` (r,) on.
        loss: mean square of the output error.
        slope: the slope per sample of a line, if one was asked for.
    """

    F: Array
    B: Array
    delays: tuple[int, ...]
    loss: float
    slope: float = 0.0

    @property
    def order(self) -> int:
        """Return the number of poles."""
        return self.F.size - 1

    def criterion(self, samples: int) -> float:
        """Return BIC over the number of samples, delays counted."""
        size = self.order + self.B.size + len(self.delays)
        return float(np.log(max(self.loss, 1e-300)) + size * np.log(samples) / samples)


@dataclass(frozen=True)
class Sweep:
    """Holds the best regression of every order.

    Attributes:
        most: the longest delay that was tried.
        longest, samples: the length of the longest record, and of all.
    """

    by_order: dict[int, Regression]
    most: int
    longest: int
    samples: int

    @property
    def best(self) -> Regression:
        """Return the regression with the lowest BIC among all with the fewest integrating poles.

        Wandering noise looks like the free response of integrators.
        """
        return min(
            self.by_order.values(),
            key=lambda one: (lingering(one.F, self.longest), one.criterion(self.samples)),
        )

    def near(self, order: int) -> Regression:
        """Return the regression of that order, or of the nearest."""
        return self.by_order[min(max(order, 1), max(self.by_order))]


def sweep(parts: Parts, highest: int, *, least: int = 0, line: bool = False) -> Sweep:
    """Return regressions of one output y (n, 1) of all orders up to `highest`, delays of `least` or more.

    With a `line` the output drifts along one line through all records.
    """
    longest, inputs = max(len(y) for _, y in parts), parts[0][0].shape[1]
    samples, most = sum(len(y) for _, y in parts), max(min(_MOST_DELAY, longest // _SHARE), 1)
    begin, found, price = (max(least, 1),) * inputs, dict[int, Regression](), list[float]()
    for n in range(1, highest + 1):
        # Inputs before a record act during a delay: short delays use all samples, long ones skip the first.
        short = (min(longest // _LONG, most), 0)
        wide: dict[int, list[tuple[int, int] | None]] = {1: [short, (most, most)], 2: [short, None]}
        denominators = [np.ones(1), *(found[k].F for k in [n - 1] if k)]
        regressed = Regressed(parts, n, line)
        tried = [regressed.settled(begin, way, F, least) for F in denominators for way in wide.get(n, [None])]
        found[n] = min(tried, key=lambda one: one.loss)
        begin, price = found[n].delays, [*price, found[n].criterion(samples)]
        if len(price) - 1 - int(np.argmin(price)) == _WORSE:
            break
    for n in range(len(found) - 1, 0, -1):
        # Delays of a higher order are right where fewer poles led the wide sweep astray.
        if found[n].delays != (delays := found[n + 1].delays):
            other = Regressed(parts, n, line).settled(delays, None, np.ones(1), least)
            found[n] = min(found[n], other, key=lambda one: one.loss)
    return Sweep(found, most, longest, samples)


@dataclass(frozen=True)
class Regressed:
    """Computes regressions of order n of one output y (n, 1) of all records, which may drift along a line."""

    parts: Parts
    n: int
    line: bool = False

    def settled(
        self, delays: tuple[int, ...], way: tuple[int, int] | None, F: Array, least: int
    ) -> Regression:
        """Return a model, its delays of `least` or more from a wide range first, then from nearby ones.

        Args:
            way: the longest delay of the wide range, and the samples to leave out; None: no wide range.
            F: where the search begins.
        """
        for _ in range(_WIDE if way else 0):
            most, skipped = way or (0, 0)
            for j in range(len(delays)):
                losses = self.losses(F, delays, j, (least, max(most, least + 1)), skipped)
                best_delay = least + int(np.argmin(losses)) if np.any(losses) else delays[j]
                delays = (*delays[:j], best_delay, *delays[j + 1 :])
            F = self._denominator(F, delays)
        best = self.output_error(delays, F)
        for j, step in itertools.product(range(len(delays)), (1, -1)):
            at, misses, tried = best.delays[j] + step, 0, 0
            while least <= at and misses < 2 and tried < _BESIDE:
                other = (*best.delays[:j], at, *best.delays[j + 1 :])
                new = self.output_error(other, best.F, _POLISH)
                misses, tried = (0 if new.loss < best.loss else misses + 1), tried + 1
                best = min(best, new, key=lambda one: one.loss)
                at += step
        return best

    def output_error(
        self, delays: Sequence[int], F: Array | None = None, rounds: int = _ROUNDS
    ) -> Regression:
        """Return the model with given delays, the search begun from F (one: an ARX model)."""
        F = np.ones(1) if F is None else F
        best = self._at(F, delays)
        for _ in range(rounds):
            F, before = self._denominator(F, delays), F
            new = self._at(F, delays)
            if new.loss < best.loss * (1.0 - 1e-6) or best.order != self.n:
                best = new
            elif not new.loss < 1.5 * best.loss or np.abs(F - before).max() < _SETTLED:
                break
        return best

    def errors(self, model: Regression) -> list[Array]:
        """Return the output errors (n,) of every record, level, drift and start projected out."""
        near = self._near(model.delays)
        solution, _ = _solved(self._products(model.F, near, through=False))
        blocks = self._blocks(model.F, near, through=False)
        return [block[:, -1] - block[:, :-1] @ solution for block in blocks]

    def _near(self, delays: Sequence[int]) -> list[tuple[int, int]]:
        """Return for each input the first lag of B, and one past its last, at given delays."""
        return [(delay, delay + self.n + 1) for delay in delays]

    def _blocks(
        self, F: Array, ranges: Sequence[tuple[int, int]], *, through: bool, skipped: int = 0
    ) -> Iterator[Array]:
        """Yield for every record the columns and the target (n, m + 1), its own unknowns projected out.

        Args:
            ranges: the first lag of each input, and the one after the last.
            through: whether lags of y stand among the columns, all signals through 1/F; else y is as it is.
            skipped: samples of each record that are left out.
        """
        total, begin, n = sum(len(y) for _, y in self.parts), 0, self.n
        for u, y in self.parts:
            samples = len(y)
            drift = (begin + np.arange(samples)) / total - 0.5
            begin += samples
            raw = np.stack(
                [y[:, 0] - y[:, 0].mean(), drift, np.ones(samples), np.eye(1, samples)[0], *(u - u[0]).T]
            )
            smooth, sloped, held, impulse, *inputs = filtered([1.0], F, raw)
            arrived = held
            if not through:
                smooth, sloped, held = raw[:3]
            columns = [-shifted(smooth, lag, [samples]) for lag in range(1, n + 1)] if through else []
            columns += [sloped] if self.line else []
            for x, (low, high) in zip(inputs, ranges, strict=True):
                columns += [shifted(x, lag, [samples]) for lag in range(low, high)]
            own = [held, *(shifted(impulse, lag, [samples]) for lag in range(n))]
            # During a long delay the input before the record acts, which may differ from its first value.
            late = (low for low, high in ranges if samples // _LONG < low < samples and high - low <= n + 2)
            own += [shifted(arrived, low, [samples]) for low in late]
            unknown, _ = np.linalg.qr(np.stack(own, axis=1)[skipped:])
            both = np.column_stack([*columns, smooth])[skipped:]
            yield both - unknown @ (unknown.T @ both)

    def _products(
        self, F: Array, ranges: Sequence[tuple[int, int]], *, through: bool, skipped: int = 0
    ) -> Array:
        """Return the products (m + 1, m + 1) of columns and target, of all records."""
        with np.errstate(all="ignore"):
            blocks = self._blocks(F, ranges, through=through, skipped=skipped)
            return np.asarray(sum(block.T @ block for block in blocks))

    def _denominator(self, F: Array, delays: Sequence[int]) -> Array:
        """Return the next F, mirrored into the circle."""
        solution, _ = _solved(self._products(F, self._near(delays), through=True))
        usable = np.all(np.isfinite(solution))
        return reflected(np.concatenate([[1.0], solution[: self.n]])) if usable else F

    def _at(self, F: Array, delays: Sequence[int]) -> Regression:
        """Return the model whose denominator is F: B, line, levels and starts by least squares."""
        samples = sum(len(y) for _, y in self.parts)
        solution, left = _solved(self._products(F, self._near(delays), through=False))
        slope = float(solution[0]) / samples if self.line else 0.0
        loss = left / samples if np.isfinite(left) else np.inf
        B = solution[int(self.line) :].reshape(len(delays), self.n + 1)
        return Regression(F, B, tuple(delays), loss, slope)

    def losses(
        self, F: Array, delays: Sequence[int], j: int, reach: tuple[int, int], skipped: int = 0
    ) -> Array:
        """Return the sums of squares (high - low + 1,) of residuals for each delay of input j in `reach`.

        The other delays stay fixed, and `skipped` samples are left out. All are zero if not computable.
        """
        b, (low, high), ranges = self.n + 1, reach, self._near(delays)
        ranges[j] = (low, high + b)
        long = [part for part in self.parts if len(part[1]) > skipped + 4 * b]
        gram = replace(self, parts=long)._products(F, ranges, through=True, skipped=skipped)
        if not long or not np.all(np.isfinite(gram)):
            return np.zeros(high - low + 1)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        gram = gram / np.outer(scale, scale)
        begin = self.n + self.line + sum(last - first for first, last in ranges[:j])
        wide = np.arange(begin, begin + high + b - low)
        fixed = np.setdiff1d(np.arange(len(gram) - 1), wide)
        rest = np.append(wide, len(gram) - 1)
        across = gram[np.ix_(fixed, rest)]
        known = gram[np.ix_(fixed, fixed)] + _RIDGE * np.eye(len(fixed))
        left = gram[np.ix_(rest, rest)] - across.T @ np.linalg.solve(known, across)
        at = np.arange(high - low + 1)[:, None] + np.arange(b)
        squares = left[at[:, :, None], at[:, None, :]] + _RIDGE * np.eye(b)
        moments = left[at, -1]
        gains = np.sum(moments * np.linalg.solve(squares, moments[:, :, None])[:, :, 0], axis=1)
        return np.asarray(left[-1, -1] - gains)


def _solved(gram: Array) -> tuple[Array, float]:
    """Return the least squares from products of columns and target, and the remaining sum of squares."""
    size = len(gram) - 1
    if not np.all(np.isfinite(gram)):
        return np.full(size, np.nan), np.inf
    scale = np.sqrt(np.maximum(np.diag(gram)[:size], 1e-300))
    scaled = gram[:size, :size] / np.outer(scale, scale) + _RIDGE * np.eye(size)
    solution = np.linalg.solve(scaled, gram[:size, size] / scale) / scale
    left = gram[size, size] - 2.0 * solution @ gram[:size, size] + solution @ gram[:size, :size] @ solution
    return solution, max(float(left), 0.0)


def delay_ranges(parts: Parts, model: Regression, *, least: int, most: int) -> tuple[tuple[int, int], ...]:
    """Return the 95 % confidence interval of each delay by the likelihood ratio, its estimate included."""
    samples, found = sum(len(y) for _, y in parts), []
    limit = scipy.special.chdtri(1, 1.0 - _CONFIDENCE)
    for j, own in enumerate(model.delays):
        low, high = max(own - _BESIDE, least), max(min(own + _BESIDE, most), least)
        losses = Regressed(parts, model.order).losses(model.F, model.delays, j, (low, high))
        losses = np.maximum(losses, 1e-300)
        within = low + np.flatnonzero(samples * np.log(losses / losses.min()) <= limit)
        found.append((min(int(within[0]), own), max(int(within[-1]), own)))
    return tuple(found)


def noise_model(errors: Sequence[Array], least: int = 0) -> tuple[Array, Array]:
    """Return C and D of one order, at least `least`, preferred by BIC for the longest errors (n,)."""
    v, tried = max(errors, key=len), list[tuple[float, Array, Array]]()
    for n in range(least, _MOST_NOISE + 1):
        after = noise_polynomials(v, n, n) if n else (np.zeros(0), np.zeros(0))
        C, D = (reflected(np.append(1.0, p)) for p in after)
        power = max(float(np.mean(filtered(D, C, v) ** 2)), 1e-300)
        tried.append((v.size * np.log(power) + 2 * n * np.log(v.size), C, D))
    return min(tried, key=lambda one: one[0])[1:]


def whitening(errors: Sequence[Array]) -> Array:
    """Return the autoregression (m,) that makes errors (n,) of records white."""
    whole = np.concatenate(errors)[:, None]
    if not np.all(np.isfinite(whole)):
        return np.ones(1)
    return Whitening.of(whole, tuple(map(len, errors))).filters[0]


def whitened(parts: Parts, A: Array) -> list[tuple[Array, Array]]:
    """Return the records filtered by A (p + 1,), without the samples that lack a past."""
    lost = A.size - 1
    return [
        (filtered(A, [1.0], u, axis=0)[lost:], filtered(A, [1.0], y, axis=0)[lost:])
        for u, y in parts
        if len(y) > 2 * lost + 1
    ]


def lingering(polynomial: Array, samples: int) -> int:
    """Return the number of roots that hardly fade within `samples` samples, as if they integrated."""
    return int(np.sum(np.roots(polynomial).real > 1.0 - _FADES / samples))
