"""Reread the written outcome of a frequency response, and evaluate it by other means.

Powers come from the text of `result.json`. The deviations of the record in signal.csv follow from its own
transforms.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import weights_of
from inputdesign_cli.outcome import MeasuredLines, Outcome, Signal, Spectrum, read_plain
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.questions.common.audit import APART, check_claims, of_bounds, of_cost, of_limit
from inputdesign_cli.questions.frequency_response.terms import Planned, ResponseTerms


def audit_response(terms: ResponseTerms, plan: Planned, results: Results) -> None:
    """Compare what the result claims with its own lines and its own record.

    Raises:
        InaccurateError: `internal-disagreement`.
    """
    written = read_plain(Outcome, results.result)
    spectrum, response, signal = written.spectrum, written.frequency_response, written.signal
    assert spectrum is not None
    assert response is not None
    assert signal is not None
    _, *samples = csv_columns(csv_text(results.tables["signal"]).encode()).values()
    wrong = _of_lines(terms, written, spectrum, response)
    of_record = _of_record(terms, plan, signal, np.stack(samples, axis=1))
    remedy = "rescale the signals, or leave out lines where |G| is very small"
    check_claims([*wrong, *of_record], remedy)


def _of_lines(
    terms: ResponseTerms, written: Outcome, spectrum: Spectrum, claimed: MeasuredLines
) -> Iterator[str]:
    """Say which claims the written powers contradict, one sentence each."""
    w = np.array(spectrum.details["frequencies"]) * terms.header.units.frequency
    listed = np.array(spectrum.details["powers"], dtype=float)
    powers = listed[:, None] if listed.ndim == 1 else np.einsum("laa->la", listed)
    G = terms.experiment.model.plant_at(w)
    counted, ratio, cost = claimed.counted or 0, claimed.worst_ratio or 0.0, written.cost or 0.0
    ratios = [
        np.sqrt(2.0 * terms.lines.noise[:, i] / (counted * powers[:, j])) / admitted
        for i, j in np.ndindex(G.shape[1:])
        if np.all(np.isfinite(admitted := terms.lines.admitted[:, i, j]))
    ]
    worst = float(np.max(ratios))
    if not abs(worst - ratio) <= APART * worst:
        yield f"the lines leave {worst:.10g} times the deviation admitted, not {ratio:.10g}"
    if terms.goal in ("cost", "samples") and not worst <= 1.0 + APART:
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

    paid = sum(weight * power(kind, channel) for kind, channel, weight in weights_of(terms.cost))
    yield from of_cost(paid, cost)
    for limit in terms.limits if terms.goal != "given" else ():
        yield from of_limit(limit, power(limit.kind, limit.channel))
    if written.objective is not None:
        yield from of_bounds(written.objective)


def _of_record(terms: ResponseTerms, plan: Planned, written: Signal, record: Array) -> Iterator[str]:
    """Say which claims the samples contradict: errors are noise over the transforms of the inputs."""
    u = record - (0.0 if written.operating_point is None else np.array(written.operating_point))
    inputs = terms.periods.means(u, terms.grid.excited)
    spread = np.sum(np.abs(np.linalg.inv(inputs)) ** 2, axis=1)
    each = plan.counted / terms.periods.blocks
    noise = plan.deviations**2 * plan.counted * plan.powers[:, None, :] * 0.5
    noise *= 1.0 + (written.extra_power or 0.0)
    found = np.sqrt(noise * spread[:, None, :] / each)
    apart = float(np.max(np.abs(found / plan.deviations - 1.0)))
    if not apart <= APART:
        yield f"the samples of the record leave deviations that are off those claimed by {apart:.3g}"
    worst, claimed = float(np.max(found / terms.lines.admitted)), written.worst_ratio or 0.0
    if not abs(worst - claimed) <= APART * worst:
        yield f"the record leaves {worst:.10g} times what is admitted, not {claimed:.10g}"
