"""Design -> the record to be applied."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement, criterion_of, least_ratios, worst_ratio
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.demands import FEW
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.limits import Weight, weights_of
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.finding import Finding
from inputdesign_cli.information import Experiment, FiniteRecord, FiniteRecords, PowerKind
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.searched_record import LevelSearch, searches
from inputdesign_cli.signal.evaluation import MET, Target, least_level
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.limits import Bounds, limited_responses, peak_share
from inputdesign_cli.signal.lines import DesignedSpectrum
from inputdesign_cli.signal.selection import Record, best_record
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.spectrum import Basis, TabulatedSpectrum

_TAKES_PART = 1e-6
# A record whose extra cost exceeds this multiple of the design's cost no longer follows the design.
_HOPELESS = 1e3
# A dead time above this share of the record explains that.
_LATE = 0.8

Family = Basis | TabulatedSpectrum
T = TypeVar("T")


@dataclass(frozen=True)
class RecordRequest:
    """Describes the record that a spec asks for, of `samples` samples (None: as the experiment).

    If it `meets`, the record itself keeps the accuracy; else it has the power of the design. A length that is
    sought is at most `most_samples`. No record of more than `longest` samples is computed.

    Args:
        bounds: bounds on the samples of the record, on the outputs that it causes, and on powers.
        band: frequencies of the excitation, in rad per sample.
        step: time between samples, in the unit of the experiment.
        limit_keys: the keys of the spec that limit single samples, for messages.
        others: settings of other kinds of signals, for a kind that does not fit.
        operating_points: levels (r,) added to each input.
        also: files beside signal.csv: "mat", "npz", "h", "wav", "step_table".
        full_scale: the value at full scale of signal.wav; None: the largest value.
    """

    settings: SignalSettings
    bounds: Bounds
    cost: Mapping[PowerKind, Weight]
    units: Units
    band: tuple[float, float] = (0.0, np.pi)
    step: float = 1.0
    samples: int | None = None
    meets: bool = True
    most_samples: int | None = None
    longest: int = 2**20
    limit_keys: tuple[str, ...] = ()
    stated_method: bool = False
    others: tuple[SignalSettings, ...] = ()
    operating_points: Array | None = None
    also: tuple[str, ...] = ()
    full_scale: float | None = None
    sampling_rate: float = 1.0

    def length(self, experiment: int) -> int:
        """Return the samples of the record of an experiment of this length: whole periods of held values."""
        block = self.settings.block
        return -(-(self.samples or experiment) // block) * block

    @property
    def searched(self) -> bool:
        """Return whether other records are searched for, as one that misses the accuracy is no answer."""
        return self.bounds.hard and self.settings.level is None

    def feasible(self, experiment: int, least: int) -> bool:
        """Return whether a record of this length is computed, with at least `least` values a period."""
        samples = self.length(experiment)
        return samples <= self.longest and self.settings.period(samples) >= least


@dataclass(frozen=True)
class Made:
    """Holds a record with its request and the design whose spectrum it has.

    `input_power` limits that design, where it is not the one that was asked for.
    """

    record: Record | None
    request: RecordRequest
    design: Design
    input_power: float | None = None
    findings: tuple[Finding, ...] = ()


def make_record(
    request: RecordRequest, design: Design, experiment_samples: int, *, first: bool = False
) -> Record | None:
    """Return the best of several records of the designed spectrum, or the `first` that meets what is asked.

    The best record meets the requirements of every scenario with the least power, or has the best criterion
    at its worst plant. None: no excitation is needed, or the record would be too short or too long.
    """
    problem, settings = design.problem, request.settings
    # In the coordinates of this design, which its requirements use too.
    experiment = problem.experiment.with_samples(experiment_samples)
    samples = request.length(experiment_samples)
    if not (design.result.x.any() and request.feasible(experiment_samples, least_period(experiment.inputs))):
        return None
    bounds = _with_powers(request.bounds, design)
    meets = problem.goal != "factor" and request.meets
    plants = [scenario.experiment.with_samples(experiment.samples) for scenario in problem.scenarios]
    scores = [_score(scenario.requirements) for scenario in problem.scenarios]
    bounding = [least_ratios(scenario.requirements) for scenario in problem.scenarios]
    spectrum = spectrum_of(request, design.result.basis, design.result.x)
    limited = partial(limited_responses, experiment, bounds, request.step, settings.hold)
    generator = SignalGenerator(spectrum, settings, samples, request.band, limited)
    others = {n: FiniteRecord(plant, samples, request.step) for n, plant in enumerate(plants)}

    def beyond_peaks(record: Array, which: Iterable[int]) -> list[int]:
        return _worst_few({n: peak_share(others[n], bounds, record) for n in which}, MET)

    shares, limiting = design.result.certificate.shares, [0]
    # The nominal plant, and the scenarios that bind the design.
    numbers = [n for n, share in enumerate(shares) if n == 0 or share > _TAKES_PART]
    if len(plants) > 1 and bounds.hard:  # plants that answer most to one record do so to others
        one = generator.values(np.random.default_rng(settings.seed))
        limiting += beyond_peaks(np.repeat(one, settings.hold, axis=0), range(1, len(plants)))

    def together(which: Sequence[int]) -> FiniteRecord:
        if len(plants) == 1:
            return others[0]
        return FiniteRecords(experiment, samples, request.step, others=tuple(plants[n] for n in which if n))

    score, bound = scores[0], bounding[0]
    if len(plants) > 1:
        score, bound = partial(_largest, scores, numbers), partial(_largest_of_each, bounding, numbers)
    cost = design_cost(design, request.cost)
    target = Target(score, meets, request.cost, cost, bound if meets else None)
    while True:
        at, limits = together(numbers), together(limiting)
        record = best_record(generator, at, target, bounds, first=first, limiting=limits)
        least = max(record.worst_ratio, MET) if meets else record.worst_ratio
        left = [n for n in range(len(plants)) if n not in numbers]
        missed = _worst_few({n: ratio_at(others[n], scores[n], record.samples) for n in left}, least)
        beyond = _worst_few(
            {n: _power_share(others[n], bounds.powers, record.samples) for n in left if n not in missed}, MET
        )
        higher = beyond_peaks(record.samples, [n for n in others if n not in limiting])
        if not (missed or beyond or higher):
            if problem.goal != "samples" and searches(design, settings):
                return _searched(request, design, record)
            return record if _few_moves(bounds, record) else replace(record, met=False)
        numbers += [*missed, *beyond]
        limiting += higher


def _largest(
    of: Sequence[Callable[[Array], float]], numbers: Sequence[int], informations: NDArray[np.float64]
) -> float:
    """Return the largest value at the plants of these numbers, from their information (plants, k, k)."""
    return max(_at_each(of, numbers, informations))


def _largest_of_each(
    of: Sequence[Callable[[Array], Array]], numbers: Sequence[int], informations: NDArray[np.float64]
) -> Array:
    """Return the largest values (runs,) at these plants, from their information (plants, runs, k, k)."""
    return np.asarray(np.max(_at_each(of, numbers, informations), axis=0))


def _at_each(
    of: Sequence[Callable[[Array], T]], numbers: Sequence[int], informations: NDArray[np.float64]
) -> list[T]:
    """Return the values at the plants of these numbers, from their information (plants, .., k, k)."""
    return [of[n](M) for n, M in zip(numbers, informations, strict=True)]


def _with_powers(bounds: Bounds, design: Design) -> Bounds:
    """Return the bounds with the upper limits of a design on powers."""
    upper = (
        (limit.kind, limit.channel, limit.bound)
        for limit in design.problem.limits
        if limit.upper and limit.scenario == 0 and limit.kind != "moves"  # single moves are limited already
    )
    return replace(bounds, powers=tuple(upper))


def level_search(request: RecordRequest, design: Design) -> LevelSearch:
    """Return the search for records of a few levels within the limits of the request, at every plant."""
    bounds, scenarios = _with_powers(request.bounds, design), design.problem.scenarios

    def cost(samples: Array) -> float:
        plant = plants(len(samples))[0]
        each = ((np.asarray(weight), kind) for kind, weight in request.cost.items())
        return float(sum(np.sum(weight * plant.mean_squares(kind, samples)) for weight, kind in each))

    @cache
    def plants(samples: int) -> list[FiniteRecord]:
        each = (scenario.experiment.with_samples(samples) for scenario in scenarios)
        return [FiniteRecord(plant, samples, request.step) for plant in each]

    def allowed(samples: Array) -> bool:
        if max(bounds.shares(samples).values(), default=0.0) > MET:
            return False
        each = plants(len(samples))
        powers = max(_power_share(plant, bounds.powers, samples) for plant in each)
        return powers <= MET and max(peak_share(plant, bounds, samples) for plant in each) <= MET

    others = bounds.output is not None or bounds.rate is not None
    depends = any(design.problem.experiment.depends_on_plant(kind) for kind, _, _ in bounds.powers)
    squares = np.zeros(1) if bounds.amplitude is None else bounds.amplitude**2
    affordable = all(
        (squares.sum() if channel is None else squares[channel]) <= most * MET
        for _, channel, most in bounds.powers
    )
    plain = affordable and not (others or depends or bounds.quantisers)
    amplitude = bounds.amplitude if plain else None
    return LevelSearch(
        design,
        request.settings,
        plants,
        cost,
        amplitude,
        allowed if others or depends or bounds.moves is not None else None,
        bounds.most_moves,
    )


def _searched(request: RecordRequest, design: Design, record: Record) -> Record:
    """Return the best record of a few levels that a search finds, at the level that it needs."""
    search = level_search(request, design)
    samples = search.best(record.samples)
    found = of_samples(request, search, record, samples)
    kept = _few_moves(request.bounds, record)
    if design.problem.goal == "factor" or found.worst_ratio > MET:
        if kept and record.worst_ratio <= found.worst_ratio:
            return record
        return replace(found, met=design.problem.goal == "factor")
    if not request.bounds.quantisers:
        of_level = partial(of_samples, request, search, record)
        level = least_level(lambda level: of_level(level * samples).worst_ratio, 1.0)
        found = of_level(min(level, 1.0) * samples)
    cheaper = not (kept and record.met) or found.extra_power < record.extra_power
    return replace(found, met=True) if cheaper else record


def _few_moves(bounds: Bounds, record: Record) -> bool:
    """Return whether a record has no more moves than allowed."""
    return bounds.shares(record.samples).get("moves", 0.0) <= MET


def of_samples(request: RecordRequest, search: LevelSearch, record: Record, samples: Array) -> Record:
    """Return a record with the samples (n, r) that a search has found, their worst ratio and cost."""
    scores = [_score(scenario.requirements) for scenario in search.design.problem.scenarios]
    each = zip(search.plants(len(samples)), scores, strict=True)
    worst = max(ratio_at(plant, score, samples) for plant, score in each)
    extra = search.cost(samples) / design_cost(search.design, request.cost) - 1.0
    return replace(record, samples=samples, worst_ratio=worst, extra_power=extra)


def _worst_few(figures: Mapping[int, float], most: float) -> list[int]:
    """Return the numbers of the few largest above `most`: a record for these serves most of the others."""
    return sorted((n for n, figure in figures.items() if figure > most), key=lambda n: -figures[n])[:FEW]


def peak_at(request: RecordRequest, design: Design, record: Record) -> Callable[[Experiment], float] | None:
    """Return the largest share of a sample limit that a record uses at a plant; None: same for all."""
    bounds, n = request.bounds, len(record.samples)
    if bounds.output is None and (design.problem.experiment.loop is None or not bounds.hard):
        return None

    def share(plant: Experiment) -> float:
        return peak_share(FiniteRecord(plant.with_samples(n), n, request.step), bounds, record.samples)

    return share


def ratio_at(plant: FiniteRecord, score: Callable[[Array], float], record: Array) -> float:
    """Return the score of a record (n, r) at a plant; infinite if it does not excite every parameter."""
    try:
        return score(plant.information(record))
    except np.linalg.LinAlgError:
        return np.inf


def _power_share(
    plant: FiniteRecord, limits: Sequence[tuple[PowerKind, int | None, float]], record: Array
) -> float:
    """Return the largest share of a power limit that a record uses at a plant, where it depends on it."""
    powers = {
        kind: plant.mean_squares(kind, record)
        for kind, _, _ in limits
        if plant.experiment.depends_on_plant(kind)
    }
    used = (
        float(powers[kind].sum() if channel is None else powers[kind][channel]) / most
        for kind, channel, most in limits
        if kind in powers
    )
    return max(used, default=0.0)


def ratio_before(design: Design, step: float) -> float:
    """Return the worst ratio that information without excitation gives, at the plant where it is worst."""
    ratios = []
    for scenario in design.problem.scenarios:
        silent = FiniteRecord(scenario.experiment.with_samples(1), 1, step)
        without = silent.information(np.zeros((1, 1, scenario.experiment.inputs)))
        ratios += least_ratios(scenario.requirements)(without).tolist()
    return np.inf if np.isnan(ratios).any() else max(ratios)


def as_long(request: RecordRequest, experiment: Experiment) -> int | None:
    """Return samples of records as long as the experiment, in whole periods; None if none are computed."""
    whole = replace(request, samples=None)
    inputs, samples = experiment.inputs, experiment.samples
    return whole.length(samples) if whole.feasible(samples, least_period(inputs)) else None


def redrawn(request: RecordRequest, basis: Family, x: Array, samples: int) -> Redrawn:
    """Return a generator of other records of a spectrum, of this length, with uniform phases."""
    settings = request.settings
    if settings.phases != "random":
        settings = replace(settings, phases="orthogonal")
    generator = SignalGenerator(spectrum_of(request, basis, x), settings, samples, request.band)
    return Redrawn("design", generator, basis, x)


def given_record(
    request: RecordRequest, experiment: Experiment, basis: Family, x: Array, ratio: Callable[[Array], float]
) -> Record | None:
    """Return a record of a given spectrum, of its power as far as limits allow; None if too short or long."""
    settings = replace(request.settings, candidates=1, most_candidates=1)
    samples = request.length(experiment.samples)
    if not request.feasible(experiment.samples, least_period(experiment.inputs)):
        return None
    limited = partial(limited_responses, experiment, request.bounds, request.step, settings.hold)
    spectrum = spectrum_of(request, basis, x)
    generator = SignalGenerator(spectrum, settings, samples, request.band, limited)
    plant = FiniteRecord(experiment, samples, request.step)
    return best_record(generator, plant, Target(ratio), request.bounds)


def spectrum_of(request: RecordRequest, basis: Family, x: Array) -> DesignedSpectrum:
    """Return a spectrum for values that are a `step` of the request apart."""
    return DesignedSpectrum.of(basis, x, inputs=basis.inputs, step=request.step)


def least_period(inputs: int) -> int:
    """Return the fewest values of a period: two, and with several inputs eight in the block of each."""
    return 2 if inputs == 1 else 8 * inputs


def _score(requirements: Sequence[Requirement]) -> Callable[[Array], float]:
    """Return the score that ranks records: a criterion, negated, or the worst ratio of requirements."""
    criterion = criterion_of(requirements)
    if criterion is None:
        return worst_ratio(requirements)
    return lambda information: -criterion.level(information)


def design_cost(design: Design, weights: Mapping[PowerKind, Weight]) -> float:
    """Return the cost of the powers of a design at these weights."""
    at, x = design.problem.on(design.result.basis), design.result.x
    return sum(weight * at.power(kind, channel).at(x) for kind, channel, weight in weights_of(weights))


def refuse_too_short(request: RecordRequest, experiment: Experiment, record: Record) -> None:
    """Raise `InfeasibleError` (`record-too-short`) if dead times take nearly all of a record."""
    size = len(record.samples)
    late = experiment.memory > _LATE * size * request.step
    undetermined = not np.isfinite(record.worst_ratio)
    if not (request.meets and late and (undetermined or record.extra_power > _HOPELESS)):
        return
    times = f"costs {1.0 + record.extra_power:.2g} times what the designed spectrum does"
    what = "determines all parameters" if undetermined else f"meets the accuracy at a fair price: one {times}"
    message = f"no record of {size} samples {what}; the dead time takes too many of them"
    key = "experiment.samples" if request.samples is None else "signal.samples"
    section = key.partition(".")[0]
    enough = max(2 * size, int(np.ceil(experiment.memory / (_LATE * request.step))))
    hint = f"take more samples, {request.units.length(enough, section)} or more; or look at time_unit"
    raise InfeasibleError.because("record-too-short", message, hint, key)


def no_record(request: RecordRequest, samples: int, best: str, hint: str) -> InfeasibleError:
    """Return the error `limits-too-tight`: what the best record of this length reaches."""
    keys = request.limit_keys or ("limits.samples",)
    message = f"no record of {samples} samples within {' and '.join(keys)} was found that {best}"
    return InfeasibleError.because("limits-too-tight", message, hint, keys[0])
