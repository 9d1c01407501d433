"""The summary of a run in the terminal: a few aligned lines, the same in a pipe."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.runs.objectives import OBJECTIVES, objective
from inputdesign_cli.runs.results import Json, Result

GIVEN = {"given": "", "met": ": it meets the accuracy", "missed": ": it misses the accuracy"}


def summary(result: Result, time_unit: str, files: Sequence[Path]) -> str:
    """What was asked, what it costs, what is proved, how close the error comes, and where the files are.

    Lines whose numbers the result does not have are left out.
    """
    lines = [
        *_identified(result),
        *_assessed(result, time_unit),
        *_objective(result),
        *_limits(result),
        *_model_error(result, time_unit),
        *_regression(result),
        *_deviations(result),
        *_signal(result),
        *_simulation(result),
        *_regression_study(result),
        *(("note", text) for text in result.get("notes", [])),
        ("files", f"{files[-1].parent}: {', '.join(file.name for file in files)}"),
    ]
    title = result.get("title")
    return "\n".join([*([title, ""] if title else []), *aligned(lines, gap=3, wrap=True)])


def _identified(result: Result) -> list[tuple[str, str]]:
    """An estimate with its standard deviations, and whether the residuals speak for it."""
    found = result.get("identification")
    if found is None:
        return []
    deviations = found["standard_deviation"]
    values = [f"{name} {value:.5g} +- {deviations[name]:.2g}" for name, value in found["theta"].items()]
    lines = [("estimate", ", ".join(values)), ("", f"noise {_variance(found['variance'])}")]
    if "fit_percent" in found:
        lines[-1] = ("", f"{lines[-1][1]}, simulation explains {_explained(found['fit_percent'])}")
    tests = [f"{name} {found[name]['probability']:.2g}" for name in ("whiteness", "independence")]
    lines.append(("residuals", f"probability of {', of '.join(tests)}"))
    return lines


def _variance(value: Json) -> str:
    """A variance, or a covariance matrix row by row."""
    if not isinstance(value, list):
        return f"variance {value:.5g}"
    return f"covariance [{'; '.join(_numbers(row) for row in value)}]"


def _explained(value: Json) -> str:
    """The fit of the output, or of each output; a dash where the model cannot be simulated."""
    if not isinstance(value, list):
        return f"{value:.1f} % of the output"
    shares = ["-" if share is None else f"{share:.1f}" for share in value]
    return f"{' and '.join(shares)} % of the outputs"


def _assessed(result: Result, time_unit: str) -> list[tuple[str, str]]:
    """Each requirement with what the data reach, and what comes next."""
    assessment = result.get("assessment")
    if assessment is None:
        return []
    lines: list[tuple[str, str]] = []
    for entry in assessment["requirements"]:
        where = f" at {entry['frequency']:.4g} rad/{time_unit}" if "frequency" in entry else ""
        word = "met" if entry["worst_ratio"] <= 1.0 + 1e-9 else "missed"
        share = f"{entry['worst_ratio']:.4g} of the admissible"
        name = " ".join([entry["name"], *([entry["entry"]] if "entry" in entry else [])])
        text = f"{name} {word}: the error that these data give is {share}"
        lines.append(("" if lines else "assessed", text + where))
    if "top_up_status" in assessment:
        lines.append(("top-up", "the experiment below makes up for it, after these data"))
    return lines


def _objective(result: Result) -> list[tuple[str, str]]:
    found = result.get("objective", {})
    kind = found.get("kind")
    lines = [("asked", objective(kind).asked)] if kind in OBJECTIVES else []
    if result.get("status") in GIVEN and "identification" not in result:
        lines = [("asked", f"what the given excitation buys{GIVEN[result['status']]}")]
    value = found.get("value")
    if value is not None:
        saving = _saving(result) if kind in ("least_cost", "closed_loop_error") else _white_value(result)
        name = "energy" if "moments" in result and kind == "least_cost" else objective(kind).quantity
        lines.append((name, f"{_clean(value)}{saving}"))
    if kind != "least_cost" and "cost" in result:
        lines.append(("energy" if "moments" in result else "cost", f"{result['cost']:.7g}"))
    lines += _proofs(result, found)
    powers = [f"{name} {_numbers(power)}" for name, power in result.get("power", {}).items()]
    if powers:
        lines.append(("power", ", ".join(powers)))
    return lines


def _saving(result: Result) -> str:
    white = result.get("baseline", {}).get("white", {})
    if "value" in white and "ratio" in white:
        return f"   (white noise of the same power: {white['value']:.7g}, {white['ratio']:.3g} times as much)"
    if "cost" not in white or "ratio" not in white:
        return ""
    if not white["cost"]:
        return ""
    return f"   (white excitation: {white['cost']:.7g}, {white['ratio']:.3g} times as much)"


def _white_value(result: Result) -> str:
    """What white excitation within the same limits reaches instead."""
    white = result.get("baseline", {}).get("white", {})
    reached = white.get("samples", white.get("value"))
    return "" if reached is None else f"   (white excitation: {_clean(reached)})"


def _clean(value: float) -> str:
    """Seven digits; the logarithm of one is zero, whatever rounding says."""
    return f"{0.0 if abs(value) < 1e-12 else value:.7g}"


def _limits(result: Result) -> list[tuple[str, str]]:
    """The limits that bind."""
    binding = [entry["name"].replace("_", " ") for entry in result.get("limits", []) if entry["binding"]]
    return [("limits", f"{', '.join(dict.fromkeys(binding))} exhausted")] if binding else []


def _proofs(result: Result, found: Result) -> list[tuple[str, str]]:
    lines = []
    for key, side in (("lower_bound", "below"), ("upper_bound", "above")):
        if key in found:
            kind = result.get("spectrum", {}).get("type", "such")
            family = f"no {kind} spectrum gets"
            if "moments" in result:
                family = f"no {result['moments']['structure']} moments get"
            gap = f", gap {found['relative_gap']:.1e}" if "relative_gap" in found else ""
            lines.append(("proved", f"{family} {side} {found[key]:.7g}{gap}"))
    if "any_spectrum_bound" in found:
        side = "above" if objective(found.get("kind")).maximised else "below"
        text = f"no spectrum at all gets {side} {found['any_spectrum_bound']:.7g}"
        lines.append(("" if lines else "proved", text))
    return lines


def _model_error(result: Result, time_unit: str) -> list[tuple[str, str]]:
    error = result.get("model_error", {})
    if "worst_ratio" not in error:
        return []
    where = f" at {error['worst_frequency']:.4g} rad/{time_unit}" if "worst_frequency" in error else ""
    return [("model error", f"r_u / r_adm at most {error['worst_ratio']:.6g}{where}")]


def _deviations(result: Result) -> list[tuple[str, str]]:
    """Of a given excitation, the predicted standard deviations of the parameters."""
    deviations = result.get("information", {}).get("standard_deviation")
    if result.get("status") not in GIVEN or "identification" in result or not deviations:
        return []
    return [("std", ", ".join(f"{name} {value:.4g}" for name, value in deviations.items()))]


def _regression(result: Result) -> list[tuple[str, str]]:
    error = result.get("mean_squared_error")
    if error is None:
        return []
    parts = f"squared bias {error['bias_squared']:.6g} + variance {error['variance']:.6g}"
    white = result.get("baseline", {}).get("white", {}).get("mean_squared_error")
    compared = "" if white is None else f"   (white regressors: {white:.6g})"
    return [("error", f"{error['value']:.6g} = {parts}{compared}")]


def _regression_study(result: Result) -> list[tuple[str, str]]:
    """Inputs of a study with a mean-squared error, one line each."""
    lines: list[tuple[str, str]] = []
    for name, entry in result.get("simulation", {}).get("inputs", {}).items():
        if "mse" in entry:
            spread = f" +- {entry['mse_standard_error']:.2g}" if "mse_standard_error" in entry else ""
            theory = f" (theory {entry['theory']['mse']:.6g})" if "theory" in entry else ""
            mean = _numbers(entry["mean_estimate"])
            lines.append(
                (
                    "" if lines else "simulated",
                    f"{name}: error {entry['mse']:.4g}{spread}{theory}, mean estimate {mean}",
                )
            )
    return lines


def _signal(result: Result) -> list[tuple[str, str]]:
    signal = result.get("signal", {})
    if "samples" not in signal:
        return []
    parts = [f"{signal['samples']} samples"]
    for key, name in (("power", "power"), ("peak", "peak"), ("crest_factor", "crest factor")):
        if signal.get(key):
            parts.append(f"{name} {_numbers(signal[key])}")
    if "mean_squared_error" in signal:
        parts.append(f"error {signal['mean_squared_error']:.6g} with these samples")
    if "worst_ratio" in signal:
        ratio = (
            "r_u / r_adm" if "worst_ratio" in result.get("model_error", {}) else "ratio to the requirement"
        )
        parts.append(f"{ratio} at most {signal['worst_ratio']:.4g} with these samples")
    if abs(signal.get("extra_power", 0.0)) >= 5e-5:
        more = signal["extra_power"]
        parts.append(f"costs {abs(100 * more):.3g} % {'more' if more > 0 else 'less'} than the design")
    if "criterion" in signal:
        parts.append(f"criterion {signal['criterion']:.6g} with these samples")
    return [("signal", ", ".join(parts))]


def _simulation(result: Result) -> list[tuple[str, str]]:
    lines: list[tuple[str, str]] = []
    simulation = result.get("simulation", {})
    for name, entry in simulation.get("inputs", {}).items():
        if "loss" in entry:
            loss, theory = entry["loss"], entry["theory"]["loss"]
            text = (
                f"{name}: loss {loss['mean']:.4g} +- {loss['sd']:.4g} over {simulation['runs']} runs "
                f"(theory {theory['mean']:.4g} +- {theory['sd']:.4g})"
            )
            lines.append(("" if lines else "simulated", text))
        if "within_r_u" in entry or "within_r_adm" in entry:
            lines.append(("" if lines else "simulated", f"{name.replace('_', ' ')}: {_within(entry)}"))
    if "improvement" in simulation:
        share = simulation["improvement"]
        lines.append(
            ("", f"{100 * share['measured']:.1f} % better than white (theory {100 * share['theory']:.1f} %)")
        )
    return lines


def _within(entry: Result) -> str:
    """How many runs stayed within the bounds, with 95 % limits, and what they cost."""
    parts = []
    for name in ("r_adm", "r_u"):
        if f"within_{name}" in entry:
            low, high = entry[f"within_{name}_limits"]
            share = f"{100 * entry[f'within_{name}']:.1f} % of runs within {name}"
            parts.append(f"{share} (95 % limits {100 * low:.1f} to {100 * high:.1f})")
    if "within_r_adm" in entry.get("on_design_model", {}):
        share = 100 * entry["on_design_model"]["within_r_adm"]
        parts.insert(1, f"{share:.1f} % were the design model true")
    if entry.get("not_converged"):
        parts.append(f"{entry['not_converged']} runs did not converge")
    return ", ".join([*parts, f"cost {entry['cost']:.4g}"])


def _numbers(values: Json) -> str:
    listed = values if isinstance(values, list | tuple) else [values]
    return " ".join(f"{value:.4g}" for value in listed)
