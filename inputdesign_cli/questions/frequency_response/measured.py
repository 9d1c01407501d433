"""A measured frequency response -> `result.json`, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.design.response import ResponseLines
from inputdesign_cli.identification import FrequencyResponse
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.identification.silent_lines import SilentLines
from inputdesign_cli.outcome import MeasuredLines, write_plain
from inputdesign_cli.outcome.curves import Curves, DeviationCurves, DeviationPanel, ResponseCurves
from inputdesign_cli.outcome.results import Array, Json, Results, Table, typed
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.frequency_response.doubts import Doubts, bent_told
from inputdesign_cli.questions.frequency_response.silent_lines import Distorted, silent_entry, silent_notes
from inputdesign_cli.records import Record
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.specification.models.sizes import most

Verdict = Literal["met", "missed", "undecided"]
REMEDY = "apply the signal.csv of the spec, and record u as it was applied; or is this the record of another?"
UNLIKE = 0.5
"""Inputs of which more than this differs from period to period do not repeat, in a loop with noise either."""


@dataclass(frozen=True)
class Judged:
    """The deviations (L, p, r) that data leave: with the noise of the spec, and with that of the data.

    Attributes:
        lines: with the measured G.
        ratios: (L,) of the latter over r_adm, the largest entry.
        least, largest: (L,), between which the true ratios lie, with 95 % all of them.
        counted: samples that count.
        asked: how many lines the spec has, of which these are those that the inputs excite.
        differing: the share of the power of the inputs that differs from period to period.
        noise: (L, p), the spectrum of the noise of the data, averaged along the lines.
        times: with so many times the periods a verdict would be met, by the same plant and noise.
        doubts: what decides besides noise.
    """

    grid: HarmonicGrid
    periods: Periods
    lines: ResponseLines
    expected: NDArray[np.float64]
    found: NDArray[np.float64]
    ratios: Array
    least: Array
    largest: Array
    counted: int
    asked: int
    differing: float
    times: float
    noise: NDArray[np.float64]
    doubts: Doubts

    @property
    def doubted(self) -> bool:
        """Whether something else than noise may decide."""
        return bool(np.any(self.doubts.changed > 0.0)) or bool(self.doubts.spiked)

    @property
    def worst(self) -> int:
        """The line of the largest ratio."""
        return int(np.argmax(self.ratios))

    @property
    def verdict(self) -> Verdict:
        """Met or missed where neither chance nor anything else than noise decides.

        What is admitted may be a share of |G|, so that it is not known better than the response itself.
        Spikes and drifts are in the scatter, too.
        """
        sure = self.least / (1.0 + (self.lines.share or 0.0) * self.doubts.changed)
        noisy = not self.doubts.spiked and not self.doubts.drifting
        if noisy and np.any(sure > 1.0):
            return "missed"
        return "undecided" if self.doubted or np.any(self.largest > 1.0) else "met"


def measured_results(
    header: Header,
    found: FrequencyResponse,
    shown: tuple[Table, ResponseCurves, MeasuredLines],
    judged: Judged | None,
    silent: Mapping[str, SilentLines],
    data: Record,
    seconds: float,
    *,
    assess: bool,
) -> Results:
    """The result, frequency_response.csv and its figure; with lines of a spec also their deviations.

    Args:
        shown: of the response beside the nominal plant, see `response_of_data`.
        assess: whether the result is a verdict.
    """
    units, (table, curves, told) = header.units, shown
    entry: dict[str, Json] = {**write_plain(told), "blocks": 1}
    notes = list(data.notes)
    tables: dict[str, Table] = {"frequency_response": table}
    drawn: dict[str, Curves] = {"frequency_response": curves}
    result: dict[str, Json] = {
        "format": 1, "title": header.title, "status": "measured", "samples": len(data.y),
        "identification": {"method": found.method}, "frequency_response": entry,
    }  # fmt: skip
    if judged is not None:
        w = judged.grid.frequencies / units.frequency
        entry |= {
            "lines": int(w.size),
            "asked": judged.asked,
            "period": judged.periods.period,
            "periods": judged.periods.each(data.lengths[0]),
            "records": len(data.lengths),
            "blocks": judged.periods.blocks,
            "transient": judged.periods.skip,
            "counted": judged.counted,
            "worst_ratio": float(judged.ratios[judged.worst]),
            "worst_frequency": float(w[judged.worst]),
            "worst_ratio_limits": [float(judged.least.max()), float(judged.largest.max())],
        }
        columns, panels = _deviations(header, judged, w)
        tables["deviations"], drawn["deviations"] = Table(columns), DeviationCurves(panels)
    if silent:
        entry["nonlinearity"] = silent_entry(silent)
        notes += silent_notes(silent)
    if judged is not None:
        bent = judged.doubts.distorted
        if bent is not None:
            entry["nonlinearity"]["odd"] |= _odd(bent, w)
            notes += [] if bent.matters else [bent_told(units, bent, w)]
        # As the reasons of a verdict they stand among the notes anyway.
        if not (assess and judged.verdict == "undecided"):
            notes += [reason for _, reason in _reasons(header, judged, w)]
    if assess and judged is not None:
        assessment = _assessment(header, judged, w)
        result |= {"status": judged.verdict, "assessment": assessment}
        notes += assessment.get("undecided", [])
    result |= {"notes": notes} if notes else {}
    result["timing_s"] = {"measurement": seconds}
    outcome = replace(typed(result), findings=data.findings or None)
    return Results(outcome, header.resolved_spec, units.time_unit, tables, drawn)


def _deviations(
    header: Header, judged: Judged, w: Array
) -> tuple[dict[str, Array], tuple[DeviationPanel, ...]]:
    """Columns and panels of the entries that are bounded: by the noise of the spec, by that of the data."""
    units, columns, panels = header.units, {header.units.frequency_header: w}, []
    for i, j in np.ndindex(judged.found.shape[1:]):
        admitted = judged.lines.admitted[:, i, j]
        if not np.all(np.isfinite(admitted)):
            continue
        size, expected = np.abs(judged.lines.G[:, i, j]), judged.expected[:, i, j]
        found = judged.found[:, i, j]
        listed = {"G_abs": size, "r_adm": admitted, "deviation": expected, "deviation_data": found}
        columns |= {f"{name}{units.suffix(i, j)}": values for name, values in listed.items()}
        entry = None if units.single else (i, j)
        shown = (w, size, admitted, expected, found, "these data")
        panels.append(DeviationPanel(*shown, entry, units.passage(entry)))
    return columns, tuple(panels)


def _assessment(header: Header, judged: Judged, w: Array) -> dict[str, Json]:
    """The verdict, and how many times as many periods would settle it."""
    verdict, worst = judged.verdict, judged.worst
    ratio, low, high = float(judged.ratios[worst]), float(judged.least.max()), float(judged.largest.max())
    entry: dict[str, Json] = {
        "verdict": verdict,
        "met": verdict == "met",
        "requirements": [{"name": "frequency_response", "worst_ratio": ratio, "frequency": float(w[worst])}],
    }
    doubts = _reasons(header, judged, w)
    if doubts and verdict == "missed":
        entry["no_top_up"] = "more periods alone are no remedy: the notes say what stands behind that"
    elif high > 1.0 and not doubts:
        counted = periods_needed(judged)
        entry |= {} if counted is None else {"periods": counted}
        enough = _enough(judged, counted)
        if verdict == "missed":
            entry["no_top_up"] = enough if counted is None else f"repeat the record: {enough}"
        else:
            by_chance = (
                f"the largest deviation is {ratio:.4g} of what is admitted, at {w[worst]:.4g} "
                f"{header.units.per_time}, and by chance anything between {low:.3g} and {high:.3g} may stand "
                f"behind that: {enough}"
            )
            doubts = [("chance", by_chance)]
    if verdict == "undecided":
        causes, reasons = zip(*doubts, strict=True)
        entry |= {"causes": list(dict.fromkeys(causes)), "undecided": list(reasons)}
    return entry


def _reasons(header: Header, judged: Judged, w: Array) -> list[tuple[str, str]]:
    """What decides besides noise: causes of `assessment.causes`, each with a sentence."""
    doubts, found = judged.doubts, list[tuple[str, str]]()
    found += [("spikes", told) for told in doubts.spiked]
    found += [("drift", doubts.drifting)] if doubts.drifting else []
    if doubts.distorted is not None and doubts.distorted.matters:
        found.append(("nonlinearity", bent_told(header.units, doubts.distorted, w)))
    return found


def periods_needed(judged: Judged) -> int | None:
    """How many periods (of each block) would have to count; None where that is no remedy."""
    blocks, period = judged.periods.blocks, judged.grid.period
    samples = judged.times * judged.counted
    # Of inputs that do not repeat the mean of the periods falls as the noise does.
    if judged.differing > UNLIKE or samples > most("signal.samples"):
        return None
    return int(np.ceil(samples / (blocks * period)))


def _enough(judged: Judged, counted: int | None) -> str:
    """How many periods would do, or what to do where more of them would not."""
    if counted is not None:
        blocks = "" if judged.periods.blocks == 1 else f" in each of {judged.periods.blocks} blocks"
        return f"about {counted} periods that count{blocks} would do"
    why = "do not repeat" if judged.differing > UNLIKE else "are so weak at some lines"
    return f"more periods of this signal are no remedy, as the inputs {why}: {REMEDY}"


def unexcited(header: Header, frequencies: Array, excited: NDArray[np.bool_]) -> str:
    """How many lines (L,), in rad/sample, the data do not excite, and the first of them; or nothing."""
    lacking = frequencies[~excited] / header.units.frequency
    if not lacking.size:
        return ""
    first = f"{lacking[0]:.4g} {header.units.per_time}"
    return (
        f"{lacking.size} of {excited.size} lines of the spec, the first at {first}, have no more of the "
        "inputs than rounding or noise leaves: the response is not measured there"
    )


def _odd(distorted: Distorted, w: Array) -> dict[str, Json]:
    """What `nonlinearity.odd` of the result says of the response."""
    cubed = {"cubed": distorted.cubed} if distorted.cubed else {}
    return {"worst_ratio": distorted.share, "frequency": float(w[distorted.line]), **cubed}
