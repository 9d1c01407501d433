"""Campaigns with a wrong model structure end once the data refute it; right structures seldom do."""

import json

import numpy as np
import pytest

from tests.support.campaigns import SPEC, applied

TRUE = {"gain": 1.4, "poles": (0.7, 0.6)}  # the model has one pole


def until_it_ends(run, directory, folder, *options, most=12):
    """Exit code and result of the last part."""
    for part in range(most):
        given = applied(directory, folder / f"r{part}.csv", **TRUE)
        code, out, err = run("next", "c", given, "--json", "--no-figures", *options)
        assert code in (0, 1, 5), err
        if json.loads(out)["status"] != "running":
            break
    return code, json.loads(out)


@pytest.mark.slow
def test_a_refuted_model_structure_ends_the_campaign(run, begun, tmp_path):
    code, result = until_it_ends(run, begun, tmp_path)
    assert code == 5
    assert result["status"] == "undecided"
    assert result["samples"] < 0.5 * result["campaign"]["max_samples"]
    first = result["findings"][0]
    assert (first["code"], first["severity"], first["where"]) == ("campaign-refuted", "refuted", "c")
    assert (first["figures"]["samples"], first["figures"]["end"]) == (result["samples"], 600)
    assert first["figures"]["records"] == [record["file"] for record in result["campaign"]["records"]]
    assert not (begun / "signal.csv").exists()
    # Further records are refused without --regardless.
    code, _, err = run("next", "c", tmp_path / "r0.csv")
    assert code == 2
    assert "--regardless" in err
    before = result["samples"]
    code, out, _ = run("next", "c", "--regardless", "--json", "--no-figures")
    assert code == 0
    assert json.loads(out)["status"] == "running"
    code, result = until_it_ends(run, begun, tmp_path)
    assert result["samples"] > before
    assert code == 5, "a verdict cannot rest on a structure that is refuted"


@pytest.mark.slow
def test_withdrawn_records_are_left_out_of_suggestions_to_explore(run, begun, tmp_path):
    until_it_ends(run, begun, tmp_path)
    assert run("next", "c", "--withdraw", 1, "--no-figures")[0] in (0, 5)
    result = json.loads((begun / "result.json").read_text())
    listed = [one["figures"]["records"] for one in result["findings"] if "records" in one["figures"]]
    assert all("record_01.csv" not in records for records in listed)
    named = [note for note in result["notes"] if "idesign explore" in note]
    assert not any("record_01.csv" in note or "record_??" in note for note in named)


def test_withdraw_and_regardless_exclude_each_other(run, begun):
    code, _, err = run("next", "c", "--withdraw", 1, "--regardless")
    assert code == 2
    assert "--regardless" in err


@pytest.mark.slow
def test_a_right_structure_is_seldom_refuted_at_any_look():
    """White records of a first-order plant are tested after each part of 20 samples."""
    from inputdesign_cli import parse_spec
    from inputdesign_cli.identification import identify
    from inputdesign_cli.questions.campaign.build import build_campaign

    task = build_campaign(parse_spec(SPEC, overrides=["campaign.block=20"]))
    model, rules = task.true.model, task.ways["campaign"]
    assert rules.schedule.looks == 30
    refuted = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        u, e = rng.standard_normal((2, 1, 600, 1))
        caused, noise = model.simulate(u, e, 1.0)
        y = (caused + noise)[0]
        refuted += any(
            rules.refuted(identify(model, u[0, :n], y[:n], start=model.theta, rest=True, near=True))
            for n in range(40, 601, 20)
        )
    assert refuted <= 4


@pytest.mark.slow
def test_a_campaign_with_stop_never_lasts_the_whole_experiment(run, tmp_path):
    (tmp_path / "s.yaml").write_text(SPEC.replace("{block: 60}", "{block: 60, stop: never}"))
    assert run("campaign", "s.yaml", "-o", "c", "--no-figures")[0] == 0
    code, result = until_it_ends(run, tmp_path / "c", tmp_path)
    assert result["samples"] == 200
    assert code == 5
