"""What `result.json` and `model.yaml` say of an estimate, of one channel or several."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from inputdesign_cli.identification import ChannelEstimate, Estimate, ResidualTest
from inputdesign_cli.plant.polynomial import Array, roots_in_z

# A residual test below this probability speaks against the model.
REFUTED = 0.01

AnyEstimate = Estimate | ChannelEstimate
Blocks = dict[str, dict[str, Any]]


def identification_entry(estimate: AnyEstimate, variance: Any, fit: Any) -> dict[str, Any]:
    """`identification` of `result.json`.

    Args:
        variance: of e, a number or its covariance matrix.
        fit: per cent, a number or one an output; None where the model cannot be simulated.
    """
    entry: dict[str, Any] = {
        "theta": dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        "standard_deviation": _deviations(estimate),
        "variance": variance,
        "converged": estimate.converged,
        "steps": estimate.steps,
        "starts": estimate.starts,
        "whiteness": _test(estimate.whiteness),
        "independence": _test(estimate.independence),
    }
    if fit is not None:
        entry["fit_percent"] = fit
    return entry


def estimate_result(
    title: str, samples: int, estimate: AnyEstimate, entry: Mapping[str, Any]
) -> dict[str, Any]:
    """The head of `result.json`; `entry` is its `identification`."""
    return {
        "format": 1,
        "title": title,
        "status": "identified" if estimate.converged else "not_converged",
        "samples": samples,
        "identification": entry,
        "information": {
            "parameters": list(estimate.names),
            "matrix": estimate.information,
            "covariance": estimate.covariance,
            "standard_deviation": _deviations(estimate),
        },
    }


def _deviations(estimate: AnyEstimate) -> dict[str, float]:
    deviations = np.sqrt(np.diag(estimate.covariance))
    return dict(zip(estimate.names, deviations.tolist(), strict=True))


def _test(test: ResidualTest) -> dict[str, Any]:
    return {
        "statistic": test.statistic,
        "degrees_of_freedom": test.freedom,
        "probability": test.probability,
    }


def model_notes(estimate: AnyEstimate, predictor: Mapping[str, Sequence[Array]]) -> list[str]:
    """What speaks against trusting the estimate.

    Args:
        predictor: the polynomials that must be stable: "C", "D" and "F".
    """
    notes, samples = [], len(estimate.errors)
    if not estimate.converged:
        notes.append(
            f"the search did not settle after {estimate.steps} steps from the best of {estimate.starts} "
            "starts: the estimate may be far from the minimum; the orders may be too high for these data"
        )
    at_the_edge = [
        letter
        for letter, polynomials in predictor.items()
        if any(np.any(np.abs(roots_in_z(p)) > 1.0 - 1.0 / samples) for p in polynomials)
    ]
    if at_the_edge:
        notes.append(
            f"{' and '.join(at_the_edge)} has a root on the unit circle, as far as {samples} "
            "samples can tell: the covariance is not to be trusted there, and a design on this model would "
            "count on noise that vanishes or never fades; take more data, or a lower order"
        )
    if estimate.whiteness.probability < REFUTED:
        remedy = "raise the orders of C and D (or A)" if predictor else "a model in q^-1 can describe it"
        notes.append(
            f"the residuals are not white (probability {estimate.whiteness.probability:.1e}): the noise has "
            f"more structure than the model, and the covariance is not to be trusted; {remedy}"
        )
    if estimate.independence.probability < REFUTED:
        remedy = ", or another delay; raise the orders of B and F (or A)" if predictor else ""
        notes.append(
            f"past inputs explain residuals (probability {estimate.independence.probability:.1e}): the plant "
            f"has more structure than the model{remedy}"
        )
    deviations = np.sqrt(np.diag(estimate.covariance))
    vague = [n for n, v, s in zip(estimate.names, estimate.theta, deviations, strict=True) if s > abs(v)]
    if vague:
        notes.append(f"zero lies within a standard deviation of {', '.join(vague)}: an order may be too high")
    return notes


def model_text(blocks: Blocks, estimate: AnyEstimate) -> str:
    """The blocks to paste, with the covariance and, as a comment, the same as prior information."""
    lines = [
        f"# Estimated from {len(estimate.errors)} samples: paste in place of the blocks of the same names,",
        "# or write include: and the name of this file in a spec without them.",
    ]
    for key, block in blocks.items():
        lines += [f"{key}:", *(f"  {name}: {json.dumps(value)}" for name, value in block.items())]
    names = ", ".join(estimate.names)
    quoted = names if "[" not in names else ", ".join(json.dumps(name) for name in estimate.names)
    lines += [
        "",
        f"# Covariance of {names}:",
        *(f"#   {json.dumps(row)}" for row in estimate.covariance.tolist()),
        "",
        "# To count these data as prior information of the next experiment, uncomment:",
        "# experiment:",
        "#   prior:",
        f"#     parameters: [{quoted}]",
        "#     information:",
        *(f"#       - {json.dumps(row)}" for row in estimate.information.tolist()),
    ]
    return "\n".join(lines) + "\n"
