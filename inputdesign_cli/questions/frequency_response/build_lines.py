"""Build the periods of a record for `accuracy.frequency_response` and the harmonics that are measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.questions.frequency_response.terms import KEY
from inputdesign_cli.signal.harmonic_grid import (
    HarmonicGrid,
    TooFewHarmonicsError,
    harmonics_between,
    nearest_harmonics,
    thinned,
)
from inputdesign_cli.specification import FrequencyResponse, Spec
from inputdesign_cli.specification.models.sizes import most

# Periods of a block after the transient, if none are stated: their scatter shows the noise.
_COUNTED = 4

# The longest period that is tried, relative to the stated one, and the number of tries.
_LONGEST, _TRIED = 1e3, 400


def stated_response(spec: Spec) -> FrequencyResponse:
    """Return `accuracy.frequency_response`.

    Raises:
        SpecError: `missing-key`.
    """
    stated = spec.accuracy.frequency_response
    if stated is None:
        raise bad_spec(
            "missing-key",
            "nothing is said of the lines and of the accuracy of a frequency response",
            hint="add accuracy: {frequency_response: {relative: 0.05, band: [0.01, 1], lines: 40}}",
            key="accuracy",
        )
    return stated


def build_periods(spec: Spec) -> Periods:
    """Return how the record repeats; it has whole periods, and is no longer than the experiment.

    Raises:
        SpecError: `bad-period`, `missing-key`.
    """
    stated, blocks, samples = stated_response(spec), spec.plant.inputs, spec.experiment.samples
    skip, shortest = stated.transient, spec.designs and spec.goal == "shortest_experiment"
    if stated.period is not None:
        period = stated.period
        times = samples // (blocks * period)
        if spec.signal.periods is not None and spec.signal.periods != blocks * times and not shortest:
            raise bad_spec(
                "conflicting-keys",
                f"signal.periods is {spec.signal.periods}, and {samples} samples hold {blocks * times} "
                f"periods of {period}",
                hint="give one of signal.periods and accuracy.frequency_response.period",
                key="signal.periods",
            )
    elif shortest:
        raise bad_spec(
            "missing-key",
            "the length of the experiment is sought, so that the period of its lines must be given",
            hint=f"add {KEY}.period: the time that resolves the lines, in samples",
            key=KEY,
        )
    else:
        times = (spec.signal.periods or blocks * (skip + _COUNTED)) // blocks
        period = samples // (blocks * max(times, 1))
    if not shortest and times <= skip:
        each = f" for each of {blocks} inputs" if blocks > 1 else ""
        raise bad_spec(
            "bad-period",
            f"the record has {times} periods{each}, and {skip} are left to the transient: none counts",
            hint=f"take {blocks * (skip + 2) * max(period, 3)} samples or more, or a shorter period",
            key=f"{KEY}.period" if stated.period is not None else "experiment.samples",
        )
    if period < 3:
        raise bad_spec(
            "bad-period",
            f"a period of {period} samples has no harmonic between 0 and the Nyquist frequency",
            hint="take more samples, or fewer periods",
            key="experiment.samples",
        )
    longest = most("signal.samples")
    if not shortest and blocks * times * period > longest:
        raise bad_spec(
            "too-large",
            f"the record has {blocks * times * period} samples, and at most {longest} are computed",
            hint=f"write experiment.samples: {longest} or less",
            key="experiment.samples",
        )
    return Periods(period, blocks, skip)


def build_grid(spec: Spec, period: int) -> HarmonicGrid:
    """Return the lines, and the silent ones that show a nonlinearity.

    Raises:
        SpecError: `too-few-lines`, `out-of-range`.
    """
    stated, step = stated_response(spec), spec.sample_time
    odd = stated.detection is not None
    if stated.frequencies is not None:
        wanted = np.array(stated.frequencies)
        _check_inside(spec, wanted, period)
        chosen = nearest_harmonics(period, wanted * step, odd=odd)
        same = np.flatnonzero(np.diff(chosen) == 0)
        if same.size:
            at = int(same[0])
            apart = (2 if odd else 1) * 2.0 * np.pi / (period * step)
            raise bad_spec(
                "too-few-lines",
                f"{wanted[at]:.6g} and {wanted[at + 1]:.6g} rad/{spec.time_unit} are the same line: with "
                f"a period of {period} samples lines are {apart:.3g} rad/{spec.time_unit} apart",
                hint="take a longer period, or drop one of the two",
                key=f"{KEY}.frequencies[{at + 1}]",
            )
    else:
        chosen = _in_band(spec, stated, period)
    return HarmonicGrid.of(period, chosen, watched=odd)


def _in_band(spec: Spec, stated: FrequencyResponse, period: int) -> NDArray[np.int_]:
    """Return the lines that are asked for, or all harmonics but the silent ones that show a nonlinearity.

    Raises:
        SpecError: `too-few-lines`.
    """
    (lo, hi), step, group = spec.clip_band(stated.band), spec.sample_time, stated.detection
    candidates = stated.lines
    if group is not None and candidates is not None:
        candidates += (candidates - 1) // (group - 1)
    band, odd = (lo * step, hi * step), group is not None
    try:
        found = harmonics_between(period, band, candidates, odd=odd)
    except TooFewHarmonicsError as error:
        kind = "odd harmonics" if group is not None else "harmonics"
        asked = "at least one is" if candidates is None else f"{candidates} are"
        left_out = ", with the silent lines that show a nonlinearity" if candidates != stated.lines else ""
        raise bad_spec(
            "too-few-lines",
            f"the band holds {error.there} {kind} of a period of {period} samples, and {asked} "
            f"asked for{left_out}",
            hint="take a longer period (more samples, or fewer periods"
            f"{_longer(spec, period, band, candidates, odd=odd)}), fewer lines, or a higher end of the band",
            key=f"{KEY}.lines" if candidates is not None else f"{KEY}.band",
        ) from None
    if group is None:
        return found
    return thinned(found, group, np.random.default_rng(spec.signal.seed or 0))[: stated.lines]


def _longer(spec: Spec, period: int, band: tuple[float, float], lines: int | None, *, odd: bool) -> str:
    """Return the end of a hint: which period and experiment hold the lines; empty if none is found."""
    for longer in np.unique(np.ceil(period * np.geomspace(1.0, _LONGEST, _TRIED)).astype(int)).tolist():
        try:
            harmonics_between(longer, band, lines, odd=odd)
        except TooFewHarmonicsError:
            continue
        whole = longer * max(spec.experiment.samples // period, 1)
        lasts = whole * spec.sample_time
        return f": {longer} samples hold them, {whole} samples or {lasts:.6g} {spec.time_unit} in all"
    return ""


def _check_inside(spec: Spec, wanted: Array, period: int) -> None:
    """Raise `SpecError` (`out-of-range`) for lines at 0 or at the Nyquist frequency, and beyond."""
    half = np.pi / (period * spec.sample_time)
    outside = np.flatnonzero((wanted < half * (1 - 1e-9)) | (wanted > spec.nyquist - half * (1 - 1e-9)))
    if outside.size:
        at = int(outside[0])
        raise bad_spec(
            "out-of-range",
            f"{wanted[at]:.6g} rad/{spec.time_unit} is nearest to no harmonic of a period of {period} "
            "samples between 0 and the Nyquist frequency",
            hint=f"lines lie between {2 * half:.4g} and {spec.nyquist - half:.4g} rad/{spec.time_unit}; a "
            "longer period begins lower",
            key=f"{KEY}.frequencies[{at}]",
        )
