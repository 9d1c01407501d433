"""What data and simulated experiments say, as tables and sentences of a page."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.report.numbers import Fact, Rows, shown, spoken
from inputdesign_cli.runs.results import Result

_SPREAD = "{:.4g} ± {:.2g}"


def estimate_table(result: Result) -> Rows | None:
    """The estimated parameters with their standard deviations."""
    found = result.get("identification")
    if found is None:
        return None
    deviations = found["standard_deviation"]
    rows = tuple((name, f"{v:.6g}", f"{deviations[name]:.2g}") for name, v in found["theta"].items())
    return Rows(("parameter", "estimate", "standard deviation"), rows)


def estimate_facts(result: Result) -> Iterator[Fact]:
    """How well the estimate explains the data."""
    found = result.get("identification", {})
    if "variance" in found:
        variance = found["variance"]
        several = isinstance(variance, list)
        value = "; ".join(" ".join(f"{v:.5g}" for v in row) for row in variance) if several else ""
        yield f"noise {'covariance' if several else 'variance'}", value or shown(variance), ""
    fit = found.get("fit_percent")
    if fit is not None:
        each = fit if isinstance(fit, list) else [fit]
        text = ", ".join("-" if value is None else f"{value:.1f} %" for value in each)
        yield "simulation explains", text, "of the variation of the outputs, by the input alone"
    tests = (("whiteness", "residuals white"), ("independence", "residuals independent of past inputs"))
    for key, name in tests:
        if key in found:
            yield name, f"probability {found[key]['probability']:.2g}", ""


def estimate_answer(result: Result) -> str:
    """What the data amount to."""
    assessment = result.get("assessment")
    if assessment is None:
        return f"The model was estimated from {result['samples']} samples."
    worst = max(assessment["requirements"], key=lambda entry: entry["worst_ratio"])
    if assessment["met"]:
        return f"These data meet the accuracy: {_reached(worst)} of what is admitted."
    if "objective" not in result:
        return f"These data miss the accuracy: {_reached(worst)} times what is admitted."
    return (
        f"These data miss the accuracy: {_reached(worst)} times what is admitted. "
        "The experiment below makes up for it, after these data."
    )


def requirement_table(result: Result, time_unit: str) -> Rows | None:
    """Each requirement with what the data give."""
    assessment = result.get("assessment")
    if assessment is None:
        return None
    rows = tuple(
        (
            _named(entry),
            f"{entry['worst_ratio']:.4g}",
            f"{entry['frequency']:.4g}" if entry.get("frequency") is not None else "",
            "met" if entry["worst_ratio"] <= 1.0 + 1e-9 else "missed",
        )
        for entry in assessment["requirements"]
    )
    return Rows(("requirement", "of what is admitted", f"at (rad/{time_unit})", "verdict"), rows)


def simulation_table(result: Result) -> Rows | None:
    """One row for each input that was tried; None without a simulation."""
    inputs = result.get("simulation", {}).get("inputs", {})
    if any("loss" in entry for entry in inputs.values()):
        rows = tuple(
            (spoken(name), _mean(entry.get("loss")), _mean(entry.get("theory", {}).get("loss")))
            for name, entry in inputs.items()
        )
        return Rows(("input", "loss", "theory"), rows)
    if any("mse" in entry for entry in inputs.values()):
        rows = tuple(
            (
                spoken(name),
                _SPREAD.format(entry["mse"], entry.get("mse_standard_error", 0.0)),
                shown(entry["theory"]["mse"]) if "theory" in entry else "",
            )
            for name, entry in inputs.items()
        )
        return Rows(("input", "mean squared error", "theory"), rows)
    columns = {
        "runs within r_adm": [_share(entry, "within_r_adm") for entry in inputs.values()],
        "were the design model true": [
            _share(entry.get("on_design_model", {}), "within_r_adm") for entry in inputs.values()
        ],
        "runs within r_u": [_share(entry, "within_r_u") for entry in inputs.values()],
        "cost": [f"{entry['cost']:.5g}" if "cost" in entry else "" for entry in inputs.values()],
        "not settled": [str(entry.get("not_converged", "")) for entry in inputs.values()],
    }
    shown_columns = {name: cells for name, cells in columns.items() if any(cells)}
    if not shown_columns:
        return None
    each = zip(*shown_columns.values(), strict=True)
    return Rows(
        ("input", *shown_columns), tuple((spoken(n), *cells) for n, cells in zip(inputs, each, strict=True))
    )


def _named(entry: Result) -> str:
    return " ".join(filter(None, (spoken(entry["name"]), entry.get("entry", ""))))


def _reached(entry: Result) -> str:
    return f"{_named(entry)} reaches {entry['worst_ratio']:.4g}"


def _share(entry: Result, key: str) -> str:
    if key not in entry:
        return ""
    low, high = (100 * limit for limit in entry[f"{key}_limits"])
    return f"{100 * entry[key]:.1f} %\n{low:.1f} to {high:.1f}"


def _mean(entry: Result | None) -> str:
    return "" if entry is None else _SPREAD.format(entry["mean"], entry["sd"])
