"""What data and simulated experiments say, as tables and sentences of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from inputdesign_cli.outcome.results import Json, Result
from inputdesign_cli.report.numbers import BREAK, Fact, Rows, listed, shown, spoken

_SPREAD = "{:.4g} ± {:.2g}"
# Below this share of its standard deviation the digits of an estimate say nothing, not even its order.
_NOTHING = 1e-3
# What a record that is rounded to a file may be off.
_REACHED = 1e-6
_NORMAL = 1.96  # standard deviations to either side of 95 %


def estimate_table(result: Result) -> Rows | None:
    """The estimated parameters with their standard deviations and 95 % limits."""
    found = result.get("identification")
    if found is None or "theta" not in found:
        return None
    deviations = found["standard_deviation"]
    rows = tuple(
        (name, _beside(value, deviations[name]), f"{deviations[name]:.2g}", _limits(value, deviations[name]))
        for name, value in found["theta"].items()
    )
    return Rows(("parameter", "estimate", "standard deviation", "95 % limits"), rows)


def _limits(value: float, deviation: float) -> str:
    return f"{value - _NORMAL * deviation:.4g} to {value + _NORMAL * deviation:.4g}"


def _beside(value: float, deviation: float) -> str:
    """An estimate; zero where it is nothing beside its standard deviation."""
    return "0" if abs(value) < _NOTHING * deviation else f"{value:.6g}"


def estimate_facts(result: Result) -> Iterator[Fact]:
    """How well the estimate explains the data."""
    found = result.get("identification", {})
    if "variance" in found:
        value = found["variance"]
        if isinstance(value, list):
            yield "noise", f"covariance [{'; '.join(listed(row) for row in value)}]", ""
        else:
            yield "noise", f"variance {value:.5g}", ""
    fit = found.get("fit_percent")
    if fit is not None:
        yield "fit", f"simulation explains {_per_cent(fit)} of the output{'s' * isinstance(fit, list)}", ""
    unseen = result.get("validation")
    if unseen is not None:
        simulation, prediction = (
            _per_cent(unseen[f"{way}_fit_percent"]) for way in ("simulation", "prediction")
        )
        text = f"simulation explains {simulation}, one-step prediction {prediction} of {_judging(result)}"
        yield "validated", text, ""
    tests = [
        f"{name} {found[name]['probability']:.2g}" for name in ("whiteness", "independence") if name in found
    ]
    if tests:
        yield "residuals", f"probability of {', of '.join(tests)}", ""


def _judging(result: Result) -> str:
    """What `validation` is about: all data for a model that was given, or a part and an estimate without."""
    if "exploration" not in result:
        return "these data"
    if result["exploration"].get("split") == "none":
        return "the data that it is estimated from"
    return "one part, estimated from the other alone (the parameters above: from the whole record)"


def _per_cent(fit: Json) -> str:
    """Of one output, or of each; a dash where a model cannot be simulated."""
    each = fit if isinstance(fit, list) else [fit]
    return " and ".join("-" if value is None else f"{value:.1f}" for value in each) + " %"


def estimate_answer(result: Result) -> str:
    """What the data amount to."""
    assessment = result.get("assessment")
    if assessment is None and "theta" not in result["identification"]:
        number = result["frequency_response"]["frequencies"]
        return f"The frequency response was measured at {number} frequencies."
    if assessment is None:
        estimated = f"The model was estimated from {result['samples']} samples{_explained(result)}."
        return " ".join([estimated, *_unseen(result)])
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in verdict(result))


def _explained(result: Result) -> str:
    """How much of the output a simulation of the model explains."""
    fit = result["identification"].get("fit_percent")
    if fit is None:
        return ""
    return f"; simulated from the input alone, it explains {_per_cent(fit)} of these data"


def _unseen(result: Result) -> Iterator[str]:
    """The same of an estimate that has not seen what it is judged by, if there is one."""
    if "validation" in result and result.get("exploration", {}).get("split") != "none":
        explained = _per_cent(result["validation"]["simulation_fit_percent"])
        yield f"The same structure, estimated from one part of them alone, explains {explained} of the other."


# Why data leave a verdict open, by `assessment.causes`.
_UNDECIDED = {
    "unsettled": "the search for the parameters did not settle",
    "contradicted": "the data contradict the model",
    "unasked": "what is asked cannot be asked of this estimate",
    "undetermined": "the data do not determine the model: other parameters explain them nearly as well",
    "chance": "chance may stand behind what was measured",
    "nonlinearity": "the plant is not linear enough for what is asked",
    "drift": "outputs drift, and that was not taken away",
    "spikes": "a few samples decide what the data say",
}

_RIGHT = " if the structure of the model is right"


def verdict(result: Result) -> Iterator[str]:
    """What an assessment comes to, and what is left to do."""
    assessment = result.get("assessment")
    if assessment is None or result.get("status") == "running":
        return
    if "undecided" in assessment:
        # Results of older versions do not tell the causes.
        causes = assessment.get("causes", ["contradicted", "undetermined"])
        told = "; ".join(_UNDECIDED[cause] for cause in causes)
        yield f"undecided, neither met nor missed: {told}; the notes say what to change"
        return
    worst = max(assessment["requirements"], key=lambda entry: entry["worst_ratio"])
    if assessment["met"]:
        yield f"these data meet the accuracy: {_reached(worst)} of what is admitted"
        return
    yield f"these data miss the accuracy: {_reached(worst)} times what is admitted"
    right = f"{_RIGHT}{_from_rest(result)}"
    number = assessment.get("experiments")
    if number is not None or assessment.get("left", 0.0) > 1.0 + _REACHED:  # more than can be counted
        repeat = "" if number is None else f"apply it {number} times, "
        yield (
            "the experiment below is the best within the limits for the model of these data, and after it "
            f"the error is still {assessment['left']:.4g} times what is admitted{right}: {repeat}widen "
            "the limits, or loosen the target"
        )
    elif "left" in assessment:
        yield (
            "the experiment below is what the model of these data still needs: after both the error is "
            f"{assessment['left']:.4g} of what is admitted{right}; assess both records together"
        )
    if "left" in assessment:
        yield from _open_structure(assessment)
    elif "no_top_up" in assessment:
        yield f"no experiment is designed: {assessment['no_top_up']}"


def _from_rest(result: Result) -> str:
    """What else an experiment counts on, if its record relies on a start from rest."""
    signal = result.get("signal", {})
    if "begun_anywhere" not in signal:
        return ""
    growth = signal["begun_anywhere"]
    otherwise = "nothing is promised" if growth is None else f"{growth:.3g} times as much"
    return f" and the record begins at rest, its levels known (--operating-point; else {otherwise})"


def _open_structure(assessment: Result) -> Iterator[str]:
    """What these data leave open that an experiment designed on their model does not count on."""
    entries = assessment.get("neglected", [])
    worst = max(entries, key=lambda entry: entry["may_move"], default={"may_move": 0.0})
    if worst["may_move"] > 1.0:
        yield (
            f"that structure is open: one more parameter ({worst['parameter']}), which these data do not "
            f"rule out, may move G by up to {worst['may_move']:.3g} times what is admitted (95 %)"
        )


def requirement_table(result: Result, time_unit: str) -> Rows | None:
    """Each requirement with what the data give."""
    assessment = result.get("assessment")
    if assessment is None or not assessment["requirements"]:
        return None
    unclear = "undecided" if "undecided" in assessment else ""
    rows = tuple(
        (
            _named(entry),
            f"{entry['worst_ratio']:.4g}",
            f"{entry['frequency']:.4g}" if entry.get("frequency") is not None else "",
            unclear or ("met" if entry["worst_ratio"] <= 1.0 + 1e-9 else "missed"),
        )
        for entry in assessment["requirements"]
    )
    return Rows(("requirement", "of what is admitted", f"at (rad/{time_unit})", "verdict"), rows)


def campaign_facts(result: Result) -> Iterator[tuple[str, str]]:
    """How a campaign stands: its parts so far, what has been reached, and what comes next."""
    campaign = result.get("campaign")
    if campaign is None:
        return
    now, parts = campaign["rounds"][-1], len(campaign["records"])
    state = {"running": "goes on", "stopped": "has ended: the data meet what is asked"}
    ended = {"missed": "without meeting what is asked", "undecided": "undecided: see the notes"}
    told = state.get(campaign["state"]) or f"has ended {ended[campaign['state']]}"
    yield "campaign", f"{told}, after {parts} part{'' if parts == 1 else 's'} and {now['samples']} samples"
    gone = [str(n + 1) for n, record in enumerate(campaign["records"]) if record["withdrawn"]]
    if gone:
        yield "", f"withdrawn: record {', '.join(gone)}"
    if "worst_ratio" in now:
        yield "reached", f"{now['worst_ratio']:.4g} of what is admitted, at the estimate"
    plan = now.get("plan")
    if plan is not None:
        whole = plan["planned_samples"]
        of = (
            f", the first of {whole} that are planned with {plan['power']:.4g}"
            if whole > plan["samples"]
            else ""
        )
        power = plan.get("part_power", plan["power"])
        yield "next", f"apply {plan['samples']} samples of power {power:.4g} (signal.csv{of})"


def campaign_answer(result: Result) -> str:
    """The same in sentences."""
    state, *others = campaign_facts(result)
    told = [f"The campaign {state[1]}.", *(f"{name.capitalize()}: {text}." for name, text in others if name)]
    return " ".join(told)


def simulation_answer(result: Result) -> Iterator[str]:
    """What simulated experiments say of the design, in a sentence; nothing where they were not asked that."""
    found = result.get("simulation", {})
    entry = found.get("inputs", {}).get("design", {})
    if "within_r_adm" not in entry:
        return
    low, high = (100 * limit for limit in entry["within_r_adm_limits"])
    yield (
        f"In {found['runs']} simulated experiments {100 * entry['within_r_adm']:.1f} % of the models stayed "
        f"within r_adm at every frequency (95 % limits {low:.1f} to {high:.1f})."
    )


def simulation_table(result: Result) -> Rows | None:
    """One row for each input that was tried; None without a simulation."""
    inputs = result.get("simulation", {}).get("inputs", {})
    columns: dict[str, Callable[[Result], str]] = {
        "loss": lambda entry: _mean(entry.get("loss")),
        "mean squared error": _squared_error,
        "theory": lambda entry: _theory(entry.get("theory", {})),
        "mean estimate": lambda entry: listed(entry.get("mean_estimate", [])) if "mse" in entry else "",
        "deviations over theory": lambda entry: _range(entry.get("deviation_ratio"), entry.get("chance")),
        "worst over admitted": lambda entry: shown(entry["worst_ratio"]) if "worst_ratio" in entry else "",
        "within r_adm": lambda entry: (
            _share(entry, "within_r_adm") if "within_r_adm_true" not in entry else ""
        ),
        "errors within r_adm of the plant of the spec": lambda entry: (
            _share(entry, "within_r_adm") if "within_r_adm_true" in entry else ""
        ),
        "were the design model true": lambda entry: _share(entry.get("on_design_model", {}), "within_r_adm"),
        "within r_u": lambda entry: _share(entry, "within_r_u"),
        "cost": lambda entry: f"{entry['cost']:.5g}" if "cost" in entry else "",
        "errors within r_adm of the true plant": lambda entry: _share(entry, "within_r_adm_true"),
        "over the spectrum that knows the plant": lambda entry: _mean_and_tail(entry.get("cost_over_oracle")),
        "over the record of that": lambda entry: _mean_and_tail(entry.get("cost_over_oracle_record")),
        "true ratio": lambda entry: _mean_and_tail(entry.get("true_ratio")),
        "samples": lambda entry: f"{entry['samples']['mean']:.0f}" if "samples" in entry else "",
        "ended": _endings,
        "not settled": lambda entry: str(entry.get("not_converged") or ""),
    }
    cells = {name: [cell(entry) for entry in inputs.values()] for name, cell in columns.items()}
    filled = {name: column for name, column in cells.items() if any(column)}
    if not filled:
        return None
    each = zip(map(spoken, inputs), *filled.values(), strict=True)
    return Rows(("input", *filled), tuple(each))


def _named(entry: Result) -> str:
    return " ".join(filter(None, (spoken(entry["name"]), entry.get("entry", ""))))


def _reached(entry: Result) -> str:
    return f"{_named(entry)} reaches {entry['worst_ratio']:.4g}"


def _share(entry: Result, key: str) -> str:
    if key not in entry:
        return ""
    low, high = (100 * limit for limit in entry[f"{key}_limits"])
    return f"{100 * entry[key]:.1f} %{BREAK}95 % limits {low:.1f} to {high:.1f}"


def _range(found: Result | None, chance: Json) -> str:
    if found is None:
        return ""
    low, high = chance
    return f"{found['least']:.4g} to {found['largest']:.4g}{BREAK}chance {low:.3g} to {high:.3g}"


def _mean_and_tail(entry: Result | None) -> str:
    return "" if entry is None else f"{entry['mean']:.3g}{BREAK}95 % below {entry['quantile_95']:.3g}"


def _endings(entry: Result) -> str:
    ways = ("stopped", "missed", "undecided", "unplanned")
    return ", ".join(f"{entry[way]} {way}" for way in ways if entry.get(way))


def _mean(entry: Result | None) -> str:
    return "" if entry is None else _SPREAD.format(entry["mean"], entry["sd"])


def _squared_error(entry: Result) -> str:
    return _SPREAD.format(entry["mse"], entry.get("mse_standard_error", 0.0)) if "mse" in entry else ""


def _theory(entry: Result) -> str:
    return shown(entry["mse"]) if "mse" in entry else _mean(entry.get("loss"))
