"""Limits on single samples and on powers, channel by channel, and what enforces them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.signal.constraints import SignalConstraint, peak_ratio
from inputdesign_cli.signal.input_limits import InputLimits
from inputdesign_cli.signal.limiter import Limiter
from inputdesign_cli.signal.phases import LimitedResponse
from inputdesign_cli.signal.settings import Quantiser, SignalSettings


@dataclass(frozen=True)
class Bounds:
    """What a record (n, r) may not exceed, by channel: `amplitude` and `rate` (r,), `output` (p,).

    They bound |u|, its moves and |y|, where u and y are what the record causes from rest (in open loop u is
    the record). `powers` are the largest mean squares: kind, channel (None is the sum over the channels),
    bound. `quantisers` are the converters of the inputs, none when empty.
    """

    amplitude: Array | None = None
    rate: Array | None = None
    output: Array | None = None
    powers: tuple[tuple[PowerKind, int | None, float], ...] = ()
    quantisers: tuple[Quantiser, ...] = ()

    @property
    def hard(self) -> bool:
        """Whether single samples are limited, or only some values of them can be made."""
        limited = any(bound is not None for bound in (self.amplitude, self.rate, self.output))
        return limited or bool(self.quantisers)


def limiter_of(plant: FiniteRecord, settings: SignalSettings, bounds: Bounds) -> Limiter:
    """Return the limiter that enforces the bounds on records of the length of the `plant`'s.

    Limits on u apply to the record itself in open loop only.
    """
    inputs, open_loop = plant.experiment.inputs, plant.experiment.loop is None
    amplitude, rate = (bounds.amplitude, bounds.rate) if open_loop else (None, None)
    limits = tuple(
        InputLimits(
            None if amplitude is None else float(amplitude[a]),
            None if rate is None else float(rate[a]),
            bounds.quantisers[a] if bounds.quantisers else None,
        )
        for a in range(inputs)
    )
    return Limiter(settings, limits, _constraints(plant, settings.hold, bounds))


def limited_responses(
    experiment: Experiment, bounds: Bounds, step: float, hold: int, frequencies: Array
) -> list[LimitedResponse]:
    """Return responses of each limited signal to sinusoids of the values, in steady state, and its bound.

    `frequencies` (L,) are in rad per value. Of values that are held only the record itself is answered for.
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
    """Limits that clipping the record cannot meet: at every plant on outputs, in closed loop on u.

    Beside a limit on outputs those on u are stated as well, which meeting it might spoil.
    """
    open_loop = plant.experiment.loop is None
    if bounds.output is None and open_loop:
        return ()
    found = (
        [] if bounds.output is None else [_signals(one, "output", hold, bounds.output) for one in plant.each]
    )
    for one in plant.each[:1] if open_loop else plant.each:
        if bounds.amplitude is not None:
            found.append(_signals(one, "input", hold, bounds.amplitude))
        if bounds.rate is not None:
            found.append(_moves(_signals(one, "input", hold, bounds.rate)))
    return tuple(found)


def peak_share(plant: FiniteRecord, bounds: Bounds, samples: Array) -> float:
    """The largest share of a limit on single samples that what a record (n, r) causes uses."""
    return peak_ratio(samples, _constraints(plant, 1, bounds))


def _signals(plant: FiniteRecord, of: PowerKind, hold: int, bound: Array) -> SignalConstraint:
    """The map from the values, each held, to what they cause."""

    def adjoint(weights: Array) -> Array:
        each = plant.adjoint(of, weights)
        return each.reshape(-1, hold, each.shape[1]).sum(axis=1)

    return SignalConstraint(lambda values: plant.signals(of, np.repeat(values, hold, axis=0)), adjoint, bound)


def _moves(signals: SignalConstraint) -> SignalConstraint:
    """Return the limit on the moves of each signal from one sample to the next, the first from rest."""
    return SignalConstraint(
        lambda values: np.diff(signals.apply(values), axis=0, prepend=0.0),
        lambda weights: signals.adjoint(weights - np.append(weights[1:], 0.0 * weights[:1], axis=0)),
        signals.bound,
    )
