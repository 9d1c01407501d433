"""Spec -> model, experiment and spectrum for several channels or continuous time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.design.convex.problem import Weight
from inputdesign_cli.information import ChannelExperiment, PowerKind
from inputdesign_cli.plant import (
    ChannelLoop,
    ChannelModel,
    ContinuousChannels,
    MatrixController,
    PolynomialChannels,
    PolynomialLoop,
    SampledChannels,
    SampledLoop,
)
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.controller import ControllerMatrix
from inputdesign_cli.specification.models.experiment import NoiseShape
from inputdesign_cli.specification.models.plant import ContinuousPlant, PolynomialPlant
from inputdesign_cli.specification.models.spectrum import (
    FirSpectrum,
    FreeSpectrum,
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    MultisineSpectrum,
    PolynomialSpectrum,
    WhiteSpectrum,
)
from inputdesign_cli.specification.models.transfer import DiscreteTransfer
from inputdesign_cli.specification.models.values import depth
from inputdesign_cli.spectrum import (
    Basis,
    DirectedLines,
    FirBasis,
    FlatBasis,
    LinesBasis,
    MatrixFirBasis,
    PolynomialBasis,
)

_DEFAULT_ORDER = 20


def has_channels(spec: Spec) -> bool:
    """Whether the design is for this file: several channels, a plant in s, or a spectrum on a band."""
    plant = spec.plant
    if isinstance(plant, ContinuousPlant):
        return True
    several = plant.inputs > 1 or plant.outputs > 1
    banded = isinstance(spec.spectrum, PolynomialSpectrum) and not spec.closed_loop
    return isinstance(plant, PolynomialPlant) and (several or banded)


def build_channel_model(spec: Spec) -> ChannelModel:
    """The model of `plant` and `noise`, see `has_channels`.

    Raises:
        SpecError: `not-supported` for a plant in s whose noise is not white.
    """
    plant = spec.plant
    p = plant.outputs
    covariance = np.asarray(spec.noise.covariance(p), dtype=float)
    if isinstance(plant, ContinuousPlant):
        for name in spec.noise.filters:
            raise spec.complain(
                "not-supported",
                "this version takes the noise of a plant in s as white",
                hint=f"remove {name}, or write the plant as polynomials A, B, F in q^-1",
                key=f"noise.{name}",
            )
        matrix = plant.continuous
        continuous = ContinuousChannels.monic(
            _reversed(matrix.numerator_matrix),
            _reversed(matrix.denominator_matrix),
            covariance,
            common=depth(matrix.denominator) != 3,
        )
        return SampledChannels(continuous, spec.sample_time) if plant.sampled else continuous
    assert isinstance(plant, PolynomialPlant)
    return polynomial_channels(plant, spec.noise, covariance)


def polynomial_channels(plant: PolynomialPlant, noise: NoiseShape, covariance: Array) -> PolynomialChannels:
    """A plant in q^-1; A, C and D that the spec states once are common to the outputs."""
    return PolynomialChannels(
        B=_arrays(plant.B_matrix),
        A=rows_of(plant.A),
        F=_arrays(plant.F_matrix),
        C=rows_of(noise.C),
        D=rows_of(noise.D),
        covariance=covariance,
    )


def excitation_band(spec: Spec) -> tuple[float, float]:
    """Where the excitation may have power, in rad/sample, or rad per time unit in continuous time.

    Raises:
        SpecError: `needs-band` when continuous time leaves it open.
    """
    spectrum = spec.spectrum
    if isinstance(spectrum, PolynomialSpectrum):
        band: tuple[float, float] | None = spectrum.band
    elif isinstance(spectrum, MultisineSpectrum) and spectrum.frequencies:
        given = spectrum.frequencies
        lo, hi = given[0], given[-1]
        band = (lo, hi) if hi > lo else (0.5 * lo, 1.5 * hi)
    else:
        band = spec.limits.band or _given_band(spec)
    if spec.plant.sampled:
        lo, hi = spec.clip_band(band)
        return lo * spec.sample_time, min(hi * spec.sample_time, np.pi)
    if band is None or not np.isfinite(band[1]):
        raise spec.complain(
            "needs-band",
            "in continuous time frequencies have no end: the band of the excitation is missing",
            hint="add limits: {band: [0, 2]}, or a polynomial spectrum with its band",
            key="spectrum" if spectrum is not None else "limits",
        )
    return band


def _given_band(spec: Spec) -> tuple[float, float] | None:
    """What a given excitation covers in continuous time: its lines, or all that its samples carry."""
    if not isinstance(spec.spectrum, GivenSpectrum) or spec.plant.sampled:
        return None
    given = spec.spectrum.given
    if isinstance(given, GivenSignal):
        return 0.0, np.pi / spec.sample_time
    if isinstance(given, GivenMultisine) and given.frequencies[-1] > 0:
        lo, hi = given.frequencies[0], given.frequencies[-1]
        return (lo, hi) if hi > lo else (0.5 * lo, 1.5 * hi)
    return None


def spectrum_basis(spec: Spec, inputs: int, band: tuple[float, float]) -> Basis:
    """The family of spectra that the spec designs in.

    Args:
        band: of the excitation, see `excitation_band`.

    Raises:
        SpecError: `not-supported` for families of other kinds of design; `needs-band`.
    """
    spectrum = spec.spectrum
    if isinstance(spectrum, WhiteSpectrum):
        return FlatBasis(inputs, band)
    if isinstance(spectrum, PolynomialSpectrum):
        return PolynomialBasis(inputs, spectrum.order, band, spectrum.coefficients == "complex")
    if isinstance(spectrum, FreeSpectrum):
        grid = np.linspace(*band, 1000)
        return LinesBasis.anywhere(grid) if inputs == 1 else DirectedLines.anywhere(*band, inputs)
    if isinstance(spectrum, MultisineSpectrum):
        lines = line_frequencies(spec, spectrum, band)
        return LinesBasis(lines) if inputs == 1 else DirectedLines.at(lines, inputs)
    if spectrum is None and not spec.plant.sampled:
        raise spec.complain(
            "missing-key",
            "a design in continuous time needs a family of spectra",
            hint="add spectrum: {type: polynomial, order: 10, band: [0, 2]}",
            key="spectrum",
        )
    if spectrum is None or isinstance(spectrum, FirSpectrum):
        order = _DEFAULT_ORDER if spectrum is None else spectrum.order
        return FirBasis(order) if inputs == 1 else MatrixFirBasis(inputs, order)
    raise spec.complain(
        "not-supported",
        f"spectra of type {getattr(spectrum, 'type', 'given')} are not designed for this plant and accuracy",
        hint="choose fir, multisine, free, polynomial or white",
        key="spectrum",
    )


def line_frequencies(spec: Spec, spectrum: MultisineSpectrum, band: tuple[float, float]) -> Array:
    """The given frequencies in the unit of the experiment, or even ones inside the band.

    In discrete time these are the harmonics of a period of 2 `lines` samples; those at 0 and pi are left
    out, where a spectrum is real and phases mean nothing. In continuous time there are `lines` of them.
    """
    if spectrum.frequencies:
        return np.array(spectrum.frequencies) * frequency_unit(spec)
    assert spectrum.lines is not None
    if not spec.plant.sampled:
        return np.linspace(*band, spectrum.lines + 2)[1:-1]
    even = np.pi * np.arange(1, spectrum.lines) / spectrum.lines
    inside = even[(even >= band[0] * (1 - 1e-9)) & (even <= band[1] * (1 + 1e-9))]
    if inside.size == 0:
        raise spec.complain(
            "too-few-lines",
            f"none of the {spectrum.lines} evenly spaced lines lies inside the band",
            hint="ask for more lines, or widen the band",
            key="spectrum.lines",
        )
    return inside


def excitation_symbol(spec: Spec) -> str:
    """What is designed: r in closed loop, u in open loop."""
    return "r" if spec.closed_loop else "u"


def channel_experiment(spec: Spec) -> ChannelExperiment:
    """The experiment but for its prior, its loop checked for stability.

    Raises:
        SpecError: `needs-band`; an unstable or algebraic loop.
    """
    model, controller = build_channel_model(spec), spec.experiment.controller
    loop = None if controller is None else stable_loop(model, controller)
    if loop is not None:
        loop.check_delay()
    return ChannelExperiment(model, spec.experiment.samples, excitation_band(spec), loop=loop)


def stable_loop(model: ChannelModel, controller: DiscreteTransfer | ControllerMatrix) -> ChannelLoop:
    """The loop of a model that is sampled; a single transfer function is a controller of one entry.

    Raises:
        SpecError: the loop is unstable or algebraic.
    """
    if isinstance(controller, ControllerMatrix):
        C = MatrixController.build(controller.numerator_matrix, controller.denominator_matrix)
    else:
        C = MatrixController.build([[controller.numerator]], [[controller.denominator_polynomial]])
    loop: ChannelLoop
    if isinstance(model, SampledChannels):
        loop = SampledLoop(model, C)
    else:
        assert isinstance(model, PolynomialChannels)  # the spec has been checked
        loop = PolynomialLoop(model, C)
    loop.check_stability()
    return loop


def build_cost(spec: Spec) -> dict[PowerKind, Weight]:
    """Weights of the powers: of the sum over the channels, or one a channel."""
    weights: dict[PowerKind, Weight] = {
        "input": spec.cost.input_power,
        "output": spec.cost.output_power,
        "excitation": spec.cost.excitation_power,
    }
    return {kind: w for kind, w in weights.items() if np.any(np.asarray(w) > 0)}


def frequency_unit(spec: Spec) -> float:
    """What an experiment's frequency is divided by to be in rad per time unit."""
    return spec.sample_time if spec.plant.sampled else 1.0


def record_step(spec: Spec) -> float:
    """The time between samples in the unit of the experiment's frequencies: 1, or sample_time.

    Raises:
        SpecError: `beyond-nyquist` when samples are too far apart for the band of a continuous design.
    """
    if spec.plant.sampled:
        return 1.0
    _, hi = excitation_band(spec)
    if hi * spec.sample_time > np.pi * (1 + 1e-9):
        raise spec.complain(
            "beyond-nyquist",
            f"samples {spec.sample_time:g} {spec.time_unit} apart cannot carry the band up to {hi:g} "
            f"rad/{spec.time_unit}",
            hint=f"set sample_time to {0.5 * np.pi / hi:.3g} or less (at most {np.pi / hi:.3g})",
            key="sample_time",
        )
    return spec.sample_time


def _arrays(rows: Sequence[Sequence[Sequence[float]]]) -> tuple[tuple[Array, ...], ...]:
    return tuple(tuple(np.array(entry, dtype=float) for entry in row) for row in rows)


def _reversed(rows: Sequence[Sequence[Sequence[float]]]) -> tuple[tuple[Array, ...], ...]:
    return tuple(tuple(entry[::-1] for entry in row) for row in _arrays(rows))


def rows_of(value: tuple) -> tuple[Array, ...]:
    """One polynomial, common to all outputs, or a list of one an output."""
    return tuple(np.array(p, dtype=float) for p in (value if depth(value) == 2 else (value,)))
