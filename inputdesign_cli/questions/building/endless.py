"""Spec -> designs without an end: what is asked comes for nothing with power ever nearer to a frequency."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.questions.building.for_nothing import ForNothing, counted_powers, told_for_nothing
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.common.reach import Reach
from inputdesign_cli.specification import Spec

# Of the band, what is left out beside each of the frequencies.
_MARGIN = 0.01
# What is left out to stay off them takes so much of the accuracy, or less.
_OFF = 1e-6


def check_reach(spec: Spec, question: Question) -> Reach:
    """Whether other spectra reach without end; refuse a family in which there is no best one for that.

    Raises:
        SpecError: `no-cost` or `needs-limits`.
    """
    found = told_for_nothing(question)
    if found is None:
        return Reach()
    units = build_units(spec)
    places = " and ".join(units.named(w) for w in found.frequencies)
    free = f"excitation at {places} takes nothing of what is {_counted(question)} and tells of the parameters"
    others, band = _others(spec, question), _band(spec, question, found)
    lo, hi = question.experiment.band
    off = 2.0 * _OFF * hi
    ends = [any(abs(w - end) < off for w in found.frequencies) for end in (lo, hi)]
    # Lines are kept off an end; a place inside the band they close in on from both sides.
    inside = question.goal == "factor" and any(lo + off <= w <= hi - off for w in found.frequencies)
    on_it = question.goal == "factor" and found.reached and not question.basis.free
    outcome = (
        _OUTCOMES[question.goal] if found.endless else "the best is approached with power ever nearer to it"
    )
    if found.reached and (found.endless or inside or on_it):
        section = "cost" if question.goal == "cost" else "limits"
        add = "give a weight, however small, to" if section == "cost" else "add"
        beside = f"leave it out by {band}" if question.basis.free else "choose lines beside it"
        raise spec.complain(
            "no-cost" if question.goal == "cost" else "needs-limits",
            f"{free}: {outcome}, and no spectrum is the best",
            hint=f"{add} {others}; or {beside}",
            key=section,
        )
    if found.endless or inside:
        return Reach(
            bounded=False,
            note="the design is the best of its spectrum type, and there is no bound over every spectrum: "
            f"{free}, so that {outcome}; with {others} there is one",
        )
    inner = (lo + ends[0] * _OFF * hi, hi - ends[1] * _OFF * hi)
    if not question.basis.free:
        return Reach(attained=False, band=inner)
    return Reach(
        attained=False,
        band=inner,
        note=f"{free}: the best is approached with power ever nearer to it, which no record can follow; add "
        f"{others}, or leave it out by {band}",
    )


_OUTCOMES = {
    "cost": "with power ever nearer to it the accuracy costs as little as you like",
    "factor": "with power ever nearer to it the accuracy grows without end",
    "samples": "with power ever nearer to it the experiment is as short as you like",
}


def _counted(question: Question) -> str:
    if question.goal == "cost":
        return "paid for"
    keys = dict.fromkeys(limit.key for limit in question.limits if limit.upper)
    return f"limited ({', '.join(keys)})"


def _others(spec: Spec, question: Question) -> str:
    """What to pay for or to limit besides."""
    section = "cost" if question.goal == "cost" else "limits"
    if spec.experiment.controller is None:
        return f"{section}.input_power"
    counted = {kind for kind, _, _ in counted_powers(question) or []}
    # A pole in the loop leaves the output what it takes from the input.
    output = "" if "output" in counted else f"{section}.output_power or "
    return f"{output}{section}.excitation_power"


def _band(spec: Spec, question: Question, found: ForNothing) -> str:
    """The widest band that keeps off the frequencies, as its key."""
    lo, hi = question.experiment.band
    beside = _MARGIN * hi
    inner = np.array(sorted(found.frequencies))
    starts, ends = np.append(lo, inner + beside), np.append(inner - beside, hi)
    widest = int(np.argmax(ends - starts))
    unit = build_units(spec).frequency
    start = "0" if starts[widest] == 0.0 else f"{starts[widest] / unit:.3g}"
    return f"limits: {{band: [{start}, {ends[widest] / unit:.6g}]}}"
