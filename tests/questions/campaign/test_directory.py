"""`idesign campaign`, `next` and `status`: the directory remembers, refuses and goes on."""

import json
import os
import signal
import sys

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.outcome.run_directory import read_run
from inputdesign_cli.questions.assessment.build import build_identification
from inputdesign_cli.questions.campaign.memory import held
from tests.support.campaigns import SPEC, answered, applied, found, planned, written


def test_a_campaign_goes_on_until_the_data_meet_what_is_asked(run, begun, tmp_path):
    assert len(planned(begun)) == 20  # a pilot of a tenth
    for number in range(1, 12):
        record = applied(begun, tmp_path / f"r{number}.csv")
        code, out, err = run("next", "c", record, "--json", "--no-figures")
        assert code == 0, err
        result = json.loads(out)
        if result["status"] != "running":
            break
    assert result["status"] == "stopped"
    assert result["assessment"]["met"]
    assert not (begun / "signal.csv").exists()
    campaign = result["campaign"]
    assert [entry["samples"] for entry in campaign["rounds"]] == [
        0,
        *np.cumsum([record["samples"] for record in campaign["records"]]).tolist(),
    ]
    # Every plan, record and estimate stays, and the times of the plans follow each other.
    for number in range(1, len(campaign["records"]) + 1):
        names = ("plan_{}.csv", "record_{}.csv", "record_{}_as_given.csv", "model_{}.yaml")
        assert all((begun / name.format(f"{number:02d}")).is_file() for name in names)
    assert np.array_equal(planned(begun)[:, 0], np.arange(len(planned(begun))))
    for entry in campaign["rounds"][:-1]:
        objective = entry["plan"]["design"]["objective"]
        assert entry["plan"]["cost"] == pytest.approx(objective["value"])
        assert 0.0 < objective["lower_bound"] <= objective["value"] * (1 + 1e-9)
        assert objective["relative_gap"] <= 1e-7
    estimate = campaign["rounds"][-1]["estimate"]
    spread = campaign["rounds"][-1]["standard_deviation"]
    assert abs(estimate["b1"] - 3.5) < 4 * spread["b1"]
    assert abs(estimate["f1"] + 0.72) < 4 * spread["f1"]
    code, _, err = run("next", "c", tmp_path / "r1.csv")
    assert code == 2
    assert "campaign-over" in err
    code, out, _ = run("status", "c")
    assert code == 0
    assert "the data meet what is asked" in out


def test_the_power_that_is_told_is_that_of_the_signal(run, begun):
    """Not that of the whole plan, of which the part is the beginning."""
    part = np.loadtxt(begun / "signal.csv", delimiter=",", skiprows=1)
    code, out, _ = run("status", "c")
    assert code == 0
    assert f"apply {len(part)} samples of power {np.mean(part[:, 1] ** 2):.4g} (signal.csv" in out
    plan = read_run(begun)["campaign"]["rounds"][-1]["plan"]
    assert f"planned with {plan['power']:.4g}" in out


def test_a_withdrawn_record_does_not_count_and_stays(run, begun, tmp_path):
    for number in (1, 2):
        run("next", "c", applied(begun, tmp_path / f"r{number}.csv"), "--no-figures")
    before = read_run(begun)["campaign"]
    code, out, _ = run("next", "c", "--withdraw", 2, "--json", "--no-figures")
    result = json.loads(out)
    after, (gone,) = result["campaign"], found(result, "record-withdrawn")
    assert (code, gone["where"], gone["figures"]) == (0, "record_02.csv", {"record": 2})
    assert after["rounds"][-1]["records"] == [1]
    # It was applied: its samples and its energy are spent.
    assert after["rounds"][-1]["samples"] == before["rounds"][-1]["samples"]
    assert after["rounds"][-1]["estimate"] == pytest.approx(before["rounds"][1]["estimate"], rel=1e-6)
    assert (begun / "record_02.csv").is_file()
    code, _, err = run("next", "c", "--withdraw", 2)
    assert code == 2
    assert "record-unknown" in err


@pytest.mark.parametrize("scale", [0.5, 2.0, -1.0])
def test_a_record_at_another_scale_is_refused(run, begun, tmp_path, scale):
    record = applied(begun, tmp_path / "r.csv", scale=scale)
    code, _, err = run("next", "c", record)
    assert code == 2
    assert "record-other-scale" in err
    assert f"{scale:g} times" in err
    code, out, _ = run("next", "c", record, "--as-applied", "--no-figures", "--json")
    (scaled,) = found(json.loads(out), "record-scaled")
    assert (code, scaled["figures"]["scale"]) == (0, pytest.approx(scale, rel=1e-6))


@pytest.mark.first(1)
@pytest.mark.parametrize("missing", [0, 4])
def test_a_record_of_an_earlier_plan_is_refused(run, once, tmp_path, missing):
    """The input of the pilot, applied again with other noise, where the second plan is due."""
    times, u = np.loadtxt(once / "plan_01.csv", delimiter=",", skiprows=1).T[:, missing:]
    record = written(tmp_path / "again.csv", times, u, answered(u, seed=11))
    code, _, err = run("next", "c", record)
    assert code == 2
    assert "record-other-part" in err
    code, out, _ = run("next", "c", record, "--as-applied", "--no-figures", "--json")
    assert code == 0
    (repeated,) = found(json.loads(out), "part-repeated")
    assert repeated["where"] == "again.csv"
    assert (repeated["figures"]["plan"], repeated["figures"]["other"]) == ("plan_02.csv", "plan_01.csv")
    # What is due is never taken for something else, with rows missing or not.
    assert run("next", "c", applied(once, tmp_path / "r3.csv"), "--no-figures")[0] == 0


def test_what_does_not_belong_is_refused_and_changes_nothing(run, begun, tmp_path):
    before = (begun / "result.json").read_bytes()
    n = len(planned(begun)) + 1
    long = written(tmp_path / "long.csv", np.arange(n), np.ones(n), np.arange(n) ** 0.5)
    for arguments, error in [
        ((long,), "record-too-long"),
        ((tmp_path / "none.csv",), "data-unreadable"),
        (("--withdraw", 1), "record-unknown"),
    ]:
        code, _, err = run("next", "c", *arguments)
        assert code == 2
        assert error in err
    assert (begun / "result.json").read_bytes() == before


def without_a_value(rows):
    return [*rows[:3], rows[3].replace(rows[3].split(",")[1], "nan", 1), *rows[4:]]


@pytest.mark.parametrize("mend", [without_a_value, lambda rows: rows[5:]])
def test_rows_that_are_missing_leave_the_others_where_they_are(run, begun, tmp_path, mend):
    """So many count as were applied, whether the record begins late or has a gap."""
    record = applied(begun, tmp_path / "r1.csv")
    head, *rows = record.read_text().splitlines()
    record.write_text("\n".join([head, *mend(rows)]) + "\n")
    code, out, _ = run("next", "c", record, "--json", "--no-figures")
    (kept,) = json.loads(out)["campaign"]["records"]
    assert (code, kept["samples"]) == (0, len(rows))
    assert kept["likeness"] == pytest.approx(1.0, abs=1e-6)


def test_a_record_that_is_not_its_plan_is_refused(run, begun, tmp_path):
    record = applied(begun, tmp_path / "r1.csv")
    head, *rows = [row.split(",") for row in record.read_text().splitlines()]
    mixed = [[a[0], b[1], *a[2:]] for a, b in zip(rows, rows[::-1], strict=True)]
    record.write_text("\n".join(",".join(row) for row in [head, *mixed]) + "\n")
    before = (begun / "result.json").read_bytes()
    code, _, err = run("next", "c", record, "--no-figures")
    assert code == 2
    assert "record-unlike" in err
    assert (begun / "result.json").read_bytes() == before
    result = json.loads(run("next", "c", record, "--json", "--no-figures", "--as-applied")[1])
    assert abs(result["campaign"]["records"][0]["likeness"]) < 0.5
    (unlike,) = found(result, "record-unlike-plan")
    assert (unlike["where"], unlike["figures"]["plan"]) == ("r1.csv", "plan_01.csv")
    assert unlike["figures"]["correlation"] == result["campaign"]["records"][0]["likeness"]


def test_moves_between_parts_keep_the_limit(run, begun, tmp_path):
    limits = ["--set", "limits.rate=1.2", "--set", "signal.offset=40", "--set", "limits.amplitude=2.5"]
    assert run("campaign", "s.yaml", "-o", "d", "--no-figures", *limits)[0] == 0
    for number in (1, 2):
        record = applied(tmp_path / "d", tmp_path / f"d{number}.csv")
        assert run("next", "d", record, "--no-figures")[0] == 0
    u = planned(tmp_path / "d")[:, 1] - 40.0
    assert np.abs(np.diff(u, prepend=0.0)).max() <= 1.2 * (1 + 1e-9)
    assert np.abs(u).max() <= 2.5 * (1 + 1e-9)


def test_the_same_record_does_not_count_twice(run, begun, tmp_path):
    record = applied(begun, tmp_path / "r.csv")
    assert run("next", "c", record, "--no-figures")[0] == 0
    code, _, err = run("next", "c", record)
    assert code == 2
    assert "data-repeated" in err


def test_records_are_not_lost_to_another_run(run, once, tmp_path):
    for verb in ("solve", "campaign"):
        code, _, err = run(verb, "s.yaml", "-o", "c")
        assert code == 2
        assert "campaign-exists" in err
    assert (once / "record_01.csv").is_file()


def test_directories_of_another_kind_and_version_are_refused(run, begun):
    content = json.loads((begun / "result.json").read_text())
    content["campaign"]["version"] = 7
    (begun / "result.json").write_text(json.dumps(content))
    assert "campaign-version" in run("next", "c")[2]
    content["campaign"] |= {"version": 1, "rounds": [{}]}
    (begun / "result.json").write_text(json.dumps(content))
    told = run("next", "c")[2]
    assert "run-unreadable" in told
    assert "from a copy" in told  # to run the spec again, as after `solve`, would lose the records
    del content["campaign"]
    (begun / "result.json").write_text(json.dumps(content))
    assert "campaign-missing" in run("next", "c")[2]
    told = run("status", "nowhere")[2]
    assert "run-missing" in told
    assert "idesign campaign SPEC" in told


def test_data_of_another_plant_are_undecided(run, begun, tmp_path):
    assert run("next", "c", applied(begun, tmp_path / "a.csv"), "--no-figures")[0] == 0
    other = applied(begun, tmp_path / "b.csv", gain=-2.0, poles=(-0.5,))
    code, out, _ = run("next", "c", other, "--json", "--no-figures")
    assert code == 5
    assert json.loads(out)["status"] == "undecided"
    # Without it the campaign goes on.
    assert run("next", "c", "--withdraw", 2, "--no-figures")[0] == 0


def test_a_killed_round_leaves_the_state_before_or_after(run, begun, tmp_path):
    record = applied(begun, tmp_path / "r.csv")
    counted = set()
    for step in (1, 40, 400, 1200, 2000, 3000):
        child = os.fork()
        if child == 0:
            left = [step]

            def hear(event, _arguments, left=left):
                if event.startswith(("open", "os.", "shutil.")):
                    left[0] -= 1
                    if left[0] == 0:
                        os.kill(os.getpid(), signal.SIGKILL)

            sys.addaudithook(hear)
            try:
                run("next", "c", record, "--no-figures")
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        campaign = read_run(begun)["campaign"]
        assert len(campaign["records"]) in (0, 1)
        assert len(campaign["rounds"]) == len(campaign["records"]) + 1
        counted.add(len(campaign["records"]))
        if campaign["records"]:
            break
    assert run("status", "c")[0] == 0


@pytest.mark.first(1)
@pytest.mark.parametrize(("gain", "sign"), [(2.0, False), (-2.0, True)])
def test_a_poor_plant_of_the_spec_is_told_once(run, begun, tmp_path, gain, sign):
    """It is why an experiment goes in parts; the plans after the first one rest on estimates."""
    told = []
    for number in (1, 2):
        record = applied(begun, tmp_path / f"r{number}.csv", gain=gain)
        out = run("next", "c", record, "--json", "--no-figures")[1]
        result = json.loads(out)
        assert result["assessment"]["nominal"]["deviations"] > 5.0
        told.append([note for note in result.get("notes", []) if "plant of the spec" in note])
    ((note,), later) = told
    assert "standard deviations" in note
    assert ("opposite sign" in note) == sign
    assert len(note) < 200
    assert later == []


def test_one_process_decides_at_a_time(run, begun, tmp_path):
    record = applied(begun, tmp_path / "r.csv")
    with held(begun):
        code, _, err = run("next", "c", record, "--no-figures")
        assert (code, "output-busy" in err) == (2, True)
    assert run("next", "c", record, "--no-figures")[0] == 0


def begin(run, tmp_path, name, *overrides):
    told = [part for one in overrides for part in ("--set", one)]
    code, _, err = run("campaign", "s.yaml", "-o", name, "--no-figures", *told)
    return tmp_path / name, code, err


def test_every_part_has_a_record_by_the_seed_of_the_spec(run, tmp_path):
    """The same again by the same seed, and another by another."""
    plans = {}
    for name, seed in {"none": None, "0": 0, "6": 6, "again": 6}.items():
        overrides = [] if seed is None else [f"signal.seed={seed}"]
        directory, code, _ = begin(run, tmp_path, name, *overrides)
        assert code == 0
        if seed:
            assert run("next", name, applied(directory, tmp_path / "r.csv"), "--no-figures")[0] == 0
            seeds = [entry["plan"]["seed"] for entry in read_run(directory)["campaign"]["rounds"]]
            assert len(set(seeds)) == len(seeds) == 2
        plans[name] = planned(directory)
    assert np.array_equal(plans["none"], plans["0"])  # as everywhere, none is 0
    assert not np.array_equal(plans["none"], plans["6"][: len(plans["none"])])
    assert np.array_equal(plans["6"], plans["again"])


def test_parts_have_values_of_the_converter_only(run, tmp_path):
    """2^6 values over 20, so 0.3125 apart; the offset lies between two of them."""
    converter = "signal.quantisation={bits: 6, range: 10}"
    directory, code, _ = begin(run, tmp_path, "c", converter, "signal.offset=0.4")
    assert code == 0
    steps = planned(directory)[:, 1] / (20.0 / 2**6)
    assert np.allclose(steps, np.rint(steps), atol=1e-9)
    (round_,) = read_run(directory)["campaign"]["rounds"]
    assert round_["plan"]["offset"] == [0.3125]  # 0.4 is nearer to it than to 0.625
    # Records vary about the same value.
    spec = parse_spec(SPEC, overrides=[converter, "signal.offset=0.4"])
    assert build_identification(spec).operating_point == {"u1": 0.3125}


@pytest.mark.parametrize("asked", ["signal.samples=50", "signal.also=[mat]"])
def test_what_no_part_has_is_refused(run, tmp_path, asked):
    directory, code, err = begin(run, tmp_path, "c", asked)
    assert code == 2
    assert "not-supported" in err
    assert asked.split("=")[0] in err
    assert not directory.exists()
