"""The table of findings that need no data: when each holds, its code, and short sentences."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli.finding import Finding, Severity, trusted, undecided
from inputdesign_cli.findings import (
    campaigns,
    designed_records as records,
    designs,
    simulated_runs as runs,
    unfinished,
)
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Objective
from inputdesign_cli.outcome.design import Coverage, Loop
from inputdesign_cli.outcome.robust import FloorUse, LostPlant
from inputdesign_cli.outcome.simulation import OnDesignModel, RatioAt, Searched, TriedInput, Violations
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import Quantiser
from tests.support.wording import long_sentences

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
MODEL = PolynomialModel.single([0.0, 1.0], F=[1.0, -0.99])
ASKED = Coverage(100, 0.9, (0.8, 0.95), 0.9, 100, 0.9, (0.85, 0.94), asked=0.95)
RUNS = TriedInput(within_r_adm=0.8, within_r_adm_limits=(0.7, 0.9))
ELSEWHERE = replace(
    RUNS,
    on_design_model=OnDesignModel(within_r_adm=0.95),
    theory_on_truth=RatioAt(1.3, 0.2),
    violations=Violations(4, np.array([0.1, 0.2, 0.3]), 1.5),
)
LOST = FloorUse(0.3, (1, 4, 9), (4,), (LostPlant(4, {"b1": 0.2, "f1": -0.9}, 3.1),))
MADE = Record(np.ones((40, 1)), "filtered_noise", 1.2, extra_power=3.0, met=False)
GAP = Objective("least_cost", 2.0, lower_bound=1.9, relative_gap=0.05)
FOLLOWED = {"likeness": 0.95, "like": 0.9, "follows": True, "other": None, "scale": 1.0}


def planned(**change):
    asked = {"why": "", "capped": False, "share": 1.0, "beyond": False, "part_cost": 2.0, "fragile": False}
    return campaigns.planned_otherwise("plan_02.csv", **(asked | change))


def followed(**change):
    return campaigns.hardly_followed("r.csv", "plan_02.csv", **(FOLLOWED | change))


FOUND = {
    "part-without-design": planned(why="no power is enough"),
    "plan-capped": planned(capped=True),
    "part-scaled": planned(share=0.5),
    "earlier-parts-cost": planned(beyond=True),
    "part-not-robust": planned(fragile=True),
    "part-between-minima": planned(parts=True),
    "part-repeated": followed(other="plan_01.csv"),
    "record-scaled": [*followed(scale=0.5), *followed(likeness=-0.99, scale=0.5)],
    "record-unlike-plan": [*followed(likeness=0.7), *followed(likeness=0.1, follows=False)],
    "record-shorter": campaigns.shorter("r.csv", "plan_01.csv", 59, 60),
    "record-without-excitation": campaigns.without_excitation("r.csv", "plan_01.csv"),
    "record-withdrawn": campaigns.withdrawn_record("r.csv", 2),
    "no-estimate-yet": campaigns.no_estimate_yet("the input never moves"),
    "estimate-not-used": [
        *campaigns.estimate_not_used(0.4, ""),
        *campaigns.estimate_not_used(None, "the loop is unstable"),
    ],
    "campaign-doubted": campaigns.campaign_doubted(),
    "campaign-refuted": campaigns.campaign_refuted(Path("c"), 80, 600, ["record_02.csv"]),
    "no-excitation-needed": [designs.nothing_needed(Experiment(MODEL, 500))],
    "input-without-power": designs.inputs_without_power([1.0, 0.0]),
    "experiment-short": designs.short_experiment(Experiment(MODEL, 100)),
    "few-samples": designs.few_samples(Experiment(MODEL, 39)),
    "excitation-almost-free": designs.almost_free(
        UNITS, np.array([0.01, 1.0]), np.ones(2), np.array([1e-6, 1.0]), 1.0
    ),
    "design-unfinished": unfinished.ended_early("gap_open", GAP),
    "other-spectra-left-out": [unfinished.other_spectra_left_out(), *unfinished.ended_early("optimal", GAP)],
    "no-record-in-time": [unfinished.no_record_in_time(8)],
    "accuracy-on-grid": [unfinished.on_grid(40, 1.01)],
    "fresh-plants-cut-short": unfinished.fewer_plants(10, 120),
    "draws-unstable": unfinished.unstable_draws(80, 100),
    "plants-lost": unfinished.floor_findings(LOST, 20)[:1],
    "plants-at-floor": unfinished.floor_findings(LOST, 20)[1:],
    "record-not-computed": records.too_long(2_000_000, 1_000_000),
    "record-undetermined": records.accuracy_missed(replace(MADE, worst_ratio=np.inf)),
    "record-misses-accuracy": [
        *records.accuracy_missed(MADE),
        *records.requirement_missed(["model_error"], 1.1),
    ],
    "record-dear": records.length_of_record(MADE, 40, 1, 2, {}),
    "record-longer": [
        *records.length_of_record(MADE, 20, 1, 2, {"amplitude.input": 0.8, "rate": 1.0}),
        *records.length_of_record(MADE, 1, 5, 8, {"rate": 1.0}),
        *records.length_of_record(MADE, 1, 1, 40, {"rate": 1.0}),
        *records.length_of_record(MADE, 20, 1, 2, {}),
    ],
    "record-too-few-values": records.too_short(6, 16),
    "bound-of-power-only": records.short_windows(12, 1000.0, 0.6),
    "noise-moves-input": records.noise_moves_input(np.array([0.2]), [3.0]),
    "level-rounded": records.level_rounded([Quantiser(5, 24.0, 10.0)], 5.0),
    "record-less-accurate": records.less_accurate(1.2, 1.0),
    "start-from-rest": [records.start_matters(2.0), records.start_matters(np.inf)],
    "other-signal": [records.other_signal("a multisine"), records.other_signal("a multisine", 2.0)],
    "confidence-missed": [
        *runs.confidence_missed(ASKED, ASKED),
        *runs.runs_miss_confidence(ASKED, RUNS),
        *runs.runs_miss_confidence(replace(ASKED, runs=None), RUNS),
    ],
    "other-length": [*runs.other_length(1, 7), *runs.other_length(0, 7)],
    "initial-estimate-off": runs.initial_estimate_off(UNITS, {"design": ELSEWHERE}),
    "runs-see-one-minimum": runs.one_minimum(Searched(10, 3, 7)),
    "unstable-runs": runs.unstable_runs({"design": 3, "white": 0}, 100),
    "loop-moves-every-sample": designs.loop_not_held([None, Loop(1.5, 2.0)], 4),
    "loop-near-its-limit": designs.near_its_limit([None, Loop(1.9, 2.0), Loop(1.5, 2.0)]),
    "met-within-table": [designs.met_within_table(1e-5)],
}


@pytest.mark.parametrize("code", FOUND)
def test_a_finding_has_its_code_and_short_sentences(code):
    assert FOUND[code]
    assert {one.code for one in FOUND[code]} == {code}
    assert [long_sentences(one.message) for one in FOUND[code]] == [[]] * len(FOUND[code])
    assert not any(".png" in one.message for one in FOUND[code])  # figures may be left out


def test_cases_that_are_in_order_have_no_findings():
    good = replace(MADE, met=True, extra_power=0.1)
    assert planned() == planned(share=0.95) == followed() == campaigns.estimate_not_used(1.0, "") == []
    assert campaigns.shorter("r.csv", "plan_01.csv", 60, 60) == []
    assert designs.inputs_without_power([1.0, 0.5]) == []
    assert designs.short_experiment(Experiment(MODEL, 1000)) == []
    assert designs.few_samples(Experiment(MODEL, 40)) == []
    assert designs.loop_not_held([None], 4) == designs.loop_not_held([Loop(1.5, 2.0)], 1) == []
    assert unfinished.fewer_plants(120, 120) == unfinished.unstable_draws(40, 100) == []
    assert unfinished.floor_findings(None, 20) == []
    assert records.too_long(500, 500) == records.accuracy_missed(good) == []
    assert records.short_windows(12, 10.0, 0.6) == records.short_windows(12, 1000.0, 0.05) == []
    assert records.length_of_record(good, 40, 1, 2, {}) == records.less_accurate(1.001, 1.0) == []
    assert runs.confidence_missed(replace(ASKED, kept_limits=(0.9, 0.96)), None) == []
    assert runs.other_length(7, 7) == runs.one_minimum(None) == []


def test_a_longer_record_is_put_down_to_what_lengthens_it():
    places = [one.where for one in FOUND["record-longer"]]
    assert places == ["limits.rate", "signal.hold", "signal", "signal"]


def test_figures_are_the_numbers_of_the_case():
    (part, full) = FOUND["estimate-not-used"]
    assert (part.figures["share"], full.figures["why"]) == (0.4, "the loop is unstable")
    assert FOUND["part-scaled"][0].figures == {"share": 0.5}
    assert FOUND["campaign-refuted"][0].figures == {"samples": 80, "end": 600, "records": ["record_02.csv"]}
    assert str(Path("c/record_02.csv")) in FOUND["campaign-refuted"][0].message
    assert [one.severity for one in FOUND["record-unlike-plan"]] == ["note", "doubt"]
    assert [one.figures["scale"] for one in FOUND["record-scaled"]] == [0.5, 0.5]
    assert FOUND["part-repeated"][0].figures["other"] == "plan_01.csv"


@pytest.mark.parametrize(
    ("severity", "decides", "trusts"),
    [
        (Severity.NOTE, True, True),
        (Severity.DOUBT, True, False),
        (Severity.UNDECIDED, False, False),
        (Severity.REFUTED, False, False),
    ],
)
def test_the_severity_determines_whether_a_verdict_is_decided_and_trusted(severity, decides, trusts):
    found = [Finding("a", Severity.NOTE, "x"), Finding("b", severity, "y")]
    assert undecided(found) != decides
    assert trusted(found) == trusts
