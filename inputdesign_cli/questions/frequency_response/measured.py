"""Compare a measured frequency response with what is admitted, and write its outcome."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.design.convex.response_lines import ResponseLines
from inputdesign_cli.finding import Finding, reasons, trusted, verdict
from inputdesign_cli.findings.frequency_responses import REMEDY, UNLIKE
from inputdesign_cli.findings.periods import Distorted, nonlinear_response, silent_lines_answer, within_chance
from inputdesign_cli.identification import FrequencyResponse
from inputdesign_cli.identification.nonlinearity import SilentLines
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.outcome import Assessment, Identification, MeasuredLines, Outcome, RequirementMet
from inputdesign_cli.outcome.curves import Curves, ResponseCurves
from inputdesign_cli.outcome.estimate import SilentLine
from inputdesign_cli.outcome.results import Array, Results, Table
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.questions.common.delivery import results_of
from inputdesign_cli.questions.frequency_response.terms import deviation_curves
from inputdesign_cli.records import Record
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.specification.models.sizes import most


@dataclass(frozen=True)
class Judged:
    """The deviations (L, p, r) of data by the noise of the spec (`expected`) and of the data (`found`).

    Attributes:
        lines: with the measured G.
        least, largest: (L,), the limits of the true ratios, which hold for all lines with 95 %.
        counted: samples that count.
        asked: the number of lines of the spec; these are the ones that the inputs excite.
        differing: the share of the power of the inputs that differs from period to period.
        noise: (L, p), the spectrum of the noise of the data, averaged along the lines.
        times: with this multiple of the periods a verdict would be met, by the same plant and noise.
        moved: (L,), the change of the response by a drift, over what is admitted.
        distorted: its change by a nonlinearity; None if none is seen or looked for.
        scattered: findings on spikes and drifts, which are in the scatter of the periods too.
    """

    grid: HarmonicGrid
    periods: Periods
    lines: ResponseLines
    expected: NDArray[np.float64]
    found: NDArray[np.float64]
    least: Array
    largest: Array
    counted: int
    asked: int
    differing: float
    times: float
    noise: NDArray[np.float64]
    moved: Array
    distorted: Distorted | None = None
    scattered: tuple[Finding, ...] = ()
    silent: Mapping[str, SilentLines] = field(default_factory=dict)

    @cached_property
    def ratios(self) -> Array:
        """The largest deviation (L,) of an entry by the noise of the data, over r_adm."""
        return self.lines.ratios(self.found)

    @property
    def worst(self) -> int:
        """The line of the largest ratio."""
        return int(np.argmax(self.ratios))

    @property
    def limits(self) -> tuple[float, float]:
        """Limits of the largest ratio, with 95 %."""
        return float(self.least.max()), float(self.largest.max())

    @property
    def missed(self) -> bool:
        """Whether noise alone misses what is admitted, beyond chance.

        What is admitted may be a share of |G|, so that it is not known better than the response itself.
        """
        bent = self.distorted.shares if self.distorted is not None and self.distorted.matters else 0.0
        sure = self.least / (1.0 + (self.lines.share or 0.0) * (self.moved + bent))
        return not self.scattered and bool(np.any(sure > 1.0))

    def doubts(self, units: Units) -> list[Finding]:
        """Return findings on spikes, drifts and a nonlinearity."""
        w = self.grid.frequencies / units.frequency
        bent = nonlinear_response(units, self.distorted, w, decided=self.missed)
        return [*self.scattered, *bent]

    @property
    def periods_needed(self) -> int | None:
        """The periods (of each block) that would have to count; None if more are no remedy."""
        samples = self.times * self.counted
        # Of inputs that do not repeat the mean of the periods falls as the noise does.
        if self.differing > UNLIKE or samples > most("signal.samples"):
            return None
        return int(np.ceil(samples / (self.periods.blocks * self.grid.period)))

    @property
    def remedy(self) -> str:
        """How many periods would do, or what to do where more of them would not."""
        if self.periods_needed is not None:
            blocks = "" if self.periods.blocks == 1 else f" in each of {self.periods.blocks} blocks"
            return f"about {self.periods_needed} periods that count{blocks} would do"
        why = "do not repeat" if self.differing > UNLIKE else "are too weak at some lines"
        return f"more periods of this signal are no remedy, as the inputs {why}: {REMEDY}"


@dataclass(frozen=True)
class Measured:
    """A response with the data that count for it; with lines of a spec also how it compares."""

    data: Record
    response: FrequencyResponse
    judged: Judged | None = None
    findings: tuple[Finding, ...] = ()


def measured_results(
    header: Header,
    measured: Measured,
    shown: tuple[Table, ResponseCurves, MeasuredLines],
    seconds: float,
    *,
    assess: bool,
) -> Results:
    """Return the outcome, frequency_response.csv and its figure; with lines also their deviations."""
    table, curve, response = shown
    data, judged, found = measured.data, measured.judged, list(measured.findings)
    tables, curves = {"frequency_response": table}, dict[str, Curves](frequency_response=curve)
    assessment = None
    if judged is not None:
        w = judged.grid.frequencies / header.units.frequency
        listed = {"deviation": judged.expected, "deviation_data": judged.found}
        drawn = ("deviation_data", "these data")
        columns, curves["deviations"] = deviation_curves(header.units, w, judged.lines, listed, drawn)
        tables["deviations"] = Table(columns)
        response = _of_lines(response, judged, w, len(data.lengths), data.lengths[0])
        doubts = judged.doubts(header.units)
        if assess:
            assessment, doubts = _assessment(header.units, judged, w, doubts)
        found += [*silent_lines_answer(judged.silent), *doubts]
    outcome = Outcome(
        title=header.title,
        status="measured" if assessment is None else assessment.verdict,
        samples=len(data.y),
        identification=Identification(method=response.method),
        frequency_response=replace(response, blocks=1 if judged is None else judged.periods.blocks),
        assessment=assessment,
        findings=data.findings or None,
        notes=data.notes or None,
        timing_s={"measurement": seconds},
    )
    return results_of(header, outcome.saying(found), tables, curves)


def _of_lines(response: MeasuredLines, judged: Judged, w: Array, records: int, samples: int) -> MeasuredLines:
    """Return what is measured with the lines w (L,), their deviations, and the silent lines."""
    silent, bent = silent_entry(judged.silent), judged.distorted
    if bent is not None:
        at = float(w[bent.line])
        silent["odd"] = replace(silent["odd"], worst_ratio=bent.share, frequency=at, cubed=bent.cubed or None)
    return replace(
        response,
        lines=int(w.size),
        asked=judged.asked,
        period=judged.periods.period,
        periods=judged.periods.each(samples),
        records=records,
        transient=judged.periods.skip,
        counted=judged.counted,
        worst_ratio=float(judged.ratios[judged.worst]),
        worst_frequency=float(w[judged.worst]),
        worst_ratio_limits=judged.limits,
        nonlinearity=silent or None,
    )


def silent_entry(silent: Mapping[str, SilentLines]) -> dict[str, SilentLine]:
    """Return `nonlinearity` of the result, by kind of the lines: odd and even; lists are by output."""

    def by_output(values: Array) -> tuple[float, ...]:
        return tuple(values.tolist())

    return {
        kind: SilentLine(one.lines, by_output(one.over_noise), by_output(one.probability), by_output(one.rms))
        for kind, one in silent.items()
    }


def _assessment(
    units: Units, judged: Judged, w: Array, doubts: list[Finding]
) -> tuple[Assessment, list[Finding]]:
    """Return the verdict with the periods that would settle it, and the findings that it rests on."""
    ratio, at = float(judged.ratios[judged.worst]), float(w[judged.worst])
    met, periods, no_top_up = judged.limits[1] <= 1.0, None, None
    doubted = not trusted(doubts)
    if judged.missed and doubted:
        no_top_up = "more periods alone are no remedy: the notes say why"
    elif not met and not doubted:
        periods = judged.periods_needed
        if judged.missed:
            no_top_up = judged.remedy if periods is None else f"repeat the record: {judged.remedy}"
        else:
            doubts = [*doubts, within_chance(units, ratio, judged.limits, at, judged.remedy)]
    answer, why = verdict(doubts, met=met), reasons(doubts)
    return Assessment(
        verdict=answer,
        met=answer == "met",
        requirements=(RequirementMet("frequency_response", ratio, at),),
        undecided=tuple(one.message for those in why.values() for one in those) or None,
        causes=tuple(why) or None,
        no_top_up=no_top_up,
        periods=periods,
    ), doubts
