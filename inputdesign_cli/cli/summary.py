"""The summary of a run in the terminal: a few aligned lines, the same in a pipe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from inputdesign_cli.cli.terminal import aligned

Result = Mapping[str, Any]

ASKED = {
    "least_cost": "the cheapest experiment that meets the accuracy",
    "shortest_experiment": "the shortest experiment that meets the accuracy",
    "D": "the most information within the limits: log det M",
    "A": "the most information within the limits: -trace of M^-1",
    "E": "the most information within the limits: smallest eigenvalue of M",
    "T": "the most information within the limits: trace of M",
    "closed_loop_error": "the least error of the loop with the controller designed on the model",
    "mean_squared_error": "the least mean squared error",
}
QUANTITY = {"least_cost": "cost", "shortest_experiment": "samples", "mean_squared_error": "error"}


def summary(result: Result, time_unit: str, files: Sequence[Path]) -> str:
    """What was asked, what it costs, what is proved, how close the error comes, and where the files are.

    Lines whose numbers the result does not have are left out.
    """
    lines = [
        *_objective(result),
        *_model_error(result, time_unit),
        *_signal(result),
        ("files", f"{files[-1].parent}: {', '.join(file.name for file in files)}"),
    ]
    title = result.get("title")
    return "\n".join([*([title, ""] if title else []), *aligned(lines, gap="   ")])


def _objective(result: Result) -> list[tuple[str, str]]:
    objective = result.get("objective", {})
    kind = objective.get("kind")
    lines = [("asked", ASKED[kind])] if kind in ASKED else []
    value = objective.get("value")
    if value is not None:
        saving = _saving(result) if kind == "least_cost" else ""
        lines.append((QUANTITY.get(kind, "value"), f"{value:.7g}{saving}"))
    if kind != "least_cost" and "cost" in result:
        lines.append(("cost", f"{result['cost']:.7g}{_saving(result)}"))
    lines += _proofs(result, objective)
    powers = [f"{name} {_numbers(power)}" for name, power in result.get("power", {}).items()]
    if powers:
        lines.append(("power", ", ".join(powers)))
    return lines


def _saving(result: Result) -> str:
    white = result.get("baseline", {}).get("white", {})
    if "cost" not in white or "ratio" not in white:
        return ""
    return f"   (white excitation: {white['cost']:.7g}, {white['ratio']:.3g} times as much)"


def _proofs(result: Result, objective: Result) -> list[tuple[str, str]]:
    lines = []
    for key, side in (("lower_bound", "below"), ("upper_bound", "above")):
        if key in objective:
            kind = result.get("spectrum", {}).get("type", "such")
            gap = f", gap {objective['relative_gap']:.1e}" if "relative_gap" in objective else ""
            lines.append(("proved", f"no {kind} spectrum gets {side} {objective[key]:.7g}{gap}"))
    if "any_spectrum_bound" in objective:
        text = f"no spectrum at all gets below {objective['any_spectrum_bound']:.7g}"
        lines.append(("" if lines else "proved", text))
    return lines


def _model_error(result: Result, time_unit: str) -> list[tuple[str, str]]:
    error = result.get("model_error", {})
    if "worst_ratio" not in error:
        return []
    where = f" at {error['worst_frequency']:.4g} rad/{time_unit}" if "worst_frequency" in error else ""
    return [("model error", f"r_u / r_adm at most {error['worst_ratio']:.6g}{where}")]


def _signal(result: Result) -> list[tuple[str, str]]:
    signal = result.get("signal", {})
    if "samples" not in signal:
        return []
    parts = [f"{signal['samples']} samples"]
    for key, name in (("power", "power"), ("peak", "peak"), ("crest_factor", "crest factor")):
        if signal.get(key):
            parts.append(f"{name} {_numbers(signal[key])}")
    if "worst_ratio" in signal:
        parts.append(f"r_u / r_adm at most {signal['worst_ratio']:.4g} with these samples")
    return [("signal", ", ".join(parts))]


def _numbers(values: Any) -> str:
    listed = values if isinstance(values, list | tuple) else [values]
    return " ".join(f"{value:.4g}" for value in listed)
