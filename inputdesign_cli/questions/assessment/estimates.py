"""`identification` and `information` of `result.json`, and `model.yaml`, of an estimate."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.findings.rivals import rival_entries
from inputdesign_cli.identification import Estimate, ResidualTest, Rival, ScoreTest
from inputdesign_cli.outcome import Identification, Information
from inputdesign_cli.outcome.estimate import PriorAgreement, Test
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model
from inputdesign_cli.records import Preparation
from inputdesign_cli.specification import is_prior


def identification_entry(
    estimate: Estimate, preparation: Preparation, ruled_out: Sequence[Rival]
) -> Identification:
    """Return `identification` of `result.json`."""
    single, centred = estimate.noise.size == 1, preparation.detrend == "constant"
    levels = None if centred else dict(preparation.levels)
    return Identification(
        theta=dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        standard_deviation=_deviations(estimate),
        variance=float(estimate.noise[0, 0]) if single else tuple(map(tuple, estimate.noise.tolist())),
        converged=estimate.search.converged,
        steps=estimate.search.steps,
        starts=estimate.search.starts,
        whiteness=_test(estimate.tests.whiteness),
        independence=_test(estimate.tests.independence),
        tests={test.name: _test(test, test.lag) for test in estimate.tests.all},
        failed=tuple(test.name for test in estimate.tests.failed),
        free_start=estimate.start.free,
        rivals=rival_entries(estimate, estimate.search.rivals) or None,
        ruled_out=rival_entries(estimate, ruled_out) or None,
        prior=None if estimate.prior is None else PriorAgreement(estimate.prior.differing),
        records=tuple(estimate.lengths) if len(estimate.lengths) > 1 else None,
        means_removed=centred or None,
        operating_point=levels or None,
        fit_percent=estimate.simulation.fit[0] if single else tuple(estimate.simulation.fit),
    )


def information_entry(estimate: Estimate) -> Information:
    """Return `information` of `result.json`."""
    return Information(estimate.names, estimate.information, estimate.covariance, _deviations(estimate))


def _deviations(estimate: Estimate) -> dict[str, float]:
    deviations = np.sqrt(np.diag(estimate.covariance))
    return dict(zip(estimate.names, deviations.tolist(), strict=True))


def _test(test: ResidualTest | ScoreTest, lag: int | None = None) -> Test:
    return Test(test.statistic, test.freedom, test.probability, lag)


def model_text(units: Units, model: Model, estimate: Estimate) -> str:
    """Return the blocks to paste, with the clock of the data and the prior for a next experiment."""
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
            "  # No covariance: it is singular to rounding, for the data do not distinguish some of these.",
            "  # Take more data, or fewer parameters; this file is no prior.",
        ]
    return "\n".join(lines) + "\n"
