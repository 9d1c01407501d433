"""The last check of a frequency response: what is about to be written, reread, and evaluated by other means.

The powers are those of `result.json` as text, and the record is that of signal.csv: what it tells is read off
its own transforms.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import weights_of
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.outcome.results import Json, Results
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text, json_text
from inputdesign_cli.questions.frequency_response.outcome import Planned, ResponseTerms

# Two ways to the same number may differ by this share of it.
_APART = 1e-6


def audit_response(terms: ResponseTerms, plan: Planned, results: Results) -> None:
    """Compare what the result claims with what its own lines and its own record give.

    Raises:
        InaccurateError: `internal-disagreement`.
    """
    written = json.loads(json_text(results.result))
    _, *samples = csv_columns(csv_text(results.tables["signal"]).encode()).values()
    record = np.stack(samples, axis=1)
    for claim in [*_of_lines(terms, written), *_of_record(terms, plan, written, record)]:
        raise InaccurateError.because(
            "internal-disagreement",
            claim,
            hint="rescale the signals, or leave out lines where |G| is very small; if the spec is plain, "
            "please report it: the spec is enough to see the same",
            key="accuracy",
        )


def _of_lines(terms: ResponseTerms, written: Mapping[str, Json]) -> Iterator[str]:
    """What the written powers do not bear out, one sentence each."""
    unit = terms.header.units.frequency
    w = np.array(written["spectrum"]["frequencies"]) * unit
    listed = np.array(written["spectrum"]["powers"], dtype=float)
    powers = listed[:, None] if listed.ndim == 1 else np.einsum("laa->la", listed)
    G = terms.experiment.model.plant_at(w)
    claimed = written["frequency_response"]
    ratios = [
        np.sqrt(2.0 * terms.lines.noise[:, i] / (claimed["counted"] * powers[:, j])) / admitted
        for i, j in np.ndindex(G.shape[1:])
        if np.all(np.isfinite(admitted := terms.lines.admitted[:, i, j]))
    ]
    worst = float(np.max(ratios))
    if not abs(worst - claimed["worst_ratio"]) <= _APART * worst:
        yield f"the lines leave {worst:.10g} times the deviation admitted, not {claimed['worst_ratio']:.10g}"
    if terms.goal in ("cost", "samples") and not worst <= 1.0 + _APART:
        yield f"the lines leave {worst:.10g} times the deviation that is admitted"
    found = {
        "input": powers,
        "excitation": powers,
        "output": np.einsum("lpr,lr->lp", np.abs(G) ** 2, powers),
        "moves": (2.0 - 2.0 * np.cos(w))[:, None] * powers,
    }

    def power(kind: str, channel: int | None) -> float:
        total = found[kind].sum(axis=0)
        return float(total.sum() if channel is None else total[channel])

    cost = sum(weight * power(kind, channel) for kind, channel, weight in weights_of(terms.cost))
    if not abs(cost - written["cost"]) <= _APART * abs(cost):
        yield f"the lines cost {cost:.10g}, not {written['cost']:.10g}"
    for limit in terms.limits if terms.goal != "given" else ():
        value = power(limit.kind, limit.channel)
        if not (value - limit.bound if limit.upper else limit.bound - value) <= _APART * limit.bound:
            yield f"{limit.key} is {limit.bound:.6g}, but the lines have {value:.10g}"
    objective = written.get("objective")
    if objective and not objective["lower_bound"] - objective["value"] <= _APART * abs(objective["value"]):
        bound = objective["lower_bound"]
        yield f"the value {objective['value']:.10g} lies below lower_bound ({bound:.10g})"


def _of_record(
    terms: ResponseTerms, plan: Planned, written: Mapping[str, Json], record: Array
) -> Iterator[str]:
    """What the samples of signal.csv do not bear out: errors are noise over the transforms of the inputs."""
    level = written["signal"].get("operating_point")
    u = record - (np.zeros(record.shape[1]) if level is None else np.array(level))
    inputs = terms.periods.means(u, terms.grid.excited)
    spread = np.sum(np.abs(np.linalg.inv(inputs)) ** 2, axis=1)
    each = plan.counted / terms.periods.blocks
    noise = plan.deviations**2 * plan.counted * plan.powers[:, None, :] * 0.5
    noise *= 1.0 + written["signal"]["extra_power"]
    found = np.sqrt(noise * spread[:, None, :] / each)
    apart = float(np.max(np.abs(found / plan.deviations - 1.0)))
    if not apart <= _APART:
        yield f"the samples of the record leave deviations that are off those claimed by {apart:.3g}"
    worst = float(np.max(found / terms.lines.admitted))
    claimed = written["signal"]["worst_ratio"]
    if not abs(worst - claimed) <= _APART * worst:
        yield f"the record leaves {worst:.10g} times what is admitted, not {claimed:.10g}"
