"""Design -> the record of several inputs to be applied, and what the result says of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import (
    ChannelBounds,
    ChannelPhases,
    ChannelSignalGenerator,
    Lines,
    Record,
    RecordFilter,
    SignalSettings,
    Target,
    grid_lines,
    limited_responses,
    low_peak_angles,
    merged,
    realise_channels,
    schroeder_angles,
)
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import DirectedLines, LinesBasis
from inputdesign_cli.tasks.build.channel_task import channel_cost
from inputdesign_cli.tasks.build.channels import excitation_band, frequency_unit, record_step
from inputdesign_cli.tasks.build.signal_checks import SHORTEST_BLOCK
from inputdesign_cli.tasks.build.signal_settings import (
    build_channel_bounds,
    build_quantisers,
    build_signal_settings,
)
from inputdesign_cli.tasks.record import applied_entry, worst_ratio
from inputdesign_cli.tasks.result.result import powers
from inputdesign_cli.tasks.shortest_record import shortest_record

_CANDIDATES = 8
_LAGS = 50


def make_channel_record(spec: Spec, design: Design, experiment: ChannelExperiment) -> Record | None:
    """The best of several records of the designed spectrum.

    None when no excitation is needed, or when the record would be too short to hold a multisine
    (criteria per sample without `signal.samples`).

    Raises:
        InfeasibleError: no record of this length within the limits on single samples meets the accuracy.
    """
    if not design.result.x.any():
        return None
    found = experiment.samples if design.problem.goal == "samples" else spec.signal_samples
    recipe = build_channel_signal_settings(spec)
    samples = -(-(spec.signal.samples or found) // recipe.block) * recipe.block
    if recipe.period(samples) < SHORTEST_BLOCK * experiment.inputs:
        return None
    bounds = build_channel_bounds(spec, list(design.problem.limits))
    demand = _demand(spec, design)
    step = record_step(spec)

    def made(samples: int, candidates: int | None = None) -> Record:
        count = recipe.candidates if candidates is None else candidates
        return realise_channels(
            RecordFilter(experiment, samples, step),
            replace(
                channel_generator(spec, design, samples),
                recipe=replace(recipe, candidates=count, most_candidates=count),
                angles=_angles(recipe, experiment, step, bounds),
            ),
            demand,
            total=sum(powers(design.problem, design.result.basis, design.result.x)["excitation"]),
            bounds=bounds,
            quantisers=build_quantisers(spec),
        )

    record = made(samples)
    if record.met or recipe.level is not None or not (bounds.hard or spec.signal.quantisation):
        return record
    return shortest_record(spec, design, record, recipe.block, made)


def channel_generator(spec: Spec, design: Design, samples: int) -> ChannelSignalGenerator:
    """What draws records of the designed spectrum, phases of sinusoids uniformly."""
    step = record_step(spec)
    lo, hi = excitation_band(spec)
    return ChannelSignalGenerator(
        DesignLines(design.result.basis, design.result.x, step),
        build_channel_signal_settings(spec),
        samples,
        band=(lo * step, hi * step),
        phases=channel_phases(spec),
    )


def build_channel_signal_settings(spec: Spec) -> SignalSettings:
    """What is to be drawn; every candidate takes longer than those of one input."""
    recipe = build_signal_settings(spec)
    count = spec.signal.candidates or min(_CANDIDATES, recipe.candidates)
    return replace(recipe, candidates=count, most_candidates=count)


def channel_phases(spec: Spec) -> ChannelPhases:
    """How the phases of a multisine are chosen over the channels."""
    return "random" if spec.signal.phases == "random" else "orthogonal"


def _demand(spec: Spec, design: Design) -> Target:
    problem = design.problem
    first = problem.requirements[0]
    score = worst_ratio(problem.requirements)
    if isinstance(first, Criterion):
        criterion = first

        def score(information: Array) -> float:
            return -criterion.level(information)

    weights = channel_cost(spec) or {"excitation": 1.0}
    spent = powers(problem, design.result.basis, design.result.x)
    return Target(
        score,
        meets=problem.goal != "factor" and spec.signal.scale != "design",
        cost=weights,
        designed=float(sum(np.sum(np.multiply(weight, spent[kind])) for kind, weight in weights.items())),
    )


def _angles(
    recipe: SignalSettings, experiment: ChannelExperiment, step: float, bounds: ChannelBounds
) -> Callable[[Lines, int, np.random.Generator], Array | None]:
    """How the common phases of the lines are chosen; None for uniform draws."""
    if recipe.phases == "schroeder":
        return lambda lines, values, rng: schroeder_angles(lines, values)
    if recipe.phases != "optimised":
        return lambda lines, values, rng: None

    open_loop = experiment.loop is None

    def lowered(lines: Lines, values: int, rng: np.random.Generator) -> Array:
        start = 2.0 * np.pi * rng.random(lines.frequencies.size)
        held = recipe.hold > 1
        return low_peak_angles(
            lines,
            values,
            start,
            amplitude=bounds.amplitude if open_loop else None,
            rate=bounds.rate if open_loop else None,
            outputs=[] if held else limited_responses(experiment, bounds, lines.frequencies, step),
        )

    return lowered


@dataclass(frozen=True)
class DesignLines:
    """The sinusoids that stand for a spectrum of values `step` apart; other processes can have it."""

    basis: Any
    x: Array
    step: float

    def __call__(self, period: int, hold: int = 1) -> Lines:
        """Those of a period of so many values, each held for `hold` samples; in rad per value."""
        basis, x, step = self.basis, self.x, hold * self.step
        if isinstance(basis, LinesBasis):
            order = np.argsort(basis.frequencies)
            order = order[x[order] > 0]
            powers = x[order, None, None].astype(complex)
            return merged(Lines(basis.frequencies[order] * step, powers), period)
        if isinstance(basis, DirectedLines):
            frequencies, found = basis.lines(x)
            return merged(Lines(frequencies * step, found), period)
        w = 2.0 * np.pi * np.arange(period // 2 + 1) / (period * step)
        return grid_lines(basis.density(x, w), period, step)


def channel_signal_entry(
    spec: Spec, design: Design, experiment: ChannelExperiment, record: Record
) -> dict[str, Any]:
    """What `result.json` says of a record: powers and peaks by channel, and what it achieves."""
    samples, step = record.samples, record_step(spec)
    entry: dict[str, Any] = {"type": record.method}
    if record.method == "multisine":
        phases = build_channel_signal_settings(spec).phases
        plain = phases == "random" and spec.signal.phases is None
        entry["phases"] = "orthogonal" if plain and experiment.inputs > 1 else phases
    entry |= record_sizes(spec, experiment, samples)
    first = design.problem.requirements[0]
    if isinstance(first, Criterion):
        # Per as many samples as the experiment has, to be compared with the design.
        information = RecordFilter(experiment, len(samples), step).information(samples)
        reached = first.level(experiment.samples / len(samples) * information)
        entry["criterion"] = first.value(reached)
        entry["efficiency"] = reached / first.level(design.result.information)
    elif np.isfinite(record.worst_ratio):
        entry["worst_ratio"] = record.worst_ratio
    entry["extra_power"] = record.extra_power
    entry["spectrum_error"] = channel_spectrum_error(
        DesignLines(design.result.basis, design.result.x, step)(len(samples)), samples
    )
    return entry | applied_entry(spec, samples)


def channel_spectrum_error(lines: Lines, samples: Array) -> float:
    """The largest error of the record's correlations, lags 0 to 50, against those of the design.

    Those of inputs i and j are relative to the roots of their powers; the total power does not count.
    """
    lags = np.arange(min(_LAGS, len(samples) // 4) + 1)
    turn = np.exp(1j * np.outer(lags, lines.frequencies))
    wanted = np.einsum("tn,nab->tab", turn, lines.powers).real
    n = len(samples)
    found = np.array([samples[lag:].T @ samples[: n - lag] / (n - lag) for lag in lags])
    found *= np.trace(wanted[0]) / np.trace(found[0])
    size = np.sqrt(np.diag(wanted[0]))
    scale = np.where(size > 0.0, size, np.inf)
    return float(np.abs((found - wanted) / np.outer(scale, scale)).max())


def record_sizes(spec: Spec, experiment: ChannelExperiment, samples: Array) -> dict[str, Any]:
    """Length, powers and peaks by channel of a record (n, r)."""
    step = record_step(spec)
    plant = RecordFilter(experiment, len(samples), step)
    y, u = plant.signals("output", samples), plant.signals("input", samples)
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
