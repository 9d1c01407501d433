"""`experiment.duration` and `limits.duration`: what they are in samples, before a spec is validated."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.wording import show
from inputdesign_cli.specification.yaml.plain import Plain

_WHOLE = 1e-9


def in_samples(data: dict[str, Plain]) -> Iterator[PathDiagnostic]:
    """Put `samples` beside each `duration`: as many as fit.

    An experiment without a length takes all that limits allow, unless the shortest one is asked for.
    A duration or sample time that cannot be read is left to the validation.
    """
    step = data.get("sample_time", 1.0)
    for name in ("experiment", "limits"):
        section = data.get(name)
        if not isinstance(section, dict) or "duration" not in section:
            continue
        duration, path = section["duration"], (name, "duration")
        if "samples" in section:
            message = "{key} stands beside samples, which says the same"
            yield PathDiagnostic("conflicting-keys", message, "remove one of the two", path, at_key=True)
        elif _positive(duration) and _positive(step):
            samples = int(duration / step + _WHOLE)
            if samples < 1:
                message = f"{{key}} is {show(float(duration))}, less than sample_time"
                yield PathDiagnostic("out-of-range", message, "look at sample_time and time_unit", path)
            else:
                section["samples"] = samples
    _take_all(data)


def _take_all(data: dict[str, Plain]) -> None:
    limits, experiment = data.get("limits"), data.get("experiment", {})
    if data.get("objective") == "shortest_experiment" or not isinstance(limits, dict):
        return
    if isinstance(experiment, dict) and not {"samples", "duration"} & experiment.keys():
        most = limits.get("samples")
        if isinstance(most, int) and _positive(most):
            data["experiment"] = {**experiment, "samples": most}


def _positive(value: Plain) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1e40
