"""A given excitation of several channels or in continuous time: its spectrum, or its samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.design.convex.problem import Weight, weights_of
from inputdesign_cli.information import POWER_KINDS, ChannelExperiment, FiniteRecord, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import (
    Lines,
    LineVectors,
    blocks_of,
    grid_lines,
    in_phase_record,
    multisine_record,
)
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    GivenTable,
    GivenWhite,
)
from inputdesign_cli.specification.models.values import depth
from inputdesign_cli.spectrum import DirectedLines, TabulatedChannels
from inputdesign_cli.tasks.build.channels import excitation_symbol, frequency_unit, record_step
from inputdesign_cli.tasks.build.given_table import bad_table, read_spectrum_table
from inputdesign_cli.tasks.build.tables import read_columns

_SHORTEST = 8  # samples a period
_NEGATIVE = -1e-9


@dataclass(frozen=True)
class ChannelExcitation:
    """What it is called, its powers by kind and channel, and the information matrix that it gives.

    `information` maps an experiment to M (k, k) in its coordinates. A recorded signal has `samples` (n, r),
    the others a `basis` and the coefficients `x` on it.
    """

    kind: str
    power: dict[PowerKind, list[float]]
    information: Callable[[ChannelExperiment], Array]
    basis: TabulatedChannels | DirectedLines | None = None
    x: Array | None = None
    samples: Array | None = None

    def cost(self, weights: dict[PowerKind, Weight]) -> float:
        """The weighted sum of the powers."""
        return sum(
            weight * (sum(self.power[kind]) if channel is None else self.power[kind][channel])
            for kind, channel, weight in weights_of(weights)
        )


def read_channel_excitation(spec: Spec, experiment: ChannelExperiment) -> ChannelExcitation:
    """The excitation that stands under `spectrum.given`.

    A power of white excitation is spread evenly over the channels unless there is one for each. The
    sinusoids of one frequency are in phase over the channels; a negative amplitude is in counterphase.

    Raises:
        DataError: its file cannot be used.
    """
    assert isinstance(spec.spectrum, GivenSpectrum)
    given, r = spec.spectrum.given, experiment.inputs
    if isinstance(given, GivenSignal):
        return _recorded(spec, experiment, given)
    if isinstance(given, GivenWhite):
        powers = np.array(
            given.power if isinstance(given.power, tuple) else [given.power / r] * r, dtype=float
        )
        return spectral("white", TabulatedChannels.white(powers, experiment.band), np.ones(1), experiment)
    if isinstance(given, GivenMultisine):
        frequencies, amplitudes = given_sinusoids(spec, given)
        constant = (frequencies <= 0.0) | (spec.plant.sampled & (frequencies >= np.pi))
        size = np.linalg.norm(amplitudes, axis=1)
        lines = DirectedLines(frequencies, amplitudes / size[:, None] + 0j, frequencies, np.ones(r))
        return spectral("multisine", lines, np.where(constant, 1.0, 0.5) * size**2, experiment)
    return spectral("table", _table(spec, given, r), np.ones(1), experiment)


def spectral(
    kind: str, basis: TabulatedChannels | DirectedLines, x: Array, experiment: ChannelExperiment
) -> ChannelExcitation:
    """An excitation that is known by its spectrum."""

    def information(coordinates: ChannelExperiment) -> Array:
        maps = basis.integrals(coordinates.information_density, coordinates.singularities)
        return coordinates.baseline_information + np.tensordot(x, maps, axes=1)

    def power(of: PowerKind, channel: int) -> float:
        unit = basis.integrals(lambda w: experiment.power_density(of, w, channel), experiment.singularities)
        return float(x @ unit)

    model = experiment.model
    found = {
        of: [power(of, i) for i in range(model.outputs if of == "output" else model.inputs)]
        for of in POWER_KINDS
    }
    return ChannelExcitation(kind, found, information, basis, x)


def given_sinusoids(spec: Spec, given: GivenMultisine) -> tuple[Array, Array]:
    """Frequencies (L,) in the unit of the experiment and amplitudes (L, r), of those that are not zero."""
    frequencies = np.array(given.frequencies) * frequency_unit(spec)
    if spec.plant.sampled:
        frequencies = np.minimum(frequencies, np.pi)
    rows = given.amplitudes if depth(given.amplitudes) == 2 else (given.amplitudes,)
    amplitudes = np.array(rows, dtype=float).T
    there = np.any(amplitudes != 0.0, axis=1)
    if not there.any():
        raise spec.complain(
            "not-exciting",
            "all amplitudes are zero: nothing is excited",
            hint="give the sinusoids amplitudes",
            key="spectrum.given.amplitudes",
        )
    return frequencies[there], amplitudes[there]


def _recorded(spec: Spec, experiment: ChannelExperiment, given: GivenSignal) -> ChannelExcitation:
    names = channel_columns(experiment.inputs, excitation_symbol(spec))
    path, step = spec.resolve_path(given.signal), record_step(spec)
    columns = read_columns(path, {name: name for name in names}, key="spectrum.given.signal")
    samples = np.stack([columns[name] for name in names], axis=1)
    plant = FiniteRecord(experiment, len(samples), step)
    return ChannelExcitation(
        "signal",
        {kind: plant.mean_squares(kind, samples).tolist() for kind in POWER_KINDS},
        lambda coordinates: FiniteRecord(coordinates, len(samples), step).information(samples),
        samples=samples,
    )


def channel_columns(inputs: int, symbol: str) -> Sequence[str]:
    """How the columns of a recorded signal begin: u1, u2, ..; u for one input; in closed loop r1, r2, .."""
    return [symbol] if inputs == 1 else [f"{symbol}{i + 1}" for i in range(inputs)]


def _table(spec: Spec, given: GivenTable, r: int) -> TabulatedChannels:
    """The columns of `spectrum.csv`: phi, or phi_11, phi_12_re, phi_12_im, phi_22, .."""
    pairs = [(i, j) for i in range(r) for j in range(i + 1, r)]
    names = {f"phi_{i + 1}{i + 1}": (i, i, 1.0) for i in range(r)} if r > 1 else {"phi": (0, 0, 1.0)}
    for i, j in pairs:
        names |= {f"phi_{i + 1}{j + 1}_re": (i, j, 1.0), f"phi_{i + 1}{j + 1}_im": (i, j, 1j)}  # type: ignore[dict-item]
    columns = read_spectrum_table(spec, given, list(names))
    phi = np.zeros((columns["frequency"].size, r, r), dtype=complex)
    for name, (i, j, unit) in names.items():
        phi[:, i, j] += unit * columns[name]
    for i, j in pairs:
        phi[:, j, i] = phi[:, i, j].conj()
    eigenvalues = np.linalg.eigvalsh(phi)
    if eigenvalues.max() <= 0 or eigenvalues.min() < _NEGATIVE * eigenvalues.max():
        message = "the spectrum must be positive semidefinite at every frequency, and not zero"
        raise bad_table(spec, given, message, "give the spectral density, such as the spectrum.csv of a run")
    frequency = columns["frequency"] * frequency_unit(spec)
    return TabulatedChannels(np.minimum(frequency, np.pi) if spec.plant.sampled else frequency, phi)


def line_vectors(spec: Spec) -> LineVectors:
    """How the vectors of a multisine are chosen over the inputs."""
    return "random" if spec.signal.phases == "random" else "orthogonal"


def channel_samples(spec: Spec, excitation: ChannelExcitation) -> Array | None:
    """The record as given, or one of the given spectrum (n, r); None for a record too short."""
    if excitation.samples is not None:
        return excitation.samples
    basis, samples = excitation.basis, spec.signal_samples
    rng, step = np.random.default_rng(spec.signal.seed or 0), record_step(spec)
    if isinstance(basis, DirectedLines):
        if samples < _SHORTEST:
            return None
        assert isinstance(spec.spectrum, GivenSpectrum)
        assert isinstance(spec.spectrum.given, GivenMultisine)
        frequencies, amplitudes = given_sinusoids(spec, spec.spectrum.given)
        return in_phase_record(frequencies * step, amplitudes, samples, rng)
    lines = given_lines(spec, excitation, samples)
    return None if lines is None else multisine_record(lines, samples, rng, line_vectors(spec))


def given_lines(spec: Spec, excitation: ChannelExcitation, samples: int) -> Lines | None:
    """The sinusoids that stand for a given density; None for another excitation, or a record too short."""
    basis = excitation.basis
    blocks = blocks_of(line_vectors(spec), spec.plant.inputs)
    if not isinstance(basis, TabulatedChannels) or samples < _SHORTEST * blocks:
        return None
    period, step = samples // blocks, record_step(spec)
    w = 2.0 * np.pi * np.arange(period // 2 + 1) / (period * step)
    lines = grid_lines(basis.density(np.ones(1), w), period, step)
    total = float(np.trace(lines.powers.sum(axis=0)).real)
    if total == 0.0:  # the band lies between two lines of the record
        return None
    return lines.scaled(sum(excitation.power["excitation"]) / total)
