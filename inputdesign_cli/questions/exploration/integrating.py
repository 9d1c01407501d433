"""Entries of G that a record cannot tell from integrators."""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.explore import Found
from inputdesign_cli.explore.fits import NOT_COMPUTED
from inputdesign_cli.identification.estimators import identify
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import parse_spec

# The static gain is within so many deviations of none, that at some frequency of the record is not; and the
# first is larger by this factor: G still rises there towards low frequencies.
_UNTOLD, _TOLD, _RISING = 3.0, 4.0, 2.0
_FREQUENCIES, _HIGHEST = 40, 1.0
_STATIC = 1e-6  # of the lowest frequency of a record: as good as zero
_LATE = 0.1
# Without it, what is fed back would be taken for what the model lacks.
CONTROLLER = "the controller as it was, experiment: {controller: {numerator: [..], denominator: [..]}}"
# What wanders beside an integrator would be taken for its own doing.
_WALK = "noise: {variance: 1, C: [1, -0.1], drift: true}"


def like_integrators(found: Found, step: float, unit: str, *, loop: bool) -> tuple[str, ...]:
    """A sentence for every entry whose static gain, hence whose slowest time constant, nothing tells.

    Args:
        step, unit: the sample time.
        loop: whether inputs answer the outputs.
    """
    model, told = found.model, []
    single = model.outputs == model.inputs == 1
    w = _frequencies(found)
    with np.errstate(all="ignore"):
        change, G = model.plant_gradient(w), model.plant_at(w)
        for i in range(model.outputs):
            for k, j in enumerate(found.moving):
                size, deviations = np.abs(G[:, i, j]), _deviations(found, change[:, :, i, j].T)
                if _rises(size, deviations):
                    at = 1 + int(np.argmin(deviations[1:] / size[1:]))
                    where = "" if single else f" from u{j + 1} to y{i + 1}"
                    gain = f"{size[0]:.3g} +- {deviations[0]:.1g}"
                    late = max(found.taken[i].orders.delays[k] - 1, 0)
                    slope = float(np.copysign(w[at] * size[at] / step, G[0, i, j].real))
                    offer = _offer(slope, step, unit, late)
                    besides = f", and {CONTROLLER}" if loop else ""
                    if single and not loop and _wanders_besides(found, offer):
                        besides = f", and {_WALK}"
                    told.append(_sentence(where, gain, offer, besides))
    return tuple(told)


def clock_of(step: float, unit: str) -> str:
    """The keys of a spec that say the sample time."""
    keys = {"sample_time": f"{step:.6g}", **({} if unit == "s" else {"time_unit": unit})}
    return ", ".join(f"{key}: {value}" for key, value in keys.items())


def _frequencies(found: Found) -> Array:
    """(n,), rad per sample: as good as zero, then from the lowest of the longest record on."""
    lowest = 2.0 * np.pi / max(len(y) for _, y in found.used)
    return np.concatenate([[_STATIC * lowest], np.geomspace(lowest, max(_HIGHEST, lowest), _FREQUENCIES)])


def _rises(size: Array, deviations: Array) -> bool:
    """Whether |G| (n,), the first of them static, is told where it still rises, and its end is not."""
    if not (np.all(np.isfinite(size)) and np.all(np.isfinite(deviations))):
        return False
    told = (size > _TOLD * deviations) & (_RISING * size < size[0])
    return bool(size[0] < _UNTOLD * deviations[0] and np.any(told))


def _deviations(found: Found, change: ComplexArray) -> Array:
    """(n,): standard deviations of values whose real and imaginary parts have gradients `change` (k, n)."""
    if not np.all(np.isfinite(change)):
        return np.full(change.shape[1], np.nan)
    factor = found.estimate.factor
    parts = [scipy.linalg.solve_triangular(factor, x, lower=True) for x in (change.real, change.imag)]
    return np.asarray(np.sqrt(np.sum([np.sum(part**2, axis=0) for part in parts], axis=0)))


def _offer(slope: float, step: float, unit: str, late: int) -> tuple[str, str, str]:
    """The slope in words, then lines of a spec: its clock, and an integrator so many samples late.

    Args:
        slope: what it gains in a unit of time from an input of one.
    """
    delay = f"{max(late, _LATE) * step:.4g}"
    plant = (
        f"plant: {{parameters: {{K: {slope:.4g}, L: {delay}}}, continuous: {{numerator: [K], "
        "denominator: [1, 0], delay: L}, sample: zoh}"
    )
    return f"{slope:.4g} per {unit} for an input of one", clock_of(step, unit), plant


def _wanders_besides(found: Found, offer: tuple[str, str, str]) -> bool:
    """Whether noise that integrates explains the record better, by BIC, beside the integrator itself."""
    u, y = (np.concatenate(signals) for signals in zip(*found.used, strict=True))
    criteria = []
    for noise in ("noise: {variance: 1}", _WALK):
        lines = [*offer[1].split(", "), offer[2], noise]
        model = build_model(parse_spec("\n".join(lines), design=False))
        try:
            estimate = identify(model, u, y, lengths=[len(part) for _, part in found.used], rest=False)
        except NOT_COMPUTED:
            criteria.append(np.inf)
            continue
        size = estimate.theta.size * np.log(len(y))
        criteria.append(len(y) * float(np.log(estimate.noise[0, 0])) + float(size))
    return bool(criteria[1] < criteria[0])


def _sentence(where: str, gain: str, offer: tuple[str, str, str], besides: str) -> str:
    slope, clock, plant = offer
    sort = "an integrator" if not where else "a matrix with an integrator there"
    return (
        f"the plant{where} cannot be told from an integrator (its static gain is {gain}): no time constant "
        f"follows from this record, only the slope, {slope}. Record until "
        f"the output settles; or, if it never does, identify {sort}: idesign identify DATA --spec SPEC, in "
        f"SPEC {clock} and {plant}{besides}"
    )
