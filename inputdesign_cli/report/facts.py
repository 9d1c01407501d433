"""A result in words, a line a fact: the same in the terminal and on a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from inputdesign_cli.outcome.objectives import objective
from inputdesign_cli.outcome.results import Json, Result
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.report.numbers import Fact, enumerated, precise, shown, spoken

# Gaps below this are told as such.
_CLOSED = 1e-6

# A plant that errs by so little more than those that bind errs as much as they do.
_AS_MUCH = 1e-4

# By so much more than what was asked an exact confidence is told to be exceeded.
_ROOM = 0.005

# Types of spectra that are short for something.
_SHORT = {"fir": "FIR"}

# What is said of an excitation that was given, by the status of the result.
GIVEN = {"given": "", "met": ": it meets the accuracy", "missed": ": it misses the accuracy"}


def facts(result: Result, time_unit: str) -> Iterator[Fact]:
    """What an experiment costs and what it buys, as far as the result has the numbers."""
    found = result.get("objective", {})
    kind, cost = found.get("kind"), "energy" if "moments" in result else "cost"
    if "value" in found:
        yield (
            cost if kind == "least_cost" else objective(kind).name,
            _clean(found["value"], kind),
            "; ".join(filter(None, [_paid(result), white(result)])),
        )
    if kind == "closed_loop_error":
        yield _of_structure(result["closed_loop_error"])
    if kind != "least_cost" and "cost" in result:
        yield cost, shown(result["cost"]), ""
    power = result.get("power", {})
    powers = ", ".join(f"{name} {enumerated(power[name])}" for name in power)
    if powers:
        yield "power", powers, "at the plant of the spec" if _paid(result) else ""
    limits = "; ".join(_limits(result))
    if limits:
        yield "limits", limits, ""
    error = result.get("model_error", {})
    if "worst_ratio" in error:
        where = f" at {error['worst_frequency']:.4g} rad/{time_unit}" if "worst_frequency" in error else ""
        at = "at the plant of the spec" if "robust" in result else ""
        yield "model error", f"r_u / r_adm at most {error['worst_ratio']:.6g}{where}", at
    asked = result.get("requirements", result.get("assessment", {}).get("requirements", []))
    yield from (_loop(entry["loop"], time_unit) for entry in asked if "loop" in entry)
    if "worst_ratio" in result.get("frequency_response", {}):
        yield _lines(result["frequency_response"], time_unit)
    if "confidence" in error:
        told = error["confidence"]
        yield (
            "confidence",
            _kept(told),
            f"asked {100 * told['asked']:g} %; chi-squared would take alpha {told['chi_squared_alpha']:.4g}, "
            f"not {error['alpha']:.4g}",
        )
    if "robust" in result:
        yield from _robust(result["robust"], result.get("objective", {}))
    if "mean_squared_error" in result:
        error = result["mean_squared_error"]
        parts = f"squared bias {error['bias_squared']:.6g} + variance {error['variance']:.6g}"
        yield "error", f"{error['value']:.6g} = {parts}", ""
    deviations = result.get("information", {}).get("standard_deviation")
    if deviations and result.get("status") in GIVEN and "identification" not in result:
        yield "std", ", ".join(f"{name} {deviations[name]:.4g}" for name in deviations), ""
    if "samples" in result.get("signal", {}):
        yield "signal", ", ".join(_signal(result)), ""
    if "improvement" in result.get("simulation", {}):
        measured, theory = (100 * result["simulation"]["improvement"][key] for key in ("measured", "theory"))
        yield "improvement", f"{measured:.1f} % better than white (theory {theory:.1f} %)", ""


def _of_structure(found: Mapping[str, Json]) -> Fact:
    """The error of the loop by the covariance of the model structure, with the design and white input."""
    design, white_input = (found["parametric"][name] for name in ("design", "white"))
    saved = 1.0 - design["loss"]["mean"] / white_input["loss"]["mean"]
    less = f"mean loss {per_cent(abs(saved))} {'less' if saved >= 0.0 else 'more'} with the design"
    times = f"{white_input['value'] / design['value']:.3g} times as much"
    told = f"white excitation: {shown(white_input['value'])}, {times}; {less}"
    return "for this structure", shown(design["value"]), told


def _kept(told: Mapping[str, Json]) -> str:
    """How many estimates meet the bounds: of simulated experiments, or drawn by asymptotic theory."""
    runs = "runs" in told
    low, high = (f"{100 * share:.1f}" for share in told["kept_limits" if runs else "exact_limits"])
    share = f"{100 * told['kept' if runs else 'exact']:.1f} % ({low} to {high})"
    if runs:
        spent = ", more than asked: it costs more than it need" if _beyond(told) else ""
        return f"{share} of {told['runs']} simulated experiments meet it{spent}"
    return f"{share} of {told['draws']} estimates drawn by asymptotic theory meet it"


def _beyond(told: Mapping[str, Json]) -> bool:
    """Whether an exact confidence is exceeded by more than the chance of its runs."""
    return bool(told["kept_limits"][0] > told["asked"] + _ROOM)


def _limits(result: Result) -> Iterator[str]:
    """Which limits the design exhausts, and how far single samples of the record use theirs."""
    binding = [_limit(entry["name"]) for entry in result.get("limits", []) if entry["binding"]]
    shares = result.get("signal", {}).get("of_limits", {})
    if binding:
        by = " by the spectrum" if shares else ""
        yield f"{', '.join(dict.fromkeys(binding))} exhausted{by}"
    if shares:
        taken = sorted(shares, key=lambda name: -shares[name])
        yield f"single samples take {', '.join(f'{100 * shares[k]:.3g} % of {_limit(k)}' for k in taken)}"


def _limit(name: str) -> str:
    """What a limit is called: `input amplitude`."""
    return " ".join(reversed(spoken(name).split(".")))


def _lines(found: Mapping[str, Json], time_unit: str) -> Fact:
    """How the lines of a frequency response are measured, and how well."""
    counted = found["periods"] - found["transient"]
    blocks = "" if found["blocks"] == 1 else f" in each of {found['blocks']} blocks"
    of = f"of {found['asked']} " if found.get("asked", found["lines"]) > found["lines"] else ""
    text = (
        f"{found['lines']} {of}lines, {counted} of {found['periods']} periods of {found['period']} samples "
        f"count{blocks}; standard deviations at most {found['worst_ratio']:.6g} of those admitted"
    )
    return "response", text, f"worst at {found['worst_frequency']:.4g} rad/{time_unit}"


def _loop(found: Mapping[str, Json], time_unit: str) -> Fact:
    """The controller of a loop, and the margin that is kept."""
    settings = {name: found[name] for name in ("Kp", "Ti", "Td") if name in found}
    told = ", ".join(
        f"{name} {value:.4g}{'' if name == 'Kp' else f' {time_unit}'}" for name, value in settings.items()
    )
    peak = f"|S| at most {found['nominal_peak']:.4g} with this plant"
    kept = (
        f"asked: at most {found['max_sensitivity']:.4g} with every plant within r_u, so a gain margin "
        f"of {found['gain_margin']:.3g} and a phase margin of {found['phase_margin']:.3g} degrees"
    )
    return "loop", f"{told}, {peak}" if told else peak, kept


def _paid(result: Result) -> str:
    """Of which plants a cost is that is not the nominal one; empty for that, and where all cost the same."""
    robust, loop = result.get("robust", {}), "excitation" in result.get("power", {})
    if result.get("objective", {}).get("kind") != "least_cost" or not robust or not loop:
        return ""
    number = 1 + robust["scenarios"] - robust["discarded"]
    return {"mean": f"mean over {number} plants", "worst": f"the largest of {number} plants"}.get(
        robust["cost"], ""
    )


def _robust(found: Mapping[str, Json], objective: Mapping[str, Json]) -> Iterator[Fact]:
    """What holds at the plants that the true one might be, and at others drawn in the same way."""
    best = objective.get("kind") == "accuracy_factor"
    kept = found["scenarios"] - found["discarded"]
    bound = [_bound_by(item) for item in found["active"][:3]]
    more = ", .." if len(found["active"]) > len(bound) else ""
    left = f"; {found['discarded']} are left out" if found["discarded"] else ""
    drawn = "listed" if found["source"] == "scenarios" else "drawn"
    again = (
        f"{found['rejected']} that were unstable, or no plants, were drawn again" if found["rejected"] else ""
    )
    added = found.get("searched", {}).get("added", 0)
    sought = f" and {added} that a search found" if added else ""
    asked = "what is asked, or the floor below," if "floor" in found else "what is asked"
    these = f"the plant of the spec and {kept - added} {drawn}{sought}{left}"
    missed = found.get("missed", 0)
    yield "plants", f"{asked} {f'is missed at {missed} of' if missed else 'holds at'} {these}", again
    if "floor" in found:
        raised, lost = (len(found["floor"][name]) for name in ("raised", "lost"))
        never = f"; at {lost} of them no model keeps what is asked" if lost else ""
        yield (
            "floor",
            f"of these plants {raised} are held to {found['floor']['share']:g} of the r_adm of the plant of "
            f"the spec only{never}",
            "see the notes",
        )
    if "missed" in found:
        yield "least served", f"{bound[0]}: {found['worst_share']:.4g} of what is admitted", ""
    elif bound:
        yield "binding", ", ".join(bound) + more, ""
    if "dearest" in found:
        told = found["dearest"]
        at = f"plant {told['scenario']}" if told["scenario"] else "the plant of the spec"
        yield "dearest", f"{at}, where it costs {shown(told['cost'])}", ""
    if "searched" in found:
        told = found["searched"]
        yield (
            "worst plant",
            _worst_found(told, objective),
            f"searched by ascent from {told['tried']} plants, not proved",
        )
    if "fresh" in found:
        told = found["fresh"]
        low, high = (f"{100 * share:.3g}" for share in told["limits"])
        yield (
            "fresh plants",
            f"of {told['draws']} more, drawn alike, {_missed(told, best)}: {per_cent(told['share'])} "
            f"({low} to {high})",
            _held(told) or "said of plants drawn as the spec says, not of the true plant",
        )
        if "beyond_limits" in told:
            peaks = told["beyond_limits"]
            yield (
                "limits there",
                f"single samples keep them at the plants that the design is for; of {told['draws']} more "
                f"{peaks['draws']} go beyond, up to {per_cent(peaks['largest'])} of a limit",
                "without noise",
            )


def _held(told: Mapping[str, Json]) -> str:
    """What counts as getting what is asked, where r_adm is the floor at some of the fresh plants."""
    if not told.get("raised"):
        return ""
    lost = f", {told['lost']} of which no model keeps what is asked" if told.get("lost") else ""
    return f"{told['raised']} are held to the floor only{lost}"


def _missed(told: Mapping[str, Json], best: bool) -> str:
    """How many plants miss what, of those that were tried."""
    missed, less, dearer = told["missed"], told.get("less", told["missed"]), told.get("dearer", 0)
    if best and missed:
        return f"{missed} are less sure than these, with errors up to {told['largest']:.4g} times as large"
    if not dearer:
        return f"{missed} get less than that"
    both = f" ({less + dearer - missed} of them both)" if less + dearer > missed else ""
    return f"{less} get less than that, {dearer} cost more{both}, {missed} in all"


def _worst_found(told: Mapping[str, Json], objective: Mapping[str, Json]) -> str:
    """Say how bad the worst plant is; for the best accuracy `share` is relative to the ratio reached."""
    share, kind = told["share"], objective.get("kind")
    if kind in (None, "least_cost", "shortest_experiment"):
        return f"{share:.4g} of what is admitted is the worst that was found in {told['region']}"
    reached = f": {share * objective['value']:.4g} of what is admitted" if kind == "accuracy_factor" else ""
    if share <= 1.0 + _AS_MUCH:
        return f"none was found in {told['region']} that errs more than those that the design is for{reached}"
    more = f"errs {per_cent(share - 1.0)} more than those that the design is for"
    return f"the worst that was found in {told['region']} {more}{reached}"


def _bound_by(item: Mapping[str, Json]) -> str:
    if not item["scenario"]:
        return "the plant of the spec"
    values = ", ".join(f"{name} {value:.4g}" for name, value in item["parameters"].items())
    return f"plant {item['scenario']} ({values})"


def white(result: Result) -> str:
    """What white excitation costs or reaches instead: at the same accuracy, or within the same limits."""
    kind = result.get("objective", {}).get("kind")
    found = result.get("baseline", {}).get("white", {})
    value, ratio = found.get(objective(kind).white), found.get("ratio")
    multiple = kind in ("least_cost", "closed_loop_error")
    if value is None or (multiple and (ratio is None or not value)):
        return ""
    told = f"white excitation: {_clean(value, kind)}"
    if not multiple:
        return told
    told += ", as much" if f"{ratio:.3g}" == "1" else f", {ratio:.3g} times as much"
    asymptotic = result.get("closed_loop_error", {}).get("covariance") == "asymptotic"
    return f"{told}, both by asymptotic theory with model order factor 1" if asymptotic else told


def _gap(relative: float) -> str:
    """How near the proof comes: what a solver leaves below a millionth changes from machine to machine."""
    return (
        f", gap {relative:.1e}" if relative >= _CLOSED else f", gap below {_CLOSED:.0e}".replace("e-0", "e-")
    )


def proofs(result: Result) -> Iterator[str]:
    """What is proved of other experiments."""
    found = result.get("objective", {})
    kind = result.get("spectrum", {}).get("type", "such")
    family = f"no {_SHORT.get(kind, kind)} spectrum gets"
    if "frequency_response" in result and "objective" in result:
        family = "no powers of these lines get"
    if "moments" in result:
        family = f"no {result['moments']['structure']} moments get"
    for key, side in (("lower_bound", "below"), ("upper_bound", "above")):
        if key in found and found.get("relative_gap") != 1.0:  # or else nothing is proved yet
            gap = _gap(found["relative_gap"]) if "relative_gap" in found else ""
            yield f"{family} {side} {shown(found[key])}{gap}"
    side = "above" if objective(found.get("kind")).maximised else "below"
    for what in ("spectrum", "structure"):
        if f"any_{what}_bound" in found:
            whatever = "spectrum at all gets" if what == "spectrum" else "moments at all get"
            yield f"no {whatever} {side} {shown(found[f'any_{what}_bound'])}"


def _clean(value: float, kind: str) -> str:
    """Seven digits; the logarithm of one (criterion D) is zero, whatever rounding says."""
    return shown(0.0 if kind == "D" and abs(value) < 1e-12 else value)


def _signal(result: Result) -> Iterator[str]:
    """The samples of the record, and what they attain."""
    signal = result["signal"]
    yield f"{signal['samples']} samples"
    peak, of_u = (enumerated(signal[key]) if signal.get(key) else "" for key in ("peak", "input_peak"))
    looped = bool(of_u) and of_u != peak  # what excites is then another signal than the input
    for key in ("power", "peak", "crest_factor"):
        if signal.get(key):
            yield f"{spoken(key)}{' of r' * looped} {enumerated(signal[key])}"
    if looped:
        yield f"peak of u {of_u}"
        yield f"peak of y {enumerated(signal['output_peak'])}"
    if "mean_squared_error" in signal:
        yield f"error {signal['mean_squared_error']:.6g} with these samples"
    if "worst_ratio" in signal:
        error = "worst_ratio" in result.get("model_error", {})
        ratio = "r_u / r_adm" if error else "ratio to the requirement"
        designed = "robust" in result and "missed" not in result["robust"]
        of = ", at the worst of these plants" if designed else ""
        yield f"{ratio} at most {precise(signal['worst_ratio'])} with these samples{of}"
    if "confidence" in signal:
        told = signal["confidence"]
        kept, of = ("kept", "simulated experiments") if "runs" in told else ("exact", "estimates")
        yield f"kept by {100 * told[kept]:.1f} % of the {of}"
    if "criterion" in signal:
        yield f"criterion {signal['criterion']:.6g} with these samples"
    yield from _beside_the_design(result.get("objective", {}), signal)


def _beside_the_design(found: Mapping[str, Json], signal: Mapping[str, Json]) -> Iterator[str]:
    """What the samples buy less, where the best was asked for, or what else they cost."""
    if "efficiency" in signal or found.get("kind") == "accuracy_factor":
        less = 1.0 - signal.get("efficiency", 1.0)
        if "worst_ratio" in signal:
            less = 1.0 - found["value"] / signal["worst_ratio"]
        if less >= 5e-4:
            yield f"{per_cent(less)} less accuracy than the design"
        return
    more = signal.get("extra_power", 0.0)
    if abs(more) < 5e-5:
        return
    side = "above" if more > 0 else "below"
    yield f"at a cost {per_cent(abs(more))} {side} that of the designed spectrum"
