"""Build the question of `accuracy.frequency_response` from its spec, and check it before it is computed."""

from __future__ import annotations

from contextlib import suppress

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
from inputdesign_cli.questions.building.model_error import positive_table
from inputdesign_cli.questions.building.signal_settings import build_record_request
from inputdesign_cli.questions.building.spectra import build_power_limits, implied_limits
from inputdesign_cli.questions.building.system import GOALS, build_cost, build_model
from inputdesign_cli.questions.building.tables import has_column
from inputdesign_cli.questions.building.uncertainty import build_simulation
from inputdesign_cli.questions.building.unhandled import ONE_PLANT, check_compared, refuse_unhandled
from inputdesign_cli.questions.frequency_response.measure import Measurement
from inputdesign_cli.questions.frequency_response.solve import KEY, ResponseTask
from inputdesign_cli.signal import harmonic_grid
from inputdesign_cli.specification import FrequencyResponse, Spec
from inputdesign_cli.specification.models.sizes import most

_ZERO, _SAMPLES = 1e-12, "experiment.samples"
# For a hint, periods up to this multiple are tried, and no more than this number of them.
_LONGEST, _TRIED = 1e3, 400
# Periods of a block after the transient, if none are stated: their scatter shows the noise.
_COUNTED = 4
_SIGNAL = (
    *("hold", "lines", "amplitudes", "ramp", "bits", "quantisation", "scale", "order"),
    *("samples", "start"),
)
_REMEDIES = {
    "experiment.controller": "remove the controller",
    "experiment.prior": "remove it",
    **dict.fromkeys(("limits.energy", "limits.spectrum"), "limit powers, amplitude or rate"),
    "limits.band": f"state {KEY}.band",
    "solver.method": "remove method",
    "signal.type": "use multisine",
    **{f"signal.{name}": "remove it" for name in _SIGNAL},
    "report.ellipses": "remove report",
    "uncertainty": ONE_PLANT,
}
_HANDLED = {"solver.method": ("exchange",), "signal.type": ("multisine",)}


def build_response_task(spec: Spec) -> ResponseTask:
    """Return the task; everything that can be wrong with its spec or a table is reported here."""
    stated = spec.accuracy.frequency_response
    assert stated is not None
    _check_supported(spec)
    goal: Goal = "given" if not spec.designs else GOALS[spec.goal]
    periods = _periods(spec, stated, shortest=goal == "samples")
    model = build_model(spec)
    grid = _grid(spec, stated, periods.period)
    G = model.plant_at(grid.frequencies)
    noise: NDArray[np.float64] = (
        NoiseSpectrum.of(model).at(grid.period, grid.excited)
        if stated.noise is None
        else _tabulated(spec, stated.noise, grid.frequencies, "noise_spectrum", (model.outputs,))
    )
    # For the shortest experiment the counted length is sought, and the experiment has one sample.
    counted = periods.blocks * periods.kept(spec.experiment.samples) * periods.period
    experiment = Experiment(model, 1 if goal == "samples" else counted)
    simulation = build_simulation(spec, experiment)
    check_compared(simulation.compare, "white")
    return ResponseTask(
        header=build_header(spec),
        experiment=experiment,
        grid=grid,
        lines=ResponseLines(G, noise, _admitted(spec, stated, grid, G), stated.relative),
        periods=periods,
        goal=goal,
        cost=build_cost(spec),
        limits=(*build_power_limits(spec), *implied_limits(spec)),
        tolerance=spec.solver.tolerance,
        asked=spec.experiment.samples,
        tabulated=stated.noise is not None,
        record=build_record_request(spec, experiment.size),
        given=_given(spec, grid),
        simulation=simulation,
    )


def build_measurement(spec: Spec) -> Measurement:
    """Return the measurement of a frequency response by data: at the spec's lines, or the excited ones."""
    asked = spec.accuracy.frequency_response is not None
    return Measurement(
        header=build_header(spec),
        model=build_model(spec),
        terms=build_response_task(spec) if asked else None,
        operating_point=operating_point(spec),
    )


def _check_supported(spec: Spec) -> None:
    """Refuse keys that are not supported for a frequency response, rather than ignore them."""
    others = {*spec.accuracy.requirements, *spec.accuracy.goals} - {"frequency_response"}
    if not spec.plant.sampled:
        raise refuse("plant", what="measure lines of a plant that is not sampled", hint="add sample: zoh")
    if any(spec.noise.drifts):
        hint = "write a root of D inside the unit circle"
        raise refuse("noise.drift", what="measure lines in noise that drifts", hint=hint)
    if spec.spectrum is not None and spec.designs:
        hint = "remove spectrum: the lines follow from the accuracy"
        raise refuse("spectrum", what="take a family of spectra here", hint=hint)
    remedies = {**{f"accuracy.{name}": "keep one of them" for name in sorted(others)}, **_REMEDIES}
    refuse_unhandled(spec, "frequency_response", remedies, _HANDLED)


def _periods(spec: Spec, stated: FrequencyResponse, *, shortest: bool) -> Periods:
    """Return the repetition of the record; raise `bad-period` unless whole periods fit into it."""
    blocks, samples, repeated = spec.plant.inputs, spec.experiment.samples, spec.signal.periods
    if stated.period is None and shortest:
        message = "the length of the experiment is sought, so that the period of its lines must be given"
        hint = f"add {KEY}.period: the time that resolves the lines, in samples"
        raise bad_spec("missing-key", message, hint=hint, key=KEY)
    if stated.period is None:
        times = (repeated or blocks * (stated.transient + _COUNTED)) // blocks
        period = samples // (blocks * max(times, 1))
    else:
        period, times = stated.period, samples // (blocks * stated.period)
        if repeated is not None and repeated != blocks * times and not shortest:
            held = f"{samples} samples hold {blocks * times} periods of {period}"
            message = f"signal.periods is {repeated}, and {held}"
            hint = f"give one of signal.periods and {KEY}.period"
            raise bad_spec("conflicting-keys", message, hint=hint, key="signal.periods")
    if not shortest and times <= stated.transient:
        each = f" for each of {blocks} inputs" if blocks > 1 else ""
        left = f"{stated.transient} are left to the transient: none counts"
        key, hint = "signal.periods", f"write {blocks * (stated.transient + 1)} or more, without {KEY}.period"
        if repeated is None:
            enough = blocks * (stated.transient + 2) * period
            key, hint = f"{KEY}.period", f"take {enough} samples or more, or a shorter period"
        raise bad_spec("bad-period", f"the record has {times} periods{each}, and {left}", hint=hint, key=key)
    if period < 3:
        message = f"a period of {period} samples has no harmonic between 0 and the Nyquist frequency"
        key, fewer = ("signal.periods", "fewer periods") if repeated else (_SAMPLES, "a shorter transient")
        hint = f"take {3 * blocks * times} samples or more, or {fewer}"
        raise bad_spec("bad-period", message, hint=hint, key=key)
    longest = most("signal.samples")
    if not shortest and blocks * times * period > longest:
        message = f"the record has {blocks * times * period} samples, and at most {longest} are computed"
        hint = f"write {_SAMPLES}: {longest} or less"
        raise bad_spec("too-large", message, hint=hint, key=_SAMPLES)
    return Periods(period, blocks, stated.transient)


def _grid(spec: Spec, stated: FrequencyResponse, period: int) -> harmonic_grid.HarmonicGrid:
    """Return the lines and the silent ones; raise `SpecError` (`too-few-lines`, `out-of-range`)."""
    step, unit, odd = spec.sample_time, f"rad/{spec.time_unit}", stated.detection is not None
    if stated.frequencies is None:
        return harmonic_grid.HarmonicGrid.of(period, _in_band(spec, stated, period), watched=odd)
    wanted, half = np.array(stated.frequencies), np.pi / (period * step)
    for at in np.flatnonzero(np.abs(wanted - 0.5 * spec.nyquist) > 0.5 * spec.nyquist - half * (1 - 1e-9)):
        between = f"no harmonic of a period of {period} samples between 0 and the Nyquist frequency"
        ends = f"{2 * half:.4g} and {spec.nyquist - half:.4g} {unit}"
        hint = f"lines lie between {ends}; a longer period begins lower"
        message = f"{wanted[at]:.6g} {unit} is nearest to {between}"
        raise bad_spec("out-of-range", message, hint=hint, key=f"{KEY}.frequencies[{at}]")
    chosen = harmonic_grid.nearest_harmonics(period, wanted * step, odd=odd)
    for at in np.flatnonzero(np.diff(chosen) == 0):
        apart = f"lines are {(2 if odd else 1) * 2.0 * half:.3g} {unit} apart"
        same = f"{wanted[at]:.6g} and {wanted[at + 1]:.6g} {unit} are the same line"
        message = f"{same}: with a period of {period} samples {apart}"
        hint = "take a longer period, or drop one of the two"
        raise bad_spec("too-few-lines", message, hint=hint, key=f"{KEY}.frequencies[{at + 1}]")
    return harmonic_grid.HarmonicGrid.of(period, chosen, watched=odd)


def _in_band(spec: Spec, stated: FrequencyResponse, period: int) -> NDArray[np.int_]:
    """Return the lines that are asked for, or all harmonics but the silent ones; raise `too-few-lines`."""
    lo, hi = (edge * spec.sample_time for edge in spec.clip_band(stated.band))
    group, lines, odd = stated.detection, stated.lines, stated.detection is not None
    if group is not None and lines is not None:
        lines += (lines - 1) // (group - 1)  # with the silent ones
    try:
        found = harmonic_grid.harmonics_between(period, (lo, hi), lines, odd=odd)
    except harmonic_grid.TooFewHarmonicsError as error:
        there = f"{error.there} {'odd ' if odd else ''}harmonics of a period of {period} samples"
        asked = "at least one is" if lines is None else f"{lines} are"
        silent = ", with the silent lines that show a nonlinearity" if lines != stated.lines else ""
        message = f"the band holds {there}, and {asked} asked for{silent}"
        enough = _longer(spec, period, (lo, hi), lines, odd=odd)
        longer = f"a longer period (more samples, or fewer periods{enough})"
        hint = f"take {longer}, fewer lines, or a higher end of the band"
        key = f"{KEY}.band" if lines is None else f"{KEY}.lines"
        raise bad_spec("too-few-lines", message, hint=hint, key=key) from None
    if group is None:
        return found
    return harmonic_grid.thinned(found, group, np.random.default_rng(spec.signal.seed or 0))[: stated.lines]


def _longer(spec: Spec, period: int, band: tuple[float, float], lines: int | None, *, odd: bool) -> str:
    """Return the end of a hint: the shortest period that holds the lines, and its experiment, or nothing."""
    for longer in np.unique(np.ceil(period * np.geomspace(1.0, _LONGEST, _TRIED)).astype(int)).tolist():
        with suppress(harmonic_grid.TooFewHarmonicsError):
            harmonic_grid.harmonics_between(longer, band, lines, odd=odd)
            whole = longer * max(spec.experiment.samples // period, 1)
            lasts = whole * spec.sample_time
            return f": {longer} samples hold them, {whole} samples or {lasts:.6g} {spec.time_unit} in all"
    return ""


def _admitted(
    spec: Spec, stated: FrequencyResponse, grid: harmonic_grid.HarmonicGrid, response: ComplexArray
) -> NDArray[np.float64]:
    """Return r_adm (L, p, r), infinite where G is zero; raise `SpecError` (`admissible-not-positive`)."""
    w, G = grid.frequencies, np.abs(response)
    if stated.absolute is not None:
        return np.full(G.shape, stated.absolute)
    if stated.table is not None:
        return _tabulated(spec, stated.table, w, "r_adm", G.shape[1:]).reshape(G.shape)
    assert stated.relative is not None
    units, found, largest = build_units(spec), stated.relative * G, G.max(axis=0)
    found[:, largest <= _ZERO * largest.max()] = np.inf
    message = ""
    for n, i, j in np.argwhere((_ZERO * largest >= G) & np.isfinite(found))[:1]:
        message = f"G{units.entry(i, j)} vanishes at {units.named(w[n])}: no share of it can be met"
        hint = f"leave the line out, or write {KEY}.absolute"
    if not message and np.any(np.all(np.isinf(found), axis=(0, 1))):
        message = "an input moves no output, so that a share of |G| says nothing of its lines"
        hint = f"drop the input, or write {KEY}.absolute"
    if message:
        raise bad_spec("admissible-not-positive", message, hint=hint, key=f"{KEY}.relative")
    return found


def _tabulated(spec: Spec, name: str, w: Array, column: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a column of a file at the lines (L, entries), or one column for each output or entry."""
    key = f"{KEY}.{'table' if column == 'r_adm' else 'noise'}"
    places = list(np.ndindex(*shape))
    single = len(places) == 1 or not has_column(spec.resolve_path(name), f"{column}_", key=key)
    suffixes = [""] if single else ["_" + "".join(str(i + 1) for i in place) for place in places]
    band = (float(w[0]), float(w[-1]))
    values = [positive_table(spec, name, band, f"{column}{suffix}", key).at(w) for suffix in suffixes]
    return np.broadcast_to(np.stack(values, axis=1), (w.size, len(places)))


def _given(spec: Spec, grid: harmonic_grid.HarmonicGrid) -> Array | None:
    """Return the powers (L, 1) of a given multisine at the lines, or None; raise `SpecError`."""
    given, unit = spec.given, f"rad/{spec.time_unit}"
    if given is None:
        return None
    if spec.plant.inputs > 1:
        hint = "remove spectrum.given, so that lines are designed; or take a plant with one input"
        raise refuse("spectrum.given", "analyse given lines of a plant with several inputs", hint)
    if given.type != "multisine":
        hint = "give {type: multisine, frequencies, amplitudes}"
        raise refuse("spectrum.given", "compute a frequency response by this excitation", hint)
    places = np.array(given.frequencies) * spec.sample_time * grid.period / (2.0 * np.pi)
    for n in np.flatnonzero(np.abs(places - np.rint(places)) > 1e-6 * places):
        message = f"{given.frequencies[n]:.6g} {unit} is no harmonic of a period of {grid.period} samples"
        hint = "choose multiples of 2 pi over the duration of a period"
        raise bad_spec("bad-period", message, hint=hint, key=f"spectrum.given.frequencies[{n}]")
    of = dict(zip(np.rint(places).astype(int).tolist(), 0.5 * np.square(given.rows[0]), strict=True))
    powers = np.array([of.get(harmonic, 0.0) for harmonic in grid.excited.tolist()])
    for at in grid.frequencies[powers <= 0.0] / spec.sample_time:
        message = f"the given multisine has no power at the line {at:.6g} {unit}"
        hint = f"add it to spectrum.given, or leave it out of {KEY}"
        raise bad_spec("not-exciting", message, hint=hint, key="spectrum.given.frequencies")
    return powers[:, None]
