"""Limits on single samples and on powers, channel by channel, and the means to enforce them on records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.signal.constraints import (
    INSIDE,
    SignalConstraint,
    largest_move,
    peak_ratio,
    ramped,
    restrained,
    slow_moves,
)
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.phases import LimitedResponse
from inputdesign_cli.signal.settings import Quantiser, SignalSettings

_ROUNDING = 1.0 + 1e-12
_TRIES = 8
_SILENT = 1e-300  # the share of a bound that a zero signal uses, so that any factor is within it


@dataclass(frozen=True)
class Bounds:
    """Holds the bounds on a record (n, r), by channel: `amplitude` and `rate` (r,), `output` (p,).

    They bound |u|, its moves and |y|, where the record causes u and y from rest (in open loop u is
    the record). `powers` are the largest mean squares: kind, channel (None is the sum over the channels),
    bound. `quantisers` are the converters of the inputs, none when empty. A record has at most `moves`
    changes of its inputs, or as many in `moves_in` samples.
    """

    amplitude: Array | None = None
    rate: Array | None = None
    output: Array | None = None
    powers: tuple[tuple[PowerKind, int | None, float], ...] = ()
    quantisers: tuple[Quantiser, ...] = ()
    moves: float | None = None
    moves_in: float | None = None

    def most_moves(self, samples: int) -> int | None:
        """Return the largest number of changes of the inputs in a number of samples; None without a limit."""
        return None if self.moves is None else int(self.moves * samples / (self.moves_in or samples))

    @cached_property
    def hard(self) -> bool:
        """Return whether single samples are limited, or only some values of them can be made."""
        limited = any(bound is not None for bound in (self.amplitude, self.rate, self.output))
        return limited or bool(self.quantisers)

    def shares(self, u: Array, y: Array | None = None) -> dict[str, float]:
        """Return the largest share over the channels of each limit that inputs u (n, r) and outputs take."""
        stated = (
            ("amplitude.input", self.amplitude, u),
            ("amplitude.output", self.output, y),
            ("rate", self.rate, np.diff(u, axis=0, prepend=0.0)),
            ("moves", self.most_moves(len(u)), np.array(np.count_nonzero(np.diff(u, axis=0, prepend=0.0)))),
        )
        return {
            key: float(np.max(np.abs(x) / most))
            for key, most, x in stated
            if most is not None and x is not None
        }


@dataclass(frozen=True)
class Limiter:
    """Turns values (m, r) at some level into the record that is applied.

    Args:
        amplitude, rate: (r,) bounds on values and on moves, infinite where there is none.
        quantisers: the converters of the inputs, none when empty.
        constraints: limits on responses to the values, which clipping them does not keep.
    """

    settings: SignalSettings
    amplitude: Array
    rate: Array
    quantisers: tuple[Quantiser, ...] = ()
    constraints: tuple[SignalConstraint, ...] = ()

    @classmethod
    def of(cls, plant: FiniteRecord, settings: SignalSettings, bounds: Bounds) -> Limiter:
        """Return the limiter that enforces the bounds on records of the length of the `plant`'s.

        Limits on u apply to the record itself in open loop only.
        """
        experiment = plant.experiment
        amplitude, rate = (
            np.full(experiment.inputs, np.inf) if most is None or experiment.loop is not None else most
            for most in (bounds.amplitude, bounds.rate)
        )
        constraints = _constraints(plant, settings.hold, bounds)
        return cls(settings, amplitude, rate, bounds.quantisers, constraints)

    @cached_property
    def plain(self) -> bool:
        """Return whether the record is just a multiple of its values."""
        limited = self.constraints or self.quantisers or np.isfinite([*self.amplitude, *self.rate]).any()
        return not limited

    @cached_property
    def reach(self) -> Array:
        """Return the largest modulus, by the bound and by the range of the converter, (r,)."""
        converters = np.array([one.reach() for one in self.quantisers] or [np.inf])
        return np.minimum(self.amplitude, converters)

    def factor(self, values: Array) -> float:
        """Return the largest factor on the values (m, r) within the limits on them; infinite without any."""
        moves = np.array([largest_move(column) for column in values.T])
        pairs = ((np.abs(values).max(axis=0), self._most), (moves, self._fastest))
        return min(
            (float(most[i] / size[i]) for size, most in pairs for i in np.flatnonzero(size)), default=np.inf
        )

    def record(self, values: Array, level: float) -> Array:
        """Return `level` times the `values` as far as the limits allow, which hold exactly, (n, r)."""
        goal = level * values
        if self.settings.returns:
            goal[-1] = 0.0
        if self.plain:
            return self._held(goal)
        kind = kind_of(self.settings.method)
        if kind.few_levels:
            return self._held(self._levelled(goal))
        shrink, record, follow = 1.0, goal, ramped if kind.slewed else slow_moves
        for _ in range(_TRIES):
            limited = np.clip(goal, -self._most, self._most)
            for channel in np.flatnonzero(np.isfinite(self._fastest)):
                rate, column = float(self._fastest[channel]), limited[:, channel]
                if self.settings.returns:  # early enough to reach zero at the end
                    reach = rate * np.arange(len(column))[::-1]
                    column = np.clip(column, -reach, reach)
                limited[:, channel] = follow(column, rate)
            if self.constraints:
                tightened = tuple(replace(one, bound=shrink * one.bound) for one in self.constraints)
                limited = restrained(limited, tightened, returns=self.settings.returns)
            record = self._converted(limited)
            # Rounding may lift a response slightly above its bound.
            excess = peak_ratio(record, self.constraints)
            if excess <= 1.0:
                break
            shrink /= excess * 1.001
        return self._held(record)

    def _held(self, values: Array) -> Array:
        return np.repeat(values, self.settings.hold, axis=0)

    def _converted(self, values: Array) -> Array:
        """Return the nearest values of the converters."""
        if not self.quantisers:
            return values
        columns = zip(self.quantisers, values.T, strict=True)
        return np.stack([one.step * one.steps(column) for one, column in columns], axis=1)

    def _levelled(self, goal: Array) -> Array:
        """Return few levels that stay few: the limits lower all inputs by one factor.

        With a converter the height is rounded to whole steps, to the nearest or, at a limit, down.
        """
        factor = self.factor(goal)
        if self.constraints:
            factor = min(factor, INSIDE / max(peak_ratio(goal, self.constraints), _SILENT))
        sizes = np.abs(goal).max(axis=0)
        heights = min(factor, 1.0) * sizes
        for channel, one in enumerate(self.quantisers):
            steps = np.floor(heights[channel] / one.step + (0.5 if factor >= 1.0 else 1e-12))
            heights[channel] = one.step * min(steps, np.floor(one.reach() / one.step + 0.5))
        return goal * np.divide(heights, sizes, out=np.ones_like(sizes), where=sizes > 0.0)

    @cached_property
    def _most(self) -> Array:
        """Return the reach, of whole steps of the converter, (r,)."""
        return self._whole(self.reach, self.reach)

    @cached_property
    def _fastest(self) -> Array:
        return self._whole(self.rate, self.rate * INSIDE)

    def _whole(self, bound: Array, plain: Array) -> Array:
        steps = np.array([one.step for one in self.quantisers])
        return steps * np.floor(bound / steps * _ROUNDING) if self.quantisers else plain


def limited_responses(
    experiment: Experiment, bounds: Bounds, step: float, hold: int, frequencies: Array
) -> list[LimitedResponse]:
    """Return responses of each limited signal to sinusoids of the values, in steady state, and its bound.

    `frequencies` (L,) are in rad per value. If values are held, only the record itself has responses.
    """
    at, moving = frequencies / (step * hold), (1.0 - np.exp(-1j * frequencies))[:, None, None]
    found: list[LimitedResponse] = []
    if experiment.loop is None or hold == 1:
        u = experiment.response("input", at)
        for response, limits in ((u, bounds.amplitude), (moving * u, bounds.rate)):
            if limits is not None:
                found += [(response[:, a], float(bound)) for a, bound in enumerate(limits)]
    if bounds.output is not None and hold == 1:
        y = experiment.response("output", at)
        found += [(y[:, i], float(bound)) for i, bound in enumerate(bounds.output)]
    return found


def _constraints(plant: FiniteRecord, hold: int, bounds: Bounds) -> tuple[SignalConstraint, ...]:
    """Return the limits that clipping the record cannot meet: on outputs, and in closed loop on u.

    Beside a limit on outputs the limits on u are stated as well, which meeting it might spoil.
    """
    open_loop = plant.experiment.loop is None
    if bounds.output is None and open_loop:
        return ()
    found = [] if bounds.output is None else [_signals(plant, "output", hold, bounds.output)]
    if bounds.amplitude is not None:
        found.append(_signals(plant, "input", hold, bounds.amplitude))
    if bounds.rate is not None:
        found.append(_moves(_signals(plant, "input", hold, bounds.rate)))
    return tuple(found)


def peak_share(plant: FiniteRecord, bounds: Bounds, samples: Array) -> float:
    """Return the largest share of a limit on single samples that the response to a record (n, r) uses."""
    return peak_ratio(samples, _constraints(plant, 1, bounds))


def _signals(plant: FiniteRecord, of: PowerKind, hold: int, bound: Array) -> SignalConstraint:
    """Return the map from the values, each held, to the signals that they cause at every plant."""

    def apply(values: Array) -> Array:
        return plant.signals_of_each(of, np.repeat(values, hold, axis=0))

    def adjoint(weights: Array) -> Array:
        each = plant.adjoint_of_each(of, weights)
        return each.reshape(-1, hold, each.shape[1]).sum(axis=1)

    return SignalConstraint(apply, adjoint, np.tile(bound, plant.plants_with_own(of)))


def _moves(signals: SignalConstraint) -> SignalConstraint:
    """Return the limit on the moves of each signal from one sample to the next, the first from rest."""
    return SignalConstraint(
        lambda values: np.diff(signals.apply(values), axis=0, prepend=0.0),
        lambda weights: signals.adjoint(weights - np.append(weights[1:], 0.0 * weights[:1], axis=0)),
        signals.bound,
    )
