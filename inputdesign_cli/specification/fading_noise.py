"""Noise in an engineer's words, its standard deviation and how fast it fades, as `variance` and `D`."""

from __future__ import annotations

from collections.abc import Iterator
from math import expm1

import numpy as np

from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.sizes import DEVIATIONS, QUANTITIES
from inputdesign_cli.specification.models.wording import show
from inputdesign_cli.specification.yaml.places import Path
from inputdesign_cli.specification.yaml.plain import Plain

# Correlation times in samples: below the first noise is white, above the second it drifts.
_WHITE, _DRIFTING = 0.2, 1e5
_WORDS = ("standard_deviation", "correlation_time")
_ELSE = ("variance", "relative_std", "C", "D", "drift")


def in_filters(data: dict[str, Plain]) -> Iterator[PathDiagnostic]:
    """Add `variance` and `D` to each noise that is stated by its standard deviation.

    Noise of standard deviation s with the correlation time T (a Gauss-Markov process) is in samples h apart
    exactly v(t) = a v(t - 1) + e(t), where a = exp(-h/T) and var e = s^2 (1 - a^2). Its autocovariance at a
    lag of k samples is s^2 exp(-k h/T). Without a correlation time it is white.
    """
    study = data.get("simulation")
    true = study if isinstance(study, dict) else {}
    plant = data.get("plant")
    for path, noise, of in (
        (("noise",), data.get("noise"), plant),
        (("simulation", "noise"), true.get("noise"), true.get("plant", plant)),
    ):
        if isinstance(noise, dict) and set(_WORDS) & noise.keys():
            found = [*_contradictions(noise, path), *_unheld(of, noise, path), *_unsampled(data, noise, path)]
            noise.update({"variance": 1.0} if found else _filter(noise, data.get("sample_time", 1.0)))
            yield from found


def discrete(deviation: float, time: float, step: float) -> tuple[float, float]:
    """Return the variance of e and the pole a of noise with a standard deviation and a correlation time."""
    return deviation**2 * -expm1(-2.0 * step / time), 1.0 + expm1(-step / time)


def _numbers(value: Plain, sizes: tuple[float, float] = QUANTITIES) -> list[float]:
    """Return one number or several as a list; an empty one if they are none of these sizes."""
    listed = value if isinstance(value, list) else [value]
    numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in listed)
    return [float(x) for x in listed] if numbers and all(sizes[0] <= x <= sizes[1] for x in listed) else []


def _filter(noise: dict[str, Plain], step: Plain) -> dict[str, Plain]:
    deviations, steps = _numbers(noise.get("standard_deviation"), DEVIATIONS), _numbers(step)
    times = _numbers(noise["correlation_time"]) if "correlation_time" in noise else [0.0]
    sizes = {len(deviations), len(times)} - {1}
    if not deviations or not times or not steps or len(sizes) > 1:
        return {"variance": 1.0}  # the values have errors of their own
    rows = [discrete(s, T, steps[0]) if T else (s**2, 0.0) for s, T in np.broadcast(deviations, times)]
    several = any(isinstance(noise.get(word), list) for word in _WORDS)
    shape = [[1.0, -pole] if pole else [1.0] for _, pole in rows]
    variance = np.diag([one for one, _ in rows]).tolist() if several else rows[0][0]
    return {"variance": variance, "D": shape if several else shape[0]}


def _contradictions(noise: dict[str, Plain], path: Path) -> Iterator[PathDiagnostic]:
    """Find keys that state the noise a second time, and a correlation time alone."""
    if "standard_deviation" not in noise:
        message = "{key} stands without standard_deviation, which says how large the noise is"
        hint = "add standard_deviation: 0.1, or write variance, C and D in place of both"
        yield PathDiagnostic("missing-key", message, hint, (*path, "correlation_time"), at_key=True)
        return
    for key in (key for key in _ELSE if key in noise):
        message = "{key} stands beside standard_deviation, which states the noise alone"
        hint = "noise that drifts has none: write variance, C and drift" if key == "drift" else "remove it"
        yield PathDiagnostic("conflicting-keys", message, hint, (*path, key), at_key=True)


def _unheld(plant: Plain, noise: dict[str, Plain], path: Path) -> Iterator[PathDiagnostic]:
    """Find plants whose structure cannot hold noise of that kind."""
    if not isinstance(plant, dict):
        return
    key, states = next(word for word in _WORDS if word in noise), plant.get("state_space")
    if np.size(plant.get("A", 1)) > 1 and "B" in plant:
        why = "with A the noise is C/(A D) e, which fades as A does"
        hint = "write the poles as F in place of A (output error or Box-Jenkins), or variance, C and D"
    elif isinstance(states, dict) and "K" in states:
        why, hint = "K of the state space says how the noise is coloured", "remove K, or write variance"
    elif "continuous" in plant and "sample" not in plant:
        why = "the plant is not sampled, and its noise is white"
        hint = "add sample: zoh to the plant, or write variance"
    elif "regression" in plant and "correlation_time" in noise:
        key, why, hint = "correlation_time", "the noise of a regression is white", "remove correlation_time"
    else:
        return
    yield PathDiagnostic("unsuitable-key", f"{{key}} does not go with this plant: {why}", hint, (*path, key))


def _unsampled(data: dict[str, Plain], noise: dict[str, Plain], path: Path) -> Iterator[PathDiagnostic]:
    """Find correlation times that samples cannot show, or of which the sample time is not known."""
    place = (*path, "correlation_time")
    if "correlation_time" not in noise:
        return
    if "sample_time" not in data:
        message = "{key} needs sample_time, which decides how much of the noise is left in the next sample"
        yield PathDiagnostic("missing-key", message, "add sample_time: 10, in time_unit", place, at_key=True)
        return
    for step in _numbers(data["sample_time"]):
        for time in _numbers(noise["correlation_time"]):
            lasts = f"{{key}} is {show(time)}, and samples are {show(step)} apart"
            if time < _WHITE * step:
                hint = f"remove it, or write a sample_time of at most {show(time / _WHITE)}"
                yield PathDiagnostic("out-of-range", f"{lasts}: such noise is white in them", hint, place)
            elif time > _DRIFTING * step:
                hint = "write {variance: .., C: [1, -0.8], drift: true}; are both in time_unit?"
                yield PathDiagnostic("out-of-range", f"{lasts}: such noise is a drift", hint, place)
