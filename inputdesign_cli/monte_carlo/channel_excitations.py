"""The excitations of a Monte Carlo study with several inputs: a record for each run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from inputdesign_cli.information import ChannelExperiment, FiniteRecord
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import (
    Lines,
    LineVectors,
    SignalGenerator,
    SignalSettings,
    in_phase_record,
    multisine_record,
)
from inputdesign_cli.spectrum import TabulatedChannels

_LINES_AT_ONCE = 64


class ChannelExcitation(Protocol):
    """What the runs apply, each a realisation of its own."""

    @property
    def name(self) -> str: ...

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """(runs, samples, r)."""
        ...

    def information(self, experiment: ChannelExperiment) -> Array:
        """(k, k) in raw parameters: what it tells in theory, prior information included."""
        ...


@dataclass(frozen=True)
class Recorded:
    """One record (samples, r), `step` apart, that all runs apply."""

    name: str
    record: Array
    step: float

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        return np.broadcast_to(self.record, (runs, *self.record.shape))

    def information(self, experiment: ChannelExperiment) -> Array:
        return FiniteRecord(experiment, len(self.record), self.step).information(self.record)


@dataclass(frozen=True)
class Multisine:
    """Sinusoids of new phases in each run, scaled to their power exactly; frequencies are in rad per step."""

    name: str
    lines: Lines
    phases: LineVectors
    step: float

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        drawn = np.stack([multisine_record(self.lines, samples, rng, self.phases) for _ in range(runs)])
        return _scaled(drawn, float(np.trace(self.lines.powers.sum(axis=0)).real))

    def information(self, experiment: ChannelExperiment) -> Array:
        return _line_information(experiment, self.lines, self.step)


@dataclass(frozen=True)
class Drawn:
    """Records of the designed spectrum, drawn anew in each run and scaled to its power exactly."""

    name: str
    drawer: SignalGenerator
    power: float
    step: float

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        values = np.stack([self.drawer.values(rng) for _ in range(runs)])
        return _scaled(np.repeat(values, self.drawer.settings.hold, axis=1), self.power)

    def information(self, experiment: ChannelExperiment) -> Array:
        single = self.drawer.settings.block == 1
        lines = self.drawer.lines if single else self.drawer.spectrum.lines(self.drawer.samples)
        total = float(np.trace(lines.powers.sum(axis=0)).real)
        return _line_information(experiment, lines.scaled(self.power / total), self.step)


@dataclass(frozen=True)
class InPhase:
    """Sinusoids of `amplitudes` (L, r) at `frequencies` (L,) in rad per step, in phase over the channels."""

    name: str
    frequencies: Array
    amplitudes: Array
    step: float

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        return np.stack(
            [in_phase_record(self.frequencies, self.amplitudes, samples, rng) for _ in range(runs)]
        )

    def information(self, experiment: ChannelExperiment) -> Array:
        constant = (self.frequencies <= 0.0) | (self.frequencies >= np.pi)
        powers = np.einsum("la,lb->lab", self.amplitudes, self.amplitudes).astype(complex)
        powers *= np.where(constant, 1.0, 0.5)[:, None, None]
        return _line_information(experiment, Lines(self.frequencies, powers), self.step)


@dataclass(frozen=True)
class Flat:
    """Independent signals of one kind and of these powers (r,), each of a flat spectrum; in discrete time."""

    name: str
    powers: Array
    recipe: SignalSettings

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        # Parts of one long record: two sequences of a shift register are delays of each other.
        channels = self.powers.size
        whole = Excitation(self.name, recipe=self.recipe).draw(runs, samples * channels, rng)
        parts = whole.reshape(runs, channels, samples).swapaxes(1, 2)
        return parts * np.sqrt(self.powers / np.mean(parts**2, axis=1, keepdims=True))

    def information(self, experiment: ChannelExperiment) -> Array:
        basis = TabulatedChannels.white(self.powers, (0.0, np.pi))
        maps = basis.integrals(experiment.information_density, experiment.singularities)
        return np.asarray(experiment.baseline_information + maps[0])


def _scaled(records: Array, power: float) -> Array:
    """Records (runs, samples, r) of this power in all channels together."""
    found = np.mean(records**2, axis=1, keepdims=True).sum(axis=2, keepdims=True)
    return np.asarray(records * np.sqrt(power / found))


def _line_information(experiment: ChannelExperiment, lines: Lines, step: float) -> Array:
    """M0 + sum over lines of tr(D P), D the information density."""
    total = experiment.baseline_information.copy()
    w = lines.frequencies / (step if experiment.model.continuous else 1.0)
    for start in range(0, w.size, _LINES_AT_ONCE):
        part = slice(start, start + _LINES_AT_ONCE)
        density = experiment.information_density(w[part])
        if experiment.inputs == 1:
            density = density[..., None, None]
        total += np.einsum("nklab,nba->kl", density, lines.powers[part], optimize=True).real
    return total
