"""Design -> the record of several inputs to be applied, and what the result says of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.assemble.channels import frequency_unit, record_step
from inputdesign_cli.assemble.record import worst_ratio
from inputdesign_cli.assemble.result import powers
from inputdesign_cli.design.designs import Design
from inputdesign_cli.errors import Complaint, InfeasibleError
from inputdesign_cli.information import POWER_KINDS, ChannelExperiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import (
    ChannelBounds,
    ChannelPhases,
    ChannelRecord,
    Lines,
    blocks_of,
    channel_inputs,
    channel_outputs,
    channel_record_information,
    grid_lines,
    low_peak_angles,
    merged,
    realise_channels,
    schroeder_angles,
)
from inputdesign_cli.spec import Spec
from inputdesign_cli.spectrum import DirectedLines, LinesBasis

_CANDIDATES = 8
_SHORTEST = 8  # samples a period


def make_channel_record(spec: Spec, design: Design, experiment: ChannelExperiment) -> ChannelRecord | None:
    """The best of several records of the designed spectrum.

    None when no excitation is needed, or when the record would be too short to hold a multisine
    (criteria per sample without `signal.samples`).
    """
    if not design.result.x.any():
        return None
    found = experiment.samples if design.problem.goal == "samples" else spec.signal_samples
    samples = spec.signal.samples or found
    phases = channel_phases(spec)
    if samples < _SHORTEST * blocks_of(phases, experiment.inputs):
        return None
    step = record_step(spec)
    lines = lines_of_record(spec, design, experiment, samples)
    first = design.problem.requirements[0]
    score = worst_ratio(design.problem.requirements)
    if isinstance(first, Criterion):
        criterion = first

        def score(information: Array) -> float:
            return -criterion.level(information)

    bounds = build_channel_bounds(spec, design)
    record = realise_channels(
        experiment,
        lines,
        score,
        samples=samples,
        step=step,
        phases=phases,
        candidates=spec.signal.candidates or _CANDIDATES,
        seed=spec.signal.seed or 0,
        angles=_angles(spec, experiment, lines, samples, step, bounds),
        bounds=bounds,
        meets=design.problem.goal != "factor" and spec.signal.scale != "design",
    )
    if record.short_of > 1.0 + 1e-9 and design.problem.goal != "factor":
        raise _too_tight(spec, record)
    return record


def channel_phases(spec: Spec) -> ChannelPhases:
    """How the phases of a multisine are chosen over the channels."""
    return "random" if spec.signal.phases == "random" else "orthogonal"


def lines_of_record(spec: Spec, design: Design, experiment: ChannelExperiment, samples: int) -> Lines:
    """The sinusoids that stand for the design in a record of so many samples."""
    blocks = blocks_of(channel_phases(spec), experiment.inputs)
    return design_lines(design, experiment, samples // blocks, record_step(spec))


def build_channel_bounds(spec: Spec, design: Design) -> ChannelBounds:
    """What the record may not exceed, channel by channel."""
    experiment = design.problem.experiment
    assert isinstance(experiment, ChannelExperiment)
    amplitude = spec.limits.amplitude
    return ChannelBounds(
        amplitude=None if amplitude is None else _each(amplitude.input, experiment.inputs),
        rate=_each(spec.limits.rate, experiment.inputs),
        output=None if amplitude is None else _each(amplitude.output, spec.plant.outputs),
        powers=tuple(
            (limit.kind, limit.channel, limit.bound) for limit in design.problem.limits if limit.upper
        ),
    )


def _each(value: float | tuple[float, ...] | None, channels: int) -> Array | None:
    """(channels,): a number holds for every channel."""
    return None if value is None else np.broadcast_to(np.asarray(value, dtype=float), channels)


def _angles(
    spec: Spec, experiment: ChannelExperiment, lines: Lines, samples: int, step: float, bounds: ChannelBounds
) -> Callable[[np.random.Generator], Array] | None:
    """How the common phases of the lines are chosen; None for uniform draws."""
    kind = spec.signal.phases or ("optimised" if bounds.hard else None)
    if kind == "schroeder":
        return lambda rng: schroeder_angles(lines, samples)
    if kind != "optimised":
        return None
    outputs = []
    if bounds.output is not None:
        response = experiment.response("output", lines.frequencies / step)
        outputs = [(response[:, i], float(bound)) for i, bound in enumerate(bounds.output)]

    def lowered(rng: np.random.Generator) -> Array:
        start = 2.0 * np.pi * rng.random(lines.frequencies.size)
        return low_peak_angles(lines, samples, start, amplitude=bounds.amplitude, outputs=outputs)

    return lowered


def _too_tight(spec: Spec, record: ChannelRecord) -> InfeasibleError:
    """The limits on single samples hold the record below the level that the accuracy needs."""
    stated = [name for name in ("amplitude", "rate") if getattr(spec.limits, name) is not None]
    names = " and ".join(f"limits.{name}" for name in stated)
    longer = int(np.ceil(len(record.samples) * record.short_of**2))
    key = f"limits.{stated[0]}"
    return InfeasibleError(
        Complaint(
            "limits-too-tight",
            f"no record of {len(record.samples)} samples within {names} meets the accuracy: its level "
            f"would have to be {record.short_of:.4g} times as high",
            f"about {longer} samples can (set experiment.samples and signal.samples); or raise the limits, "
            "or loosen the accuracy",
            key,
            spec.locate(key),
        )
    )


def design_lines(design: Design, experiment: ChannelExperiment, period: int, step: float) -> Lines:
    """The sinusoids that stand for the design, no stronger at input, output or excitation than it is."""
    basis, x = design.result.basis, design.result.x
    if isinstance(basis, LinesBasis):
        order = np.argsort(basis.frequencies)
        order = order[x[order] > 0]
        lines = merged(Lines(basis.frequencies[order] * step, x[order, None, None].astype(complex)), period)
    elif isinstance(basis, DirectedLines):
        frequencies, powers = basis.lines(x)
        lines = merged(Lines(frequencies * step, powers), period)
    else:
        w = 2.0 * np.pi * np.arange(period // 2 + 1) / (period * step)
        lines = grid_lines(basis.density(x, w), period, step)  # type: ignore[attr-defined]
    return lines.scaled(_fitting(design, experiment, lines, step))


def _fitting(design: Design, experiment: ChannelExperiment, lines: Lines, step: float) -> float:
    """What the lines are scaled by, so that no power exceeds that of the design."""
    at = lines.frequencies / step
    designed = powers(design.problem, design.result.basis, design.result.x)
    factors = []
    for kind in POWER_KINDS:
        density = experiment.power_density(kind, at)
        values = density[:, None, None] if density.ndim == 1 else density
        realised = float(np.einsum("nab,nba->", values, lines.powers).real)
        if realised > 0:
            factors.append(sum(designed[kind]) / realised)
    return min(factors)


def channel_signal_entry(
    spec: Spec, design: Design, experiment: ChannelExperiment, record: ChannelRecord
) -> dict[str, Any]:
    """What `result.json` says of a record: powers and peaks by channel, and what it achieves."""
    samples, step = record.samples, record_step(spec)
    hard = build_channel_bounds(spec, design).hard
    phases = spec.signal.phases or ("optimised" if hard else record.phases)
    entry = {"type": "multisine", "phases": phases, **record_sizes(spec, experiment, samples)}
    information = channel_record_information(experiment, samples, step)
    first = design.problem.requirements[0]
    if isinstance(first, Criterion):
        # Per as many samples as the experiment has, to be compared with the design.
        reached = first.level(experiment.samples / len(samples) * information)
        entry["criterion"] = first.value(reached)
        entry["efficiency"] = reached / first.level(design.result.information)
    elif np.isfinite(record.score):
        entry["worst_ratio"] = record.score
    return entry


def record_sizes(spec: Spec, experiment: ChannelExperiment, samples: Array) -> dict[str, Any]:
    """Length, powers and peaks by channel of a record (n, r)."""
    step = record_step(spec)
    y, u = channel_outputs(experiment, samples, step), channel_inputs(experiment, samples, step)
    peak, rms = np.abs(samples).max(axis=0), np.sqrt(np.mean(samples**2, axis=0))
    return {
        "samples": len(samples),
        "sample_time": step * spec.sample_time / frequency_unit(spec) if spec.plant.sampled else step,
        "power": (rms**2).tolist(),
        "peak": peak.tolist(),
        "crest_factor": (peak / np.maximum(rms, 1e-300)).tolist(),
        "input_power": np.mean(u**2, axis=0).tolist(),
        "output_power": np.mean(y**2, axis=0).tolist(),
        "input_peak": np.abs(u).max(axis=0).tolist(),
        "input_move": np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0).tolist(),
        "output_peak": np.abs(y).max(axis=0).tolist(),
    }
