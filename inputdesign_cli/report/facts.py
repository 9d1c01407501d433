"""A result in words, one fact a line: the same in the terminal and on a page."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.outcome import ClosedLoopError, Loop, MeasuredLines, Objective, Outcome, Robust, Signal
from inputdesign_cli.outcome.design import Coverage
from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.outcome.robust import ActivePlant, FreshPlants, SearchedPlant
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.report.numbers import Fact, enumerated, precise, shown, spoken

# Smaller relative gaps differ from machine to machine.
_CLOSED = 1e-6
# A plant whose ratio is larger by no more than this share errs as much as the binding plants.
_AS_MUCH = 1e-4
# An exact confidence is exceeded if more than this share is kept beyond what was asked.
_ROOM = 0.005
# Smaller shares of cost and accuracy are not worth a word.
_LITTLE_LESS, _LITTLE_MORE = 5e-4, 5e-5
_SHORT = {"fir": "FIR"}
# The status of an excitation that was given, in words.
GIVEN = {"given": "", "met": ": it meets the accuracy", "missed": ": it misses the accuracy"}


def facts(outcome: Outcome, time_unit: str) -> Iterator[Fact]:
    """Yield what an experiment costs and what accuracy it gives, as far as the result has the numbers."""
    yield from _value_and_cost(outcome)
    yield from _power_and_limits(outcome)
    yield from _accuracy(outcome, time_unit)
    if outcome.robust is not None:
        yield from _robust(outcome.robust, outcome.objective)
    error = outcome.mean_squared_error
    if error is not None:
        parts = f"squared bias {error.bias_squared:.6g} + variance {error.variance:.6g}"
        yield "error", f"{error.value:.6g} = {parts}", ""
    information = outcome.information
    deviations = None if information is None else information.standard_deviation
    if deviations and outcome.status in GIVEN and outcome.identification is None:
        yield "std", ", ".join(f"{name} {value:.4g}" for name, value in deviations.items()), ""
    if outcome.signal is not None:
        yield "signal", ", ".join(_signal(outcome, outcome.signal)), ""
    simulation = outcome.simulation
    if simulation is not None and simulation.improvement is not None:
        measured, theory = 100 * simulation.improvement.measured, 100 * simulation.improvement.theory
        yield "improvement", f"{measured:.1f} % better than white (theory {theory:.1f} %)", ""


def _value_and_cost(outcome: Outcome) -> Iterator[Fact]:
    found, cost = outcome.objective, "cost" if outcome.moments is None else "energy"
    kind = None if found is None else found.kind
    if found is not None:
        name = cost if kind == "least_cost" else objective(kind).name
        value, by = shown(found.value), _paid(outcome)
        if kind == "shortest_experiment":
            value, by = str(length(outcome)), f"by the spectrum alone {value}"
        yield name, value, "; ".join(filter(None, [by, white(outcome)]))
    if outcome.closed_loop_error is not None:
        yield _of_structure(outcome.closed_loop_error)
    if kind != "least_cost" and outcome.cost is not None:
        yield cost, shown(outcome.cost), ""


def length(outcome: Outcome) -> int | None:
    """Return the samples of the record, or of the experiment if there is no record."""
    return outcome.samples if outcome.signal is None else outcome.signal.samples


def _power_and_limits(outcome: Outcome) -> Iterator[Fact]:
    power = outcome.power
    if power is not None:
        kinds = (("input", power.input), ("output", power.output), ("excitation", power.excitation))
        powers = ", ".join(f"{name} {enumerated(values)}" for name, values in kinds if values is not None)
        yield "power", powers, "at the plant of the spec" if _paid(outcome) else ""
    limits = "; ".join(_limits(outcome))
    if limits:
        yield "limits", limits, ""


def _accuracy(outcome: Outcome, time_unit: str) -> Iterator[Fact]:
    error = outcome.model_error
    if error is not None and error.worst_ratio is not None:
        at = "" if error.worst_frequency is None else f" at {error.worst_frequency:.4g} rad/{time_unit}"
        of = "" if outcome.robust is None else "at the plant of the spec"
        yield "model error", f"r_u / r_adm at most {error.worst_ratio:.6g}{at}", of
    assessed = () if outcome.assessment is None else outcome.assessment.requirements
    for requirement in outcome.requirements if outcome.requirements is not None else assessed:
        if requirement.loop is not None:
            yield _loop(requirement.loop, time_unit)
    lines = outcome.frequency_response
    if lines is not None and lines.worst_ratio is not None:
        yield _lines(lines, time_unit)
    if error is not None and error.confidence is not None:
        yield _kept(error.confidence, error.alpha)


def _of_structure(found: ClosedLoopError) -> Fact:
    """The error of the loop by the covariance of the model structure, with the design and white input."""
    design, white_input = (found.parametric[name] for name in ("design", "white"))
    saved = 1.0 - design.loss.mean / white_input.loss.mean
    less = f"mean loss {per_cent(abs(saved))} {'less' if saved >= 0.0 else 'more'} with the design"
    times = f"{white_input.value / design.value:.3g} times as much"
    compared = f"white excitation: {shown(white_input.value)}, {times}; {less}"
    return "for this structure", shown(design.value), compared


def _kept(found: Coverage, alpha: float | None) -> Fact:
    """How many estimates meet the bounds: from simulated experiments, or drawn by asymptotic theory."""
    share = _share(found.exact, found.exact_limits)
    text = f"{share} of {found.draws} estimates drawn by asymptotic theory meet it"
    if found.kept is not None and found.kept_limits is not None:
        beyond = found.kept_limits[0] > (found.asked or 0.0) + _ROOM
        more = ", more than asked: it costs more than it need" if beyond else ""
        text = f"{_share(found.kept, found.kept_limits)} of {found.runs} simulated experiments meet it{more}"
    chi_squared = f"chi-squared would take alpha {found.chi_squared_alpha or 0.0:.4g}, not {alpha:.4g}"
    return "confidence", text, f"asked {100 * (found.asked or 0.0):g} %; {chi_squared}"


def _share(value: float, limits: tuple[float, float]) -> str:
    low, high = (f"{100 * limit:.1f}" for limit in limits)
    return f"{100 * value:.1f} % ({low} to {high})"


def _limits(outcome: Outcome) -> Iterator[str]:
    """Which limits the design exhausts, and how far single samples of the record use theirs."""
    binding = dict.fromkeys(_limit(limit.name) for limit in outcome.limits or () if limit.binding)
    shares = {} if outcome.signal is None else outcome.signal.of_limits or {}
    if binding:
        yield f"{', '.join(binding)} exhausted{' by the spectrum' if shares else ''}"
    if shares:
        taken = sorted(shares, key=lambda name: -shares[name])
        yield f"single samples take {', '.join(f'{100 * shares[k]:.3g} % of {_limit(k)}' for k in taken)}"


def _limit(name: str) -> str:
    """What a limit is called: `input amplitude`."""
    return " ".join(reversed(spoken(name).split(".")))


def _lines(found: MeasuredLines, time_unit: str) -> Fact:
    """How the lines of a frequency response are measured, and how well."""
    counted = (found.periods or 0) - (found.transient or 0)
    blocks = "" if found.blocks == 1 else f" in each of {found.blocks} blocks"
    of = f"of {found.asked} " if (found.asked or 0) > (found.lines or 0) else ""
    text = (
        f"{found.lines} {of}lines, {counted} of {found.periods} periods of {found.period} samples "
        f"count{blocks}; standard deviations at most {found.worst_ratio or 0.0:.6g} of those admitted"
    )
    return "response", text, f"worst at {found.worst_frequency or 0.0:.4g} rad/{time_unit}"


def _loop(found: Loop, time_unit: str) -> Fact:
    """The controller of a loop, and the margins that are kept."""
    settings = {"Kp": found.Kp, "Ti": found.Ti, "Td": found.Td}
    named = ", ".join(
        f"{name} {value:.4g}{'' if name == 'Kp' else f' {time_unit}'}"
        for name, value in settings.items()
        if value is not None
    )
    peak = f"|S| at most {found.nominal_peak or 0.0:.4g} with this plant"
    kept = (
        f"asked: at most {found.max_sensitivity or 0.0:.4g} with every plant within r_u, so a gain margin "
        f"of {found.gain_margin or 0.0:.3g} and a phase margin of {found.phase_margin or 0.0:.3g} degrees"
    )
    return "loop", f"{named}, {peak}" if named else peak, kept


def _paid(outcome: Outcome) -> str:
    """Say which plants a cost is for, unless it is the nominal one or all cost the same."""
    robust, found = outcome.robust, outcome.objective
    loop = outcome.power is not None and outcome.power.excitation is not None
    if found is None or found.kind != "least_cost" or robust is None or not loop:
        return ""
    number = 1 + robust.scenarios - robust.discarded
    return {"mean": f"mean over {number} plants", "worst": f"the largest of {number} plants"}.get(
        robust.cost, ""
    )


def _robust(found: Robust, target: Objective | None) -> Iterator[Fact]:
    """What holds at the plants that the true one might be, and at others drawn in the same way."""
    best = target is not None and target.kind == "accuracy_factor"
    again = f"{found.rejected} that were unstable, or no plants, were drawn again" if found.rejected else ""
    yield "plants", _held_at(found), again
    if found.floor is not None:
        never = f"; at {len(found.floor.lost)} of them no model keeps what is asked" * bool(found.floor.lost)
        held = f"of these plants {len(found.floor.raised)} are held to {found.floor.share:g} of the r_adm"
        yield "floor", f"{held} of the plant of the spec only{never}", "see the notes"
    bound = [_bound_by(item) for item in found.active[:3]]
    if found.missed is not None:
        yield "least served", f"{bound[0]}: {found.worst_share:.4g} of what is admitted", ""
    elif bound:
        yield "binding", ", ".join(bound) + (", .." if len(found.active) > len(bound) else ""), ""
    if found.dearest is not None:
        at = f"plant {found.dearest.scenario}" if found.dearest.scenario else "the plant of the spec"
        yield "dearest", f"{at}, where it costs {shown(found.dearest.cost)}", ""
    if found.searched is not None:
        tried = f"searched by ascent from {found.searched.tried} plants, not proved"
        yield "worst plant", _worst_found(found.searched, target), tried
    fresh = found.fresh
    if fresh is not None:
        low, high = (f"{100 * share:.3g}" for share in fresh.limits)
        share = f"{per_cent(fresh.share)} ({low} to {high})"
        drawn = f"of {fresh.draws} more, drawn alike, {_missed(fresh, best)}: {share}"
        lost = f", {fresh.lost} of which no model keeps what is asked" if fresh.lost else ""
        floor = f"{fresh.raised} are held to the floor only{lost}" if fresh.raised else ""
        yield "fresh plants", drawn, floor or "said of plants drawn as the spec says, not of the true plant"
    if fresh is not None and fresh.beyond_limits is not None:
        peaks = fresh.beyond_limits
        beyond = f"{peaks.draws} go beyond, up to {per_cent(peaks.largest)} of a limit"
        text = (
            f"single samples keep them at the plants that the design is for; of {fresh.draws} more {beyond}"
        )
        yield "limits there", text, "without noise"


def _held_at(found: Robust) -> str:
    added = 0 if found.searched is None else found.searched.added
    kept = found.scenarios - found.discarded - added
    left = f"; {found.discarded} are left out" if found.discarded else ""
    drawn = "listed" if found.source == "scenarios" else "drawn"
    sought = f" and {added} that a search found" if added else ""
    asked = "what is asked" if found.floor is None else "what is asked, or the floor below,"
    holds = f"is missed at {found.missed} of" if found.missed else "holds at"
    return f"{asked} {holds} the plant of the spec and {kept} {drawn}{sought}{left}"


def _missed(found: FreshPlants, best: bool) -> str:
    """How many of the fresh plants miss what is asked."""
    missed, dearer = found.missed, found.dearer or 0
    less = missed if found.less is None else found.less
    if best and missed:
        return f"{missed} are less sure than these, with errors up to {found.largest:.4g} times as large"
    if not dearer:
        return f"{missed} get less than that"
    both = f" ({less + dearer - missed} of them both)" if less + dearer > missed else ""
    return f"{less} get less than that, {dearer} cost more{both}, {missed} in all"


def _worst_found(found: SearchedPlant, target: Objective | None) -> str:
    """How bad the worst plant is: its ratio, relative to the ratio that is reached where that is best."""
    share, kind = found.share, None if target is None else target.kind
    if target is None or kind in ("least_cost", "shortest_experiment"):
        return f"{share:.4g} of what is admitted is the worst that was found in {found.region}"
    reached = f": {share * target.value:.4g} of what is admitted" if kind == "accuracy_factor" else ""
    design = f"those that the design is for{reached}"
    if share <= 1.0 + _AS_MUCH:
        return f"none was found in {found.region} that errs more than {design}"
    more = per_cent(share - 1.0)
    return f"the worst that was found in {found.region} errs {more} more than {design}"


def _bound_by(item: ActivePlant) -> str:
    if not item.scenario:
        return "the plant of the spec"
    values = ", ".join(f"{name} {value:.4g}" for name, value in (item.parameters or {}).items())
    return f"plant {item.scenario} ({values})"


def white(outcome: Outcome) -> str:
    """Say what white excitation costs or reaches: at the same accuracy, or within the same limits."""
    found = None if outcome.baseline is None else outcome.baseline.white
    kind = "" if outcome.objective is None else outcome.objective.kind
    if found is None:
        return ""
    value = {"cost": found.cost, "samples": found.samples, "value": found.value}.get(
        objective(kind).white, found.mean_squared_error
    )
    multiple = kind in ("least_cost", "closed_loop_error")
    if value is None or (multiple and (found.ratio is None or not value)):
        return ""
    said = f"white excitation: {shown(value)}"
    if not multiple or found.ratio is None:
        return said
    said += ", as much" if f"{found.ratio:.3g}" == "1" else f", {found.ratio:.3g} times as much"
    loop = outcome.closed_loop_error
    asymptotic = loop is not None and loop.covariance == "asymptotic"
    return f"{said}, both by asymptotic theory with model order factor 1" if asymptotic else said


def proofs(outcome: Outcome) -> Iterator[str]:
    """Yield what is proved of all other experiments."""
    found = outcome.objective
    if found is None:
        return
    kind = "such" if outcome.spectrum is None else outcome.spectrum.type
    family = f"no {_SHORT.get(kind, kind)} spectrum gets"
    if outcome.frequency_response is not None:
        family = "no powers of these lines get"
    if outcome.moments is not None:
        family = f"no {outcome.moments.structure} moments get"
    for bound, side in ((found.lower_bound, "below"), (found.upper_bound, "above")):
        if bound is not None and found.relative_gap != 1.0:  # 1 stands for "nothing is proved yet"
            gap = "below 1e-6" if (found.relative_gap or 0.0) < _CLOSED else f"{found.relative_gap:.1e}"
            yield f"{family} {side} {shown(bound)}" + (
                f", gap {gap}" if found.relative_gap is not None else ""
            )
    side = "above" if objective(found.kind).maximised else "below"
    if found.any_spectrum_bound is not None:
        yield f"no spectrum at all gets {side} {shown(found.any_spectrum_bound)}"
    if found.any_structure_bound is not None:
        yield f"no moments at all get {side} {shown(found.any_structure_bound)}"


def _closed(gap: float) -> str:
    return "below 1e-6" if gap < _CLOSED else f"{gap:.1e}"


def _signal(outcome: Outcome, signal: Signal) -> Iterator[str]:
    """The samples of the record, and what they attain."""
    yield f"{signal.samples} samples"
    peak, of_u = (enumerated(values) if values else "" for values in (signal.peak, signal.input_peak))
    looped = bool(of_u) and of_u != peak  # the excitation is then another signal than the input
    sizes = {"power": signal.power, "peak": signal.peak, "crest factor": signal.crest_factor}
    for name, values in sizes.items():
        if values:
            yield f"{name}{' of r' * looped} {enumerated(values)}"
    if looped and signal.output_peak is not None:
        yield f"peak of u {of_u}"
        yield f"peak of y {enumerated(signal.output_peak)}"
    if signal.mean_squared_error is not None:
        yield f"error {signal.mean_squared_error:.6g} with these samples"
    if signal.worst_ratio is not None:
        error = outcome.model_error is not None and outcome.model_error.worst_ratio is not None
        ratio = "r_u / r_adm" if error else "ratio to the requirement"
        designed = outcome.robust is not None and outcome.robust.missed is None
        of = ", at the worst of these plants" if designed else ""
        yield f"{ratio} at most {precise(signal.worst_ratio)} with these samples{of}"
    kept = signal.confidence
    if kept is not None:
        share, of = (kept.exact, "estimates") if kept.kept is None else (kept.kept, "simulated experiments")
        yield f"kept by {100 * share:.1f} % of the {of}"
    if signal.criterion is not None:
        yield f"criterion {signal.criterion:.6g} with these samples"
    yield from _beside_the_design(outcome.objective, signal)


def _beside_the_design(found: Objective | None, signal: Signal) -> Iterator[str]:
    """Yield how much accuracy the samples lose, or how much more they cost, compared with the design."""
    if found is not None and found.kind == "accuracy_factor":
        more = 0.0 if signal.worst_ratio is None else signal.worst_ratio / found.value - 1.0
        if more >= _LITTLE_LESS:
            yield f"errors {per_cent(more)} larger than by the design"
        return
    if signal.efficiency is not None:
        if 1.0 - signal.efficiency >= _LITTLE_LESS:
            yield f"{per_cent(1.0 - signal.efficiency)} less accuracy than the design"
        return
    more = signal.extra_power or 0.0
    if abs(more) >= _LITTLE_MORE:
        side = "above" if more > 0 else "below"
        yield f"at a cost {per_cent(abs(more))} {side} that of the designed spectrum"
