"""Noise stated by its standard deviation and correlation time, as `variance`, `C` and `D`."""

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
WHITE, _DRIFTING = 0.2, 1e5
_SIZE, _TIME = "standard_deviation", "correlation_time"
_ALTERNATIVES = ("variance", "relative_std", "C", "D")
DRIFT_STEP = 0.2  # move of an added drift in a sample, in standard deviations of the noise


def in_filters(data: dict[str, Plain]) -> Iterator[PathDiagnostic]:
    """Add `variance`, `D` and, if it drifts, `C` to each noise that is stated by its standard deviation."""
    plant, study = data.get("plant"), data.get("simulation")
    true = study if isinstance(study, dict) else {}
    for path, noise, of in (
        (("noise",), data.get("noise"), plant),
        (("simulation", "noise"), true.get("noise"), true.get("plant", plant)),
    ):
        if isinstance(noise, dict) and {_SIZE, _TIME} & noise.keys():
            found = list(_faults(data, noise, of if isinstance(of, dict) else {}, path))
            noise.update({"variance": 1.0} if found else _filter(noise, data.get("sample_time", 1.0)))
            yield from found


def discrete(deviation: float, time: float, step: float) -> tuple[float, float]:
    """Return the variance of e and the pole a of noise with a standard deviation and a correlation time.

    Sampled with a step h, a Gauss-Markov process of standard deviation s and correlation time T is exactly
    v(t) = a v(t - 1) + e(t). Here a = exp(-h/T) and var e = s^2 (1 - a^2), so that its autocovariance at a
    lag of k samples is s^2 exp(-k h/T). If T is zero, it is white.
    """
    return (
        (deviation**2 * -expm1(-2.0 * step / time), 1.0 + expm1(-step / time))
        if time
        else (deviation**2, 0.0)
    )


def drifting(variance: float, pole: float) -> tuple[float, float]:
    """Return the variance of e and c of (1 - c q^-1) / ((1 - a q^-1)(1 - q^-1)) e, noise that also drifts.

    It is the sum of noise with the pole a and this `variance` of its e, and of an independent random walk. In
    a sample the walk moves by `DRIFT_STEP` of the noise's standard deviation. The spectral factor is exact.
    """
    walk = DRIFT_STEP**2 / (1.0 - pole**2)  # the variance of a move over that of e
    root = (1.0 - pole) * (walk * (4.0 + walk * (1.0 + pole) ** 2)) ** 0.5
    factor = (2.0 + walk * (1.0 + pole**2) + root) / 2.0
    return variance * factor, (1.0 + walk * pole) / factor


def _numbers(value: Plain, sizes: tuple[float, float] = QUANTITIES) -> list[float]:
    """Return one number or several as a list, which is empty unless all lie within `sizes`."""
    listed = value if isinstance(value, list) else [value]
    numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in listed)
    return [float(x) for x in listed] if numbers and all(sizes[0] <= x <= sizes[1] for x in listed) else []


def _filter(noise: dict[str, Plain], step: Plain) -> dict[str, Plain]:
    deviations, steps = _numbers(noise[_SIZE], DEVIATIONS), _numbers(step)
    times = _numbers(noise[_TIME]) if _TIME in noise else [0.0]
    if not (deviations and times and steps) or len({len(deviations), len(times)} - {1}) > 1:
        return {"variance": 1.0}  # validation reports these values
    rows = [discrete(s, T, steps[0]) for s, T in np.broadcast(deviations, times)]
    shapes = [[1.0, -pole] if pole else [1.0] for _, pole in rows]
    drifts = bool(noise.get("drift"))
    sums = [drifting(*row) if drifts else (row[0], 0.0) for row in rows]
    curves = [[1.0, -zero] for _, zero in sums]
    several = isinstance(noise[_SIZE], list) or isinstance(noise.get(_TIME), list)
    moving = {"C": curves if several else curves[0]} if drifts else {}
    if several:
        return {"variance": np.diag([one for one, _ in sums]).tolist(), "D": shapes, **moving}
    return {"variance": sums[0][0], "D": shapes[0], **moving}


def _faults(
    data: dict[str, Plain], noise: dict[str, Plain], plant: dict[str, Plain], path: Path
) -> Iterator[PathDiagnostic]:
    """Yield diagnostics of noise that is stated twice, not at all, or unsuitably for plant or samples."""
    timed = (*path, _TIME)
    if _SIZE not in noise:
        message = "{key} stands without standard_deviation, which says how large the noise is"
        hint = "add standard_deviation: 0.1, or write variance, C and D in place of both"
        yield PathDiagnostic("missing-key", message, hint, timed, at_key=True)
        return
    for key in (key for key in _ALTERNATIVES if key in noise):
        message = "{key} stands beside standard_deviation, which states the noise alone"
        yield PathDiagnostic("conflicting-keys", message, "remove it", (*path, key), at_key=True)
    if isinstance(noise.get("drift"), list):
        message = "{key} is a list, and beside standard_deviation it holds for all outputs"
        hint = "write drift: true, or variance, C, D and drift"
        yield PathDiagnostic("wrong-shape", message, hint, (*path, "drift"))
    states, key, unfit = plant.get("state_space"), _SIZE, ("", "")
    if np.size(plant.get("A", 1)) > 1 and "B" in plant:
        hint = "write the poles as F in place of A (output error or Box-Jenkins), or variance, C and D"
        unfit = "with A the noise is C/(A D) e, which fades as A does", hint
    elif isinstance(states, dict) and "K" in states:
        unfit = "K of the state space says how the noise is coloured", "remove K, or write variance"
    elif "continuous" in plant and "sample" not in plant:
        unfit = "the plant is not sampled", "add sample: zoh to the plant, or write variance"
    elif "regression" in plant and _TIME in noise:
        key, unfit = _TIME, ("the noise of a regression is white", "remove correlation_time")
    if unfit[0]:
        message = f"{{key}} does not go with this plant: {unfit[0]}"
        yield PathDiagnostic("unsuitable-key", message, unfit[1], (*path, key))
    if noise.get(_TIME) is not None and "sample_time" not in data:
        message = "{key} needs sample_time, which decides how much of the noise is left in the next sample"
        yield PathDiagnostic("missing-key", message, "add sample_time: 10, in time_unit", timed, at_key=True)
        return
    for time, step in ((T, h) for T in _numbers(noise.get(_TIME)) for h in _numbers(data.get("sample_time"))):
        lasts = f"{{key}} is {show(time)}, and samples are {show(step)} apart"
        if time < WHITE * step:
            hint = f"remove it, or write a sample_time of at most {show(time / WHITE)}"
            yield PathDiagnostic("out-of-range", f"{lasts}: such noise is white in them", hint, timed)
        elif time > _DRIFTING * step:
            hint = "write {variance: .., C: [1, -0.8], drift: true}; are both in time_unit?"
            yield PathDiagnostic("out-of-range", f"{lasts}: such noise is a drift", hint, timed)
