"""What `result.json` and `model.yaml` say of an estimate."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.identification import Estimate, ResidualTest, ScoreTest
from inputdesign_cli.identification.stability import without_integrators
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import roots_in_z
from inputdesign_cli.questions.assessment.blocks import blocks_of, predictor_of
from inputdesign_cli.questions.assessment.refutations import contradictions, unsettled
from inputdesign_cli.questions.assessment.remedies import vague_notes
from inputdesign_cli.questions.common.rivals import rival_entries
from inputdesign_cli.specification import is_prior

# A first residual beyond so many standard deviations is named.
_SEEN_AT_ONCE = 3.0
_NORMAL = 1.96  # 95 % of a Gaussian estimate


def identification_entry(estimate: Estimate) -> dict[str, Json]:
    """`identification` of `result.json`."""
    single = estimate.noise.size == 1
    entry: dict[str, Json] = {
        "theta": dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        "standard_deviation": _deviations(estimate),
        "variance": float(estimate.noise[0, 0]) if single else estimate.noise.tolist(),
        "converged": estimate.converged,
        "steps": estimate.steps,
        "starts": estimate.starts,
        "whiteness": _test(estimate.whiteness),
        "independence": _test(estimate.independence),
        "tests": {test.name: _test(test) | _lag(test) for test in estimate.all_tests},
        "failed": [test.name for test in estimate.failed],
        "free_start": estimate.free,
    }
    if estimate.rivals:
        entry["rivals"] = rival_entries(estimate, estimate.rivals)
    if estimate.agreement is not None:
        entry["prior"] = {"probability": estimate.agreement}
    if len(estimate.lengths) > 1:
        entry["records"] = list(estimate.lengths)
    if not single:
        entry["fit_percent"] = list(estimate.fit)
    elif estimate.fit[0] is not None:
        entry["fit_percent"] = estimate.fit[0]
    return entry


def estimate_result(title: str, estimate: Estimate) -> dict[str, Json]:
    """The head of `result.json`."""
    return {
        "format": 1,
        "title": title,
        "status": "identified" if estimate.converged else "not_converged",
        "samples": len(estimate.errors),
        "identification": identification_entry(estimate),
        "information": {
            "parameters": list(estimate.names),
            "matrix": estimate.information,
            "covariance": estimate.covariance,
            "standard_deviation": _deviations(estimate),
        },
    }


def _deviations(estimate: Estimate) -> dict[str, float]:
    deviations = np.sqrt(np.diag(estimate.covariance))
    return dict(zip(estimate.names, deviations.tolist(), strict=True))


def _test(test: ResidualTest | ScoreTest) -> dict[str, Json]:
    return {"statistic": test.statistic, "degrees_of_freedom": test.freedom, "probability": test.probability}


def _lag(test: ScoreTest) -> dict[str, Json]:
    return {} if test.lag is None else {"lag": test.lag}


def _free_start(estimate: Estimate) -> list[str]:
    """Where the levels and starts of the records were estimated: why, with the largest first residual."""
    if not estimate.free:
        return []
    along = "the level of every output and the state at the start were estimated along"
    single = len(estimate.first) == 1
    if not estimate.rest_refuted:
        return [
            f"whether {'the record begins' if single else 'the records begin'} at rest was not asked: {along}"
        ]
    ratio = np.abs(estimate.first) / np.sqrt(np.diag(estimate.noise))
    which, output = np.unravel_index(np.argmax(ratio), ratio.shape)
    first, noise = estimate.first[which, output], np.sqrt(estimate.noise[output, output])
    records = "the record does" if single else "the records do"
    seen = (
        f"a first residual of {first:.3g} where the noise has {noise:.3g}"
        if np.max(ratio) > _SEEN_AT_ONCE
        else "the first residuals together are larger than noise would make them"
    )
    return [
        f"{records} not begin at rest about zero ({seen}): {along}. Where the plant was at rest before, "
        "--operating-point with the levels of inputs and outputs then makes the estimate more certain"
    ]


def identification_notes(
    of_the_data: Sequence[str], model: Model, estimate: Estimate, against: Sequence[str]
) -> list[str]:
    """What a user should know of the data, and what speaks against trusting the estimate.

    Args:
        model: the estimate as a model.
        against: what its tests and the record say against it, and what the inputs do not explain.
    """
    notes, samples, predictor = list(of_the_data), len(estimate.errors), predictor_of(model)
    at_the_edge = [
        letter
        for letter, polynomials in predictor.items()
        if any(np.any(np.abs(roots_in_z(without_integrators(p))) > 1.0 - 1.0 / samples) for p in polynomials)
    ]
    notes += [*unsettled(model, estimate), *_free_start(estimate)]
    if at_the_edge:
        notes.append(
            f"{' and '.join(at_the_edge)} has a root on the unit circle, as far as {samples} "
            "samples can tell: the covariance is not to be trusted there, and a design on this model would "
            "count on noise that vanishes or never fades; take more data, or a lower order"
        )
    notes += against
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = [n for n, v, s in zip(estimate.names, estimate.theta, deviations, strict=True) if s > abs(v)]
    notes += vague_notes(model, vague)
    notes += [
        f"{name} of a dead time cannot be told from zero: {value + _NORMAL * deviation:.3g} at most (95 %)"
        for name, value, deviation, late in zip(
            estimate.names, estimate.theta, deviations, model.dead_times, strict=True
        )
        if late and name in vague
    ]
    if model.continuous and estimate.failed:
        notes.append(
            "the input was taken for the band-limited interpolation of its samples; where it is held "
            "between them, write plant.sample: zoh"
        )
    return notes


def prior_notes(estimate: Estimate, *, stated: bool) -> list[str]:
    """What a prior that the spec `stated` has to do with the estimate."""
    if not stated:
        return []
    if estimate.agreement is None:
        return [
            "experiment.prior does not count for this estimate: it is information without the parameters "
            "that it belongs to; write parameters: {b1: 3.6, ..} beside a matrix, name the model.yaml of the "
            "earlier data, or give their records as further files"
        ]
    counted = (
        "experiment.prior counts: estimate, covariance and accuracy are those of prior and data together"
    )
    return [counted, *contradictions(estimate)]


def model_text(units: Units, model: Model, estimate: Estimate) -> str:
    """The blocks to paste, with the clock of the data, and what the next experiment may take as its prior."""
    lines = [
        f"# Estimated from {len(estimate.errors)} samples: paste in place of the blocks of the same names,",
        "# or write include: and the name of this file in a spec without them.",
        f"sample_time: {units.sample_time!r}",
        f"time_unit: {units.time_unit}",
    ]
    for key, block in blocks_of(model).items():
        lines += [f"{key}:", *(f"  {name}: {json.dumps(value)}" for name, value in block.items())]
    values = dict(zip(estimate.names, estimate.theta.tolist(), strict=True))
    lines += [
        "# How far to trust them; a later spec may say experiment: {prior: {information: model.yaml}}.",
        "estimate:",
        f"  parameters: {json.dumps(values)}",
    ]
    covariance = estimate.covariance.tolist()
    if is_prior(values, covariance):
        lines += ["  covariance:", *(f"    - {json.dumps(row)}" for row in covariance)]
    else:
        lines += [
            "  # No covariance: it is singular to rounding, for the data do not tell some of these apart.",
            "  # Take more data, or fewer parameters; this file is no prior.",
        ]
    return "\n".join(lines) + "\n"
