"""What a user should know of a design, or of a given excitation, before a number of it is trusted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.accuracy import Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Powers, Signal
from inputdesign_cli.outcome.units import Units

_ROUNDING = 1e-9
# An input with less than this share of the power has none.
_NOTHING = 1e-9
# Time constants that an experiment has at least, for its spectrum to say what it reaches.
_SETTLED = 2.0
# Below this share of its largest price, power at a frequency is called free of charge.
_FREE = 1e-3
_SUPPORT = 1e-3

NOTHING_NEEDED = note(
    "no-excitation-needed",
    "No excitation is needed. The noise in normal operation or prior knowledge meets the required accuracy.",
    "Estimate the model from a record of normal operation, or ask for more accuracy.",
)
INPUT_WITHOUT_POWER = doubt(
    "input-without-power",
    "The design does not excite an input. Criterion T adds up the information of all parameters. It may be "
    "largest without power in an input.",
    "Take criterion D, A or E, which require information on every parameter.",
)
EXPERIMENT_SHORT = doubt(
    "experiment-short",
    "The experiment ends before the slowest mode settles. The accuracy of a spectrum holds for long "
    "records. A short record may be more or less accurate.",
    "Compare with the accuracy of the samples of the record, and run `idesign simulate`.",
)
SIGN_OPEN = doubt(
    "error-as-large-as-plant",
    "The admissible error is as large as the plant. It is at least the gain of the plant at every frequency "
    "of its band.",
    "Ask for a smaller error. A `relative` error of 0.1 means 10 %.",
)
EXCITATION_FREE = note(
    "excitation-almost-free",
    "Power at low frequencies costs almost nothing. A loop with integral action suppresses slow excitation. "
    "The power of the optimal excitation is then ill defined.",
    "Give `cost.excitation_power` a small weight, or limit it.",
)
MET_WITHIN_TABLE = note(
    "met-within-table",
    "Interpolation of the table decides whether the requirement is met. A table gives a spectrum by its "
    "rows and straight lines between them. The verdict is within the error of this interpolation.",
    "Give the table more rows.",
)


def nothing_needed(experiment: Experiment, *, at_every_plant: bool) -> Finding:
    """Return the finding for a design without excitation."""
    sources = ["the noise in normal operation"] if experiment.loop is not None else []
    sources += ["experiment.prior"] if experiment.prior is not None else []
    known = " and ".join(sources) or "the noise"
    kept = " at every plant that is not left out" if at_every_plant else ""
    return NOTHING_NEEDED.found(
        f"no excitation is needed: the information of {known} meets the accuracy{kept}", sources=sources
    )


def inputs_without_power(excited: Sequence[float]) -> Iterator[Finding]:
    """Yield a finding for each input without power; `excited` has the power of each."""
    for number, power in enumerate(excited, start=1):
        message = (
            f"input {number} gets no power, so that its own effects stay unknown: criterion T adds up "
            "information; D, A or E asks for every parameter"
        )
        if power <= _NOTHING * sum(excited):
            yield INPUT_WITHOUT_POWER.found(message, where=f"input {number}")


def short_experiment(experiment: Experiment) -> list[Finding]:
    """Return a finding if the experiment ends before its slowest mode settles; not without a length."""
    damping, samples = np.abs(experiment.singularities.imag), experiment.samples
    slowest = float(np.min(damping[damping > 0.0], initial=np.inf))
    if experiment.model.continuous or samples == 1 or slowest * samples >= _SETTLED:
        return []
    message = (
        f"the slowest mode has a time constant of {1.0 / slowest:.2g} samples, the experiment {samples}: a "
        "spectrum says what long records reach; trust what the record reaches by its own samples, and "
        "idesign simulate"
    )
    return [EXPERIMENT_SHORT.found(message, time_constant=1.0 / slowest, samples=samples)]


def sign_open(requirements: Iterable[Requirement]) -> list[Finding]:
    """Return a finding for each admissible error that leaves the sign of G open."""
    found = {}
    for error in model_errors(requirements):
        size, admitted = error.nominal_size(error.grid), error.admissible.at(error.grid)
        acts = size > 0.0
        least = float(np.min(admitted[acts] / size[acts], initial=np.inf))
        message = (
            f"the admissible error is {least:.4g} times |G| or more at every frequency of its band: a model "
            "that meets it may have the wrong sign (relative: 0.1 means 10 %)"
        )
        if 1.0 - _ROUNDING <= least < np.inf:
            found[message] = SIGN_OPEN.found(message, ratio=least)
    return list(found.values())


def almost_free(units: Units, lines: Array, power: Array, costs: Array, dearest: float) -> list[Finding]:
    """Return a finding if sinusoids of the design lie where power costs next to nothing.

    Args:
        lines: (n,) frequencies of the sinusoids, with their power (n,) and the price of power there (n,).
        dearest: the largest price over frequency.
    """
    cheap = (costs < _FREE * dearest) & (power > _SUPPORT * power.sum())
    at = float(lines[cheap].max(initial=0.0)) / units.frequency
    near_zero = at < 1e-6 * np.pi / units.frequency
    where = "near frequency zero" if near_zero else f"below {at:.3g} {units.per_time}"
    message = (
        f"power {where} is almost free of charge in this loop (integral action). The excitation power of "
        "the optimum is ill defined: give cost.excitation_power a small weight, or limit it"
    )
    found = EXCITATION_FREE.found(message, where="cost.excitation_power", frequency=at)
    return [found] if np.any(cheap) else []


def met_within_table(error: float) -> Finding:
    """Return the finding that the error of a table, of the worst ratio, decides."""
    message = (
        f"what is asked is met to within {error:.1g}: so far the table describes the spectrum, linear "
        "between its rows"
    )
    return MET_WITHIN_TABLE.found(message, where="spectrum.given", error=error)


LIMIT_NOT_KEPT = doubt(
    "limit-not-kept",
    "The given excitation breaks a limit. It is analysed unchanged. Its powers, samples and length are "
    "compared with `limits`.",
    "Scale or shorten the excitation, or widen the limit.",
)


@dataclass(frozen=True)
class StatedLimits:
    """What an experiment may not exceed: powers, single samples (a number or one a channel), its length."""

    powers: tuple[PowerLimit, ...]
    input: ArrayLike | None
    output: ArrayLike | None
    rate: ArrayLike | None
    samples: int | None


def limits_not_kept(
    limits: StatedLimits, samples: int, power: Powers, signal: Signal | None
) -> Iterator[Finding]:
    """Yield a finding for each limit that the excitation does not keep.

    Args:
        limits: the limits in the spec.
        samples: the length of the experiment.
        power: of the excitation, by channel.
        signal: the statements about its record; None without one.
    """
    channels = {"input": power.input, "output": power.output, "excitation": power.excitation}
    for limit in limits.powers:
        found, key, most = channels[limit.kind] or (), limit.key, limit.bound
        value, of = sum(found), str(limit.kind)
        if limit.channel is not None:
            value, of = found[limit.channel], f"{limit.kind} {limit.channel + 1}"
        beyond = value / most if limit.upper else most / max(value, 1e-300)
        side = "above" if limit.upper else "below"
        message = f"{key} is not kept: the power of {of} is {value:.6g}, {side} {most:.6g}"
        if beyond > 1.0 + _ROUNDING:
            yield LIMIT_NOT_KEPT.found(message, where=key, value=value, limit=most)
    for key, bound, peaks in (
        ("limits.amplitude.input", limits.input, None if signal is None else signal.input_peak),
        ("limits.amplitude.output", limits.output, None if signal is None else signal.output_peak),
        ("limits.rate", limits.rate, None if signal is None else signal.input_move),
    ):
        if bound is None or peaks is None:
            continue
        pairs = zip(peaks, np.broadcast_to(bound, len(peaks)).tolist(), strict=True)
        for channel, (value, most) in enumerate(pairs, start=1):
            of = f" of channel {channel}" if len(peaks) > 1 else ""
            message = f"{key} is not kept: the record reaches {value:.6g}{of}, above {most:.6g}"
            if value > most * (1.0 + _ROUNDING):
                yield LIMIT_NOT_KEPT.found(message, where=key, value=value, limit=most, channel=channel)
    key, longest = "limits.samples", limits.samples
    if longest is not None and samples > longest:
        message = f"{key} is not kept: the experiment has {samples} samples, more than {longest}"
        yield LIMIT_NOT_KEPT.found(message, where=key, value=samples, limit=longest)
