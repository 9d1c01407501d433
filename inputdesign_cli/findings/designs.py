"""Findings on a design, or on a given excitation, before its numbers are trusted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from inputdesign_cli.accuracy import Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, doubt, finding
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Powers, Signal
from inputdesign_cli.outcome.design import Loop
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.signal.limits import Bounds

_ROUNDING = 1e-9
# An input with less than this share of the power has none.
_NOTHING = 1e-9
# The shortest experiment, in slowest time constants, whose accuracy its spectrum predicts.
_SETTLED = 2.0
# Below this share of its largest price, power at a frequency is called free of charge.
_FREE = 1e-3
# Samples a parameter below which first-order theory understates errors by a tenth or more.
_FEW = 20
_SUPPORT = 1e-3  # share of the power from which a line counts
_NEAR = 0.9  # share of the allowed |S|


@finding(NOTE, "no-excitation-needed", "Use a record of normal operation, or ask for more accuracy.")
def nothing_needed(kind: FindingKind, experiment: Experiment) -> Finding:
    """No excitation is needed. Noise in normal operation or prior knowledge meets the required accuracy."""
    sources = ["the noise in normal operation"] if experiment.loop is not None else []
    sources += ["experiment.prior"] if experiment.prior is not None else []
    return kind.found(f"the information of {' and '.join(sources) or 'the noise'} is enough", sources=sources)


@finding(DOUBT, "input-without-power", "Take criterion D, A or E, which need information on every parameter.")
def inputs_without_power(kind: FindingKind, excited: Sequence[float]) -> list[Finding]:
    """The design does not excite an input. Criterion T may be largest without power in an input.

    Args:
        excited: the power of each input.
    """
    idle = [f"input {j}" for j, power in enumerate(excited, start=1) if power <= _NOTHING * sum(excited)]
    return [kind.found(f"{name}, whose effects stay unknown", where=name) for name in idle]


@finding(
    DOUBT,
    "experiment-short",
    "Raise `experiment.samples` to twice this time constant, or check with `idesign simulate`.",
)
def short_experiment(kind: FindingKind, experiment: Experiment) -> list[Finding]:
    """An experiment of this length ends before the plant settles. It takes two of the slowest time constants.

    The accuracy of a spectrum holds for long records. A short one loses the response after its end.
    """
    slowest, samples = experiment.slowest, experiment.samples
    if experiment.model.continuous or samples == 1 or _SETTLED * slowest <= samples:
        return []
    fact = f"the slowest time constant is {slowest:.2g} samples, and the spectrum is for {samples}"
    return [kind.found(fact, time_constant=slowest, samples=samples)]


@finding(
    DOUBT,
    "few-samples",
    "Take at least 20 samples a parameter, or leave a reserve: ask for half of the error.",
)
def few_samples(kind: FindingKind, experiment: Experiment) -> list[Finding]:
    """There are few samples for the parameters. Stated deviations hold for many samples.

    Estimates from fewer than 20 samples a parameter may scatter twice as much. `assess` simulates them.
    """
    samples, parameters = experiment.samples, len(experiment.model.names)
    few = samples > 1 and samples * experiment.model.outputs < _FEW * parameters
    fact = f"the spectrum is for {samples} samples, and {parameters} parameter{'s' * (parameters > 1)}"
    return kind.when(few, fact, samples=samples, parameters=parameters)


@finding(
    DOUBT,
    "error-as-large-as-plant",
    "Lower `accuracy.model_error`: `relative: 0.1` allows an error of 10 % of |G|.",
)
def sign_open(kind: FindingKind, requirements: Iterable[Requirement]) -> list[Finding]:
    """The accuracy asks for almost nothing. The error allowed is as large as |G| in the whole band.

    A model without any input would meet it.
    """
    found = {}
    for error in model_errors(requirements):
        size, admitted = error.nominal_size(error.grid), error.admissible.at(error.grid)
        acts = size > 0.0
        least = float(np.min(admitted[acts] / size[acts], initial=np.inf))
        if 1.0 - _ROUNDING <= least < np.inf:
            fact = f"an error of {least:.4g} times |G| is allowed, and G may have the wrong sign"
            found[fact] = kind.found(fact, ratio=least)
    return list(found.values())


@finding(
    NOTE,
    "loop-near-its-limit",
    "Tune it slower, or allow a larger |S|. A slower loop has `--set accuracy.loop.tuning.simc.tau_c=..` "
    "with a time beyond the dead time and half of the smaller lag.",
)
def near_its_limit(kind: FindingKind, loops: Iterable[Loop | None]) -> list[Finding]:
    """The loop itself takes most of the |S| that is allowed. Little is left for the error of the model."""
    found = []
    for loop in filter(None, loops):
        peak, most = loop.nominal_peak, loop.max_sensitivity
        if peak is not None and most is not None and peak > _NEAR * most:
            found.append(kind.found(f"{peak:.4g} of {most:.4g} with this plant", peak=peak, allowed=most))
    return found


@finding(
    NOTE,
    "loop-moves-every-sample",
    "If the actuator needs this time in the loop too, choose it as `sample_time` and tune the loop slower.",
)
def loop_not_held(kind: FindingKind, loops: Iterable[Loop | None], hold: int) -> list[Finding]:
    """The margins are of a loop that moves its input at every sample. The record holds it longer.

    Args:
        hold: samples for which the record holds each value.
    """
    held = hold > 1 and any(loops)
    return kind.when(held, f"each value of the record lasts {hold} samples at least", hold=hold)


@finding(NOTE, "excitation-almost-free", "Give `cost.excitation_power` a small weight, or limit it.")
def almost_free(
    kind: FindingKind, units: Units, lines: Array, power: Array, costs: Array, dearest: float
) -> list[Finding]:
    """Power at low frequencies costs almost nothing. Integral action suppresses slow excitation.

    Args:
        lines: (n,) frequencies of the sinusoids, with their power (n,) and the price of power there (n,).
        dearest: the largest price over frequency.
    """
    cheap = (costs < _FREE * dearest) & (power > _SUPPORT * power.sum())
    at = float(lines[cheap].max(initial=0.0)) / units.frequency
    near_zero = at < 1e-6 * np.pi / units.frequency
    band = "near frequency zero" if near_zero else f"below {at:.3g} {units.per_time}"
    fact = f"in this loop {band}. The excitation power of the optimum is ill defined"
    return kind.when(np.any(cheap), fact, where="cost.excitation_power", frequency=at)


@finding(NOTE, "met-within-table", "Give the table of `spectrum.given` more rows near its peaks.")
def met_within_table(kind: FindingKind, error: float) -> Finding:
    """The given table is too coarse to say for sure that the accuracy is met.

    Power between its rows is interpolated by straight lines. The accuracy is met, but by less than the error
    of this interpolation.
    """
    fact = f"interpolation between its rows may be wrong by {error:.1g} of the power"
    return kind.found(fact, where="spectrum.given", error=error)


@finding(DOUBT, "given-level", "State the level of the plant at rest as `signal.offset`.")
def given_level(kind: FindingKind, samples: Array, around: Array | None) -> list[Finding]:
    """The given signal stands further from `signal.offset` than it moves. This level counts as excitation."""
    levels = samples.mean(axis=0)
    far = np.abs(levels) > np.abs(samples - levels).max(axis=0)
    stated = [float(f"{x:.4g}") for x in far * levels + (0.0 if around is None else around)]
    fact = ", ".join(f"input {j + 1} is {levels[j]:.4g} on average" for j in np.flatnonzero(far))
    remedy = f"If the plant rests there, write signal.offset: {stated[0] if len(stated) == 1 else stated}."
    return kind.when(far.any(), fact, where="signal.offset", remedy=remedy, offset=stated)


LIMIT_NOT_KEPT = doubt(
    "limit-not-kept",
    "The given excitation breaks a limit. It is analysed unchanged. Its powers, samples and length are "
    "compared with `limits`.",
    "Scale or shorten the excitation, or widen the limit.",
)


def limits_not_kept(
    limits: Sequence[PowerLimit],
    longest: int | None,
    samples: int,
    power: Powers,
    signal: Signal | None = None,
    bounds: Bounds = Bounds(),
) -> list[Finding]:
    """Return a finding for each limit that the excitation does not keep.

    Args:
        limits: the limits on powers.
        samples: the length of the experiment, at most `longest`.
        power: the powers of the excitation, by channel.
        signal: the statements about its record, whose samples have the `bounds`; None without one.
    """
    channels = {"input": power.input, "output": power.output, "excitation": power.excitation}
    kept: list[tuple[str, str, float, float, bool]] = []  # key, channel, value, limit, whether an upper one
    for limit in limits:
        values = channels[limit.kind] or ()
        value = sum(values) if limit.channel is None else values[limit.channel]
        of = "" if limit.channel is None else f"{limit.channel + 1}"
        kept.append((limit.key, of, value, limit.bound, limit.upper))
    for key, bound, peaks in (
        ("limits.amplitude.input", bounds.amplitude, None if signal is None else signal.input_peak),
        ("limits.amplitude.output", bounds.output, None if signal is None else signal.output_peak),
        ("limits.rate", bounds.rate, None if signal is None else signal.input_move),
    ):
        each = [] if bound is None else bound.tolist()
        pairs = enumerate(zip(peaks or (), each, strict=False), start=1)
        kept += [(key, f"{j}", value, most, True) for j, (value, most) in pairs]
    if longest is not None:
        kept.append(("limits.samples", "", samples, longest, True))
    found = []
    for key, channel, value, most, upper in kept:
        beyond = value / most if upper else most / max(value, 1e-300)
        of = f" of channel {channel}" if channel else ""
        fact = f"{key}{of} is {most:.6g}, and the excitation has {value:.6g}"
        found += LIMIT_NOT_KEPT.when(beyond > 1.0 + _ROUNDING, fact, where=key, value=value, limit=most)
    return found
