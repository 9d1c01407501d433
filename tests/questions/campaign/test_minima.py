"""Data that several minima of the likelihood fit lead to a part that discriminates between them."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli import parse_spec
from inputdesign_cli.outcome.run_directory import read_run
from inputdesign_cli.questions.campaign.build import build_planner, build_rules
from inputdesign_cli.questions.campaign.schedule import Standing
from tests.support.campaigns import SPEC, found
from tests.support.commands import caller

COLOURED = SPEC.replace("{variance: 1.0}", "{C: [1, -0.5], D: [1, -0.8], variance: 0.5}")


@pytest.mark.parametrize(
    ("done", "verdict", "refuted", "stop", "state"),
    [
        (200, "met", False, "data", "stopped"),
        (200, "undecided", False, "data", "running"),  # another part may decide
        (200, "missed", False, "data", "running"),
        (200, "undecided", True, "data", "undecided"),
        (600, "undecided", False, "data", "undecided"),
        (600, "missed", False, "data", "missed"),
        (100, "met", False, "never", "running"),
        (200, "met", False, "never", "stopped"),
    ],
)
def test_a_campaign_ends_by_its_samples_its_verdict_and_its_stop_rule(done, verdict, refuted, stop, state):
    rules = build_rules(parse_spec(SPEC, overrides=[f"campaign.stop={stop}"]))
    assert rules.state(done, verdict, refuted=refuted) == state


def predictions_apart(u, one, other):
    """(n,): difference of the predictions of two models (b, c, d, f) in standard deviations of e, by hand."""
    y = [lfilter([0.0, b], [1.0, f], u) for b, _, _, f in (one, other)]
    return lfilter([1.0, -0.8], [1.0, -0.5], y[0] - y[1]) / np.sqrt(0.5)


@pytest.mark.first(1)
@pytest.mark.parametrize("ratio", [1.1, 0.9])
def test_a_part_discriminates_between_two_minima_of_the_likelihood(ratio):
    """It adds 36 to -2 log likelihood, more than white noise of equal power, within the amplitude."""
    spec = parse_spec(COLOURED, overrides=["limits.amplitude=4", "campaign.power_cap=1000"])
    at, rules = build_planner(spec), build_rules(spec)
    model, other = at.nominal.model, np.array([3.2, -0.5, -0.8, -0.73])
    known = Standing(model, 1e5 * np.eye(4) / ratio**2, ratio, open=True, others=(other,))
    assert at.plan(rules, known, 60, 5, 1.0).kind != "parting" or ratio < 1.0  # more parts follow
    plan = at.plan(rules, known, 140, 5, 1.0)
    assert (plan.kind, plan.alone, len(plan.applied)) == ("parting", False, 60)
    u = plan.applied[:, 0]
    assert np.abs(u).max() <= 4.0 * (1 + 1e-9)
    told = np.sum(predictions_apart(u, model.theta, other) ** 2)
    white = np.random.default_rng(1).standard_normal((200, 60)) * np.sqrt(np.mean(u**2))
    apart = [np.sum(predictions_apart(one, model.theta, other) ** 2) for one in white]
    assert told == pytest.approx(36.0, rel=0.35)
    assert told > np.mean(apart)
    free = build_planner(parse_spec(COLOURED))  # without a limit
    assert free.plan(rules, known, 140, 5, 1.0).kind == "parting"
    # If only residual tests leave the model undecided, the part is planned as if without data.
    alone = at.plan(rules, Standing(model, known.information, 0.9, open=True), 140, 5, 1.0)
    assert (alone.kind, alone.alone) == ("nominal", True)
    assert alone.power > 0.0


EXCHANGER = """
sample_time: 10
plant: {continuous: {gain: 1.6, time_constant: 240, dead_time: 35}, sample: zoh}
noise: {D: [1, -0.846], variance: 0.00284}
experiment: {duration: 3600}
campaign: {stages: [90, 90, 90, 90]}
accuracy: {loop: {tuning: {simc: {}}, max_sensitivity_db: 4.5}}
limits: {amplitude: 8}
signal: {type: multisine, offset: 45}
"""


def exchanged(u, seed):
    """(n,): outlet in degC: 1.72 degC/%, lag 262 s, dead time 31 s; noise 0.1 degC, correlated over 60 s."""
    fine = np.concatenate([np.zeros(31), np.repeat(u, 10)])
    lag, fade = np.exp([-1 / 262, -1 / 60])
    y = lfilter([0.0, 1.72 * (1 - lag)], [1.0, -lag], fine)[: 10 * len(u)]
    e = np.random.default_rng(1000 + seed).standard_normal(20_000)
    v = lfilter([0.1 * np.sqrt(1 - fade**2)], [1.0, -fade], e)[: 10 * len(u)]
    return (y + v)[::10]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "parts"), [(3, True), (7, False)])
def test_campaigns_on_an_exchanger_end_met(seed, parts, monkeypatch, capsys, tmp_path):
    """A part separates minima of the dead time on both sides of a sampling instant; 12 parts are allowed."""
    monkeypatch.chdir(tmp_path)
    run, spec = caller(monkeypatch, capsys), tmp_path / "s.yaml"
    spec.write_text(EXCHANGER)
    assert run("campaign", spec, "-o", "c", "--set", f"signal.seed={seed}", "--no-figures")[0] == 0
    u, seen = np.zeros(0), set()
    for part in range(6):
        times, due = np.loadtxt("c/signal.csv", delimiter=",", skiprows=1).T
        u = np.concatenate([u, due - 45.0])
        y = 82.0 + exchanged(u, seed)[-len(due) :]
        table = np.column_stack([times, due, np.round(y, 4)])
        np.savetxt(f"r{part}.csv", table, delimiter=",", header="time,u1,y1", comments="")
        code, out, err = run(
            "next", "c", f"r{part}.csv", "--operating-point", "u1=45,y1=82", "--json", "--no-figures"
        )
        assert code == 0, err
        result = json.loads(out)
        seen |= {one["where"] for one in found(result, "part-between-minima")}
        if result["status"] != "running":
            break
    assert (result["status"], result["samples"] <= 450) == ("stopped", True)
    kinds = [one["plan"]["kind"] for one in read_run(tmp_path / "c")["campaign"]["rounds"][:-1]]
    assert seen == {f"plan_{n + 1:02d}.csv" for n, kind in enumerate(kinds) if kind == "parting"}
    assert bool(seen) == parts
