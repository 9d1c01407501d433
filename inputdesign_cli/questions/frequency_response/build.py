"""Build the question of `accuracy.frequency_response` from its spec, and check it before it is computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.response_lines import Goal, ResponseLines
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.assessment.build import operating_point
from inputdesign_cli.questions.building.header import build_header, build_units
from inputdesign_cli.questions.building.limits import build_power_limits, implied_limits
from inputdesign_cli.questions.building.model_error import positive_table
from inputdesign_cli.questions.building.signal_settings import build_record_request
from inputdesign_cli.questions.building.simulation import build_simulation
from inputdesign_cli.questions.building.system import build_cost, build_model
from inputdesign_cli.questions.building.tables import has_column
from inputdesign_cli.questions.building.unhandled import ONE_PLANT, check_compared, refuse_unhandled
from inputdesign_cli.questions.frequency_response.measure import Measurement
from inputdesign_cli.questions.frequency_response.outcome import KEY, ResponseTerms
from inputdesign_cli.questions.frequency_response.solve import ResponseTask
from inputdesign_cli.signal import harmonic_grid
from inputdesign_cli.specification import FrequencyResponse, Spec
from inputdesign_cli.specification.models.sizes import most

_GOALS: dict[str, Goal] = {"least_cost": "cost", "best_accuracy": "factor", "shortest_experiment": "samples"}
_ZERO = 1e-12
# Periods up to so many times as long are tried for a hint, and how many of them.
_LONGEST, _TRIED = 1e3, 400
_SIGNAL = (
    *("hold", "lines", "amplitudes", "ramp", "bits", "quantisation", "scale", "order"),
    *("samples", "start"),
)
# Periods of a block after the transient, if none are stated: their scatter shows the noise.
_COUNTED = 4


def build_periods(spec: Spec, stated: FrequencyResponse) -> Periods:
    """Return the repetition of the record; raise `bad-period` unless whole periods fit into it."""
    blocks, samples = spec.plant.inputs, spec.experiment.samples
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
        message = "the length of the experiment is sought, so that the period of its lines must be given"
        hint = f"add {KEY}.period: the time that resolves the lines, in samples"
        raise bad_spec("missing-key", message, hint=hint, key=KEY)
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
        message = f"a period of {period} samples has no harmonic between 0 and the Nyquist frequency"
        hint = "take more samples, or fewer periods"
        raise bad_spec("bad-period", message, hint=hint, key="experiment.samples")
    longest = most("signal.samples")
    if not shortest and blocks * times * period > longest:
        message = f"the record has {blocks * times * period} samples, and at most {longest} are computed"
        hint = f"write experiment.samples: {longest} or less"
        raise bad_spec("too-large", message, hint=hint, key="experiment.samples")
    return Periods(period, blocks, skip)


def build_grid(spec: Spec, stated: FrequencyResponse, period: int) -> harmonic_grid.HarmonicGrid:
    """Return the lines and the silent ones; raise `SpecError` (`too-few-lines`, `out-of-range`)."""
    step, unit, odd = spec.sample_time, f"rad/{spec.time_unit}", stated.detection is not None
    if stated.frequencies is None:
        return harmonic_grid.HarmonicGrid.of(period, _in_band(spec, stated, period), watched=odd)
    wanted, half = np.array(stated.frequencies), np.pi / (period * step)
    lowest, highest = half * (1 - 1e-9), spec.nyquist - half * (1 - 1e-9)
    for at in np.flatnonzero((wanted < lowest) | (wanted > highest)).tolist():
        raise bad_spec(
            "out-of-range",
            f"{wanted[at]:.6g} {unit} is nearest to no harmonic of a period of {period} samples between 0 "
            "and the Nyquist frequency",
            hint=f"lines lie between {2 * half:.4g} and {spec.nyquist - half:.4g} {unit}; a longer period "
            "begins lower",
            key=f"{KEY}.frequencies[{at}]",
        )
    chosen = harmonic_grid.nearest_harmonics(period, wanted * step, odd=odd)
    for at in np.flatnonzero(np.diff(chosen) == 0).tolist():
        apart = (2 if odd else 1) * 2.0 * np.pi / (period * step)
        raise bad_spec(
            "too-few-lines",
            f"{wanted[at]:.6g} and {wanted[at + 1]:.6g} {unit} are the same line: with a period of {period} "
            f"samples lines are {apart:.3g} {unit} apart",
            hint="take a longer period, or drop one of the two",
            key=f"{KEY}.frequencies[{at + 1}]",
        )
    return harmonic_grid.HarmonicGrid.of(period, chosen, watched=odd)


def _in_band(spec: Spec, stated: FrequencyResponse, period: int) -> NDArray[np.int_]:
    """Return the lines that are asked for, or all harmonics but the silent ones; raise `too-few-lines`."""
    (lo, hi), step, group = spec.clip_band(stated.band), spec.sample_time, stated.detection
    candidates = stated.lines
    if group is not None and candidates is not None:
        candidates += (candidates - 1) // (group - 1)
    band, odd = (lo * step, hi * step), group is not None
    try:
        found = harmonic_grid.harmonics_between(period, band, candidates, odd=odd)
    except harmonic_grid.TooFewHarmonicsError as error:
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
    return harmonic_grid.thinned(found, group, np.random.default_rng(spec.signal.seed or 0))[: stated.lines]


def _longer(spec: Spec, period: int, band: tuple[float, float], lines: int | None, *, odd: bool) -> str:
    """Return the end of a hint: which period and experiment hold the lines; empty if none is found."""
    for longer in np.unique(np.ceil(period * np.geomspace(1.0, _LONGEST, _TRIED)).astype(int)).tolist():
        try:
            harmonic_grid.harmonics_between(longer, band, lines, odd=odd)
        except harmonic_grid.TooFewHarmonicsError:
            continue
        whole = longer * max(spec.experiment.samples // period, 1)
        lasts = whole * spec.sample_time
        return f": {longer} samples hold them, {whole} samples or {lasts:.6g} {spec.time_unit} in all"
    return ""


def build_response_task(spec: Spec) -> ResponseTask:
    """Return the task; everything that can be wrong with its spec or a table is reported here."""
    stated = spec.accuracy.frequency_response
    assert stated is not None
    _check_supported(spec)
    goal: Goal = "given" if not spec.designs else _GOALS[spec.goal]
    periods = build_periods(spec, stated)
    model = build_model(spec)
    grid = build_grid(spec, stated, periods.period)
    # The counted length is found where the shortest is asked for; all else is per sample of it.
    counted = (
        1 if goal == "samples" else periods.blocks * periods.kept(spec.experiment.samples) * periods.period
    )
    G = model.plant_at(grid.frequencies)
    if stated.noise is None:
        noise: NDArray[np.float64] = NoiseSpectrum.of(model).at(grid.period, grid.excited)
    else:
        noise = _tabulated(spec, stated.noise, grid.frequencies, "noise_spectrum", (model.outputs,))
    lines = ResponseLines(G, noise, _admitted(spec, stated, grid.frequencies, G), stated.relative)
    experiment = Experiment(model, counted)
    terms = ResponseTerms(
        header=build_header(spec),
        experiment=experiment,
        grid=grid,
        lines=lines,
        periods=periods,
        goal=goal,
        cost=build_cost(spec),
        limits=(*build_power_limits(spec), *implied_limits(spec)),
        tolerance=spec.solver.tolerance,
        asked=spec.experiment.samples,
        most_samples=spec.limits.samples,
        tabulated=stated.noise is not None,
    )
    record, simulation = build_record_request(spec, experiment.size), build_simulation(spec, experiment)
    check_compared(simulation.compare, "white")
    return ResponseTask(terms, _given(spec, grid), record, simulation)


def build_measurement(spec: Spec) -> Measurement:
    """Return the measurement of a frequency response by data: at the spec's lines, or the excited ones."""
    asked = spec.accuracy.frequency_response is not None
    return Measurement(
        header=build_header(spec),
        model=build_model(spec),
        terms=build_response_task(spec).terms if asked else None,
        operating_point=operating_point(spec),
    )


def _admitted(spec: Spec, stated: FrequencyResponse, w: Array, response: ComplexArray) -> NDArray[np.float64]:
    """Return r_adm (L, p, r), infinite where G is zero; raise `SpecError` (`admissible-not-positive`)."""
    G = np.abs(response)
    if stated.absolute is not None:
        return np.full(G.shape, stated.absolute)
    if stated.table is not None:
        return _tabulated(spec, stated.table, w, "r_adm", G.shape[1:]).reshape(G.shape)
    assert stated.relative is not None
    units, found = build_units(spec), stated.relative * G
    largest = G.max(axis=0)
    found[:, largest <= _ZERO * largest.max()] = np.inf
    for n, i, j in np.argwhere((_ZERO * largest >= G) & np.isfinite(found)).tolist():
        message = f"G{units.entry(i, j)} vanishes at {units.named(w[n])}: no share of it can be met"
        hint = f"leave the line out, or write {KEY}.absolute"
        raise bad_spec("admissible-not-positive", message, hint=hint, key=f"{KEY}.relative")
    if np.any(np.all(np.isinf(found), axis=(0, 1))):
        message = "an input moves no output, so that a share of |G| says nothing of its lines"
        hint = f"drop the input, or write {KEY}.absolute"
        raise bad_spec("admissible-not-positive", message, hint=hint, key=f"{KEY}.relative")
    return found


def _tabulated(spec: Spec, name: str, w: Array, column: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a column of a file at the lines (L, entries), or one column for each output or entry."""
    key = f"{KEY}.{'table' if column == 'r_adm' else 'noise'}"
    band = (float(w[0]), float(w[-1]))
    entries = int(np.prod(shape))
    single = entries == 1 or not has_column(spec.resolve_path(name), f"{column}_", key=key)
    if single:
        return np.repeat(positive_table(spec, name, band, column, key).at(w)[:, None], entries, axis=1)
    suffixes = ["_" + "".join(str(i + 1) for i in place) for place in np.ndindex(*shape)]
    return np.stack([positive_table(spec, name, band, f"{column}{s}", key).at(w) for s in suffixes], axis=1)


def _given(spec: Spec, grid: harmonic_grid.HarmonicGrid) -> Array | None:
    """Return the powers (L, 1) of a given multisine at the lines, or None; raise `SpecError`."""
    given = spec.given
    if given is None:
        return None
    if given.type != "multisine" or spec.plant.inputs > 1:
        what = "compute the deviations of a frequency response by this excitation"
        hint = "give {type: multisine, frequencies, amplitudes} of one input"
        raise refuse("spectrum.given", what=what, hint=hint)
    powers = np.zeros(grid.excited.size)
    for n, (frequency, amplitude) in enumerate(zip(given.frequencies, given.rows[0], strict=True)):
        place = frequency * spec.sample_time * grid.period / (2.0 * np.pi)
        if abs(place - np.rint(place)) > 1e-6 * place:
            raise bad_spec(
                "bad-period",
                f"{frequency:.6g} rad/{spec.time_unit} is no harmonic of a period of {grid.period} samples",
                hint="choose multiples of 2 pi over the duration of a period",
                key=f"spectrum.given.frequencies[{n}]",
            )
        powers[grid.excited == int(np.rint(place))] = 0.5 * amplitude**2
    silent = np.flatnonzero(powers <= 0.0)
    if silent.size:
        at = grid.frequencies[silent[0]] / spec.sample_time
        message = f"the given multisine has no power at the line {at:.6g} rad/{spec.time_unit}"
        hint = f"add it to spectrum.given, or leave it out of {KEY}"
        raise bad_spec("not-exciting", message, hint=hint, key="spectrum.given.frequencies")
    return powers[:, None]


def _check_supported(spec: Spec) -> None:
    """Refuse keys that are not supported for a frequency response, rather than ignore them."""
    others = {*spec.accuracy.requirements, *spec.accuracy.goals} - {"frequency_response"}
    if not spec.plant.sampled:
        what = "measure lines of a plant that is not sampled"
        raise refuse("plant", what=what, hint="add sample: zoh")
    if any(spec.noise.drifts):
        what = "measure lines in noise that drifts"
        raise refuse("noise.drift", what=what, hint="write a root of D inside the unit circle")
    if spec.spectrum is not None and spec.designs:
        what, hint = "take a family of spectra here", "remove spectrum: the lines follow from the accuracy"
        raise refuse("spectrum", what=what, hint=hint)
    remedies = {
        **{f"accuracy.{name}": "keep one of them" for name in sorted(others)},
        "experiment.controller": "remove the controller",
        "experiment.prior": "remove it",
        **dict.fromkeys(
            ("limits.energy", "limits.spectrum", "limits.moves"), "limit powers, amplitude or rate"
        ),
        "limits.band": f"state {KEY}.band",
        "solver.method": "remove method",
        "signal.type": "use multisine",
        **dict.fromkeys((f"signal.{name}" for name in _SIGNAL), "remove it"),
        "report.ellipses": "remove report",
        "uncertainty": ONE_PLANT,
    }
    handled = {"solver.method": ("exchange",), "signal.type": ("multisine",)}
    refuse_unhandled(spec, "frequency_response", remedies, handled)
