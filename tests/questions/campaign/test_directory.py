"""`idesign campaign`, `next` and `status`: what the directory stores, refuses and continues."""

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
from inputdesign_cli.questions.campaign.plans import usefully_moved
from tests.support.campaigns import SPEC, answered, applied, found, planned, written


@pytest.fixture
def taken(run):
    """Gives a record to the campaign; returns exit code, result (or {}) and stderr."""

    def take(*arguments):
        code, out, err = run("next", "c", *arguments, "--json", "--no-figures")
        return code, json.loads(out) if out else {}, err

    return take


@pytest.fixture
def begin(run, tmp_path):
    """Begins a campaign with overrides; returns its directory, exit code and stderr."""

    def begin(name, *overrides):
        sets = [part for one in overrides for part in ("--set", one)]
        code, _, err = run("campaign", "s.yaml", "-o", name, "--no-figures", *sets)
        return tmp_path / name, code, err

    return begin


def kept(directory):
    return (directory / "result.json").read_bytes()


def test_a_campaign_runs_until_the_data_meet_the_requirement(run, begin, taken, tmp_path):
    begun, _, _ = begin("c", "campaign.last=nominal")
    assert len(planned(begun)) == 20
    for number in range(1, 12):
        code, result, err = taken(applied(begun, tmp_path / f"r{number}.csv"))
        assert code == 0, err
        if result["status"] != "running":
            break
    assert (result["status"], result["assessment"]["met"]) == ("stopped", True)
    assert not (begun / "signal.csv").exists()
    campaign = result["campaign"]
    samples = np.cumsum([0, *(record["samples"] for record in campaign["records"])])
    assert [entry["samples"] for entry in campaign["rounds"]] == samples.tolist()
    # Every plan, record and estimate stays, and the times of the plans are consecutive.
    for number in range(1, len(campaign["records"]) + 1):
        names = ("plan_{}.csv", "record_{}.csv", "record_{}_as_given.csv", "model_{}.yaml")
        assert all((begun / name.format(f"{number:02d}")).is_file() for name in names)
    assert np.array_equal(planned(begun)[:, 0], np.arange(len(planned(begun))))
    for entry in campaign["rounds"][:-1]:
        objective = entry["plan"]["design"]["objective"]
        assert entry["plan"]["cost"] == pytest.approx(objective["value"])
        assert 0.0 < objective["lower_bound"] <= objective["value"] * (1 + 1e-9)
        assert objective["relative_gap"] <= 1e-7
    last = campaign["rounds"][-1]
    for name, true in (("b1", 3.5), ("f1", -0.72)):
        assert abs(last["estimate"][name] - true) < 4 * last["standard_deviation"][name]
    code, _, err = taken(tmp_path / "r1.csv")
    assert (code, "campaign-over" in err) == (2, True)
    assert run("status", "c")[0] == 0


def test_a_withdrawn_record_is_kept_but_not_used(taken, once, tmp_path):
    """The record comes from another plant and has made the campaign undecided."""
    other = applied(once, tmp_path / "b.csv", gain=-2.0, poles=(-0.5,))
    code, result, _ = taken(other)
    assert (code, result["status"]) == (5, "undecided")
    before = result["campaign"]
    code, result, _ = taken("--withdraw", 2)
    after, (gone,) = result["campaign"], found(result, "record-withdrawn")
    assert (code, gone["where"], gone["figures"]) == (0, "record_02.csv", {"record": 2})
    assert after["rounds"][-1]["records"] == [1]
    # The withdrawn experiment was applied, so its samples count as spent.
    assert after["rounds"][-1]["samples"] == before["rounds"][-1]["samples"]
    assert after["rounds"][-1]["estimate"] == pytest.approx(before["rounds"][1]["estimate"], rel=1e-6)
    assert (once / "record_02.csv").is_file()
    code, _, err = taken("--withdraw", 2)
    assert (code, "record-unknown" in err) == (2, True)


def test_several_records_are_withdrawn_at_once(taken, once, tmp_path):
    assert taken(applied(once, tmp_path / "r2.csv"))[0] == 0
    code, result, _ = taken("--withdraw", 2, "--withdraw", 1)
    gone = [one["figures"]["record"] for one in found(result, "record-withdrawn")]
    assert (code, gone, result["campaign"]["rounds"][-1]["records"]) == (0, [1, 2], [])


def test_planning_again_from_the_same_data_gives_the_same_plan(begun, taken, tmp_path):
    """The plan must stay, since it may have been applied already."""
    for number in (1, 2):
        record, plan = applied(begun, tmp_path / f"r{number}.csv"), planned(begun)
        assert taken()[0] == 0
        assert np.allclose(planned(begun), plan, rtol=0.0, atol=1e-6)
        assert taken(record)[0] == 0


@pytest.mark.parametrize("never", [False, True])
def test_inconsistent_records_end_a_campaign_unless_stop_is_never(begin, taken, tmp_path, never):
    directory, _, _ = begin("c", *(["campaign.stop=never"] * never))
    assert taken(applied(directory, tmp_path / "a.csv"))[0] == 0
    code, result, _ = taken(applied(directory, tmp_path / "b.csv", gain=-2.0, poles=(-0.5,)))
    assert (code, result["assessment"]["next"].split()) == (
        0 if never else 5,
        ["idesign", "assess", "c/spec.yaml", "c/record_02.csv"],
    )
    assert found(result, "records-differ")
    code, result, _ = taken("--regardless")
    assert (code, result["status"]) == (0, "running")


@pytest.mark.first(1)
@pytest.mark.parametrize("cap", [0.2, 0.05])
def test_a_part_scaled_to_the_power_cap_states_its_share_of_the_planned_power(begin, cap):
    """The only part is planned without data, so no warning says that it is not robust."""
    directory, _, _ = begin("c", f"campaign.power_cap={cap}", "campaign.pilot=200", "campaign.block=200")
    result = read_run(directory)
    (weaker,), plan = found(result, "part-scaled"), result["campaign"]["rounds"][0]["plan"]
    assert (
        weaker["figures"]["share"] == pytest.approx(plan["part_power"] / plan["power"]) == pytest.approx(cap)
    )
    assert not found(result, "part-not-robust")


@pytest.mark.first(1)
@pytest.mark.parametrize("scale", [0.5, 2.0, -1.0])
def test_a_record_at_another_scale_is_refused(begun, taken, tmp_path, scale):
    record = applied(begun, tmp_path / "r.csv", scale=scale)
    code, _, err = taken(record)
    assert (code, "record-other-scale" in err, f"{scale:g} times" in err) == (2, True, True)
    code, result, _ = taken(record, "--as-applied")
    (scaled,) = found(result, "record-scaled")
    assert (code, scaled["figures"]["scale"]) == (0, pytest.approx(scale, rel=1e-6))


@pytest.mark.first(1)
@pytest.mark.parametrize("missing", [0, 4])
def test_a_record_of_an_earlier_plan_is_refused(once, taken, tmp_path, missing):
    """The input of the pilot, applied again with other noise, where the second plan is due."""
    times, u = np.loadtxt(once / "plan_01.csv", delimiter=",", skiprows=1).T[:, missing:]
    record = written(tmp_path / "again.csv", times, u, answered(u, seed=11))
    code, _, err = taken(record)
    assert (code, "record-other-part" in err) == (2, True)
    code, result, _ = taken(record, "--as-applied")
    (repeated,) = found(result, "part-repeated")
    plans = repeated["figures"]["plan"], repeated["figures"]["other"]
    assert (code, repeated["where"], plans) == (0, "again.csv", ("plan_02.csv", "plan_01.csv"))
    # A record of the plan that is due is not mistaken for an earlier one.
    assert taken(applied(once, tmp_path / "r3.csv"))[0] == 0


def test_refused_records_and_commands_leave_the_campaign_unchanged(run, once, taken, tmp_path):
    """Records too long, missing, unknown, repeated or shuffled; other commands in the directory."""
    before, times = kept(once), np.arange(200)
    long = written(tmp_path / "long.csv", times, np.ones(200), times**0.5)
    record = applied(once, tmp_path / "r2.csv")
    head, *lines = [row.split(",") for row in record.read_text().splitlines()]
    mixed = [[a[0], b[1], *a[2:]] for a, b in zip(lines, lines[::-1], strict=True)]
    record.write_text("\n".join(",".join(row) for row in [head, *mixed]) + "\n")
    for arguments, error in [
        ((long,), "record-too-long"),
        ((tmp_path / "none.csv",), "data-unreadable"),
        (("--withdraw", 2), "record-unknown"),
        ((once / "record_01.csv",), "data-repeated"),
        ((record,), "record-unlike"),
    ]:
        code, _, err = taken(*arguments)
        assert (code, error in err) == (2, True), error
    for verb in ("solve", "campaign"):
        code, _, err = run(verb, "s.yaml", "-o", "c")
        assert (code, "campaign-exists" in err) == (2, True)
    with held(once):
        code, _, err = taken(record)
        assert (code, "output-busy" in err) == (2, True)
    assert kept(once) == before
    result = taken(record, "--as-applied")[1]
    (unlike,), last = found(result, "record-unlike-plan"), result["campaign"]["records"][-1]
    assert (unlike["where"], unlike["figures"]["plan"]) == ("r2.csv", "plan_02.csv")
    assert unlike["figures"]["correlation"] == last["likeness"] < 0.5


def without_a_value(rows):
    return [*rows[:3], rows[3].replace(rows[3].split(",")[1], "nan", 1), *rows[4:]]


@pytest.mark.first(1)
@pytest.mark.parametrize("mend", [without_a_value, lambda rows: rows[5:]])
def test_missing_rows_do_not_shift_the_others_in_time(begun, taken, tmp_path, mend):
    """All applied samples are counted, whether the record begins late or has a gap."""
    record = applied(begun, tmp_path / "r1.csv")
    head, *rows = record.read_text().splitlines()
    record.write_text("\n".join([head, *mend(rows)]) + "\n")
    code, result, _ = taken(record)
    (one,) = result["campaign"]["records"]
    assert (code, one["samples"], one["likeness"]) == (0, len(rows), pytest.approx(1.0, abs=1e-6))


def test_directories_of_another_kind_and_version_are_refused(run, begun):
    content = json.loads((begun / "result.json").read_text())
    for change, error in [
        ({"version": 7}, "campaign-version"),
        ({"version": 1, "rounds": [{}]}, "run-unreadable"),
        (None, "campaign-missing"),
    ]:
        content["campaign"] = None if change is None else content["campaign"] | change
        (begun / "result.json").write_text(json.dumps(content))
        assert error in run("next", "c")[2]
    assert "run-missing" in run("status", "nowhere")[2]


def test_a_killed_next_command_leaves_the_state_before_or_after_it(run, begun, tmp_path):
    record = applied(begun, tmp_path / "r.csv")
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
        if campaign["records"]:
            break
    assert run("status", "c")[0] == 0


@pytest.mark.first(1)
@pytest.mark.parametrize(("gain", "sign"), [(2.0, False), (-2.0, True)])
def test_a_plant_far_from_the_spec_is_reported_after_the_first_record(begun, taken, tmp_path, gain, sign):
    """Only the first plan rests on the spec; later plans rest on estimates."""
    told = []
    for number in (1, 2):
        result = taken(applied(begun, tmp_path / f"r{number}.csv", gain=gain))[1]
        nominal = result["assessment"]["nominal"]
        assert (nominal["deviations"] > 5.0, nominal["opposite_sign"]) == (True, sign)
        told.append(
            {one["code"] for one in result.get("findings", [])} & {"far-from-the-spec", "another-plant"}
        )
    assert (len(told[0]), told[1]) == (1, set())


def test_moves_from_part_to_part_keep_rate_and_amplitude_limits(begin, run, tmp_path):
    directory, _, _ = begin("d", "limits.rate=1.2", "signal.offset=40", "limits.amplitude=2.5")
    assert run("next", "d", applied(directory, tmp_path / "d1.csv"), "--no-figures")[0] == 0
    u = planned(directory)[:, 1] - 40.0
    assert np.abs(np.diff(u, prepend=0.0)).max() <= 1.2 * (1 + 1e-9)
    assert np.abs(u).max() <= 2.5 * (1 + 1e-9)


def test_the_seed_of_the_spec_determines_the_plans_of_a_campaign(begin, run, tmp_path):
    """The same seed gives the same plan, another seed another one."""
    seeds = {"none": (), "0": ("signal.seed=0",), "6": ("signal.seed=6",), "again": ("signal.seed=6",)}
    plans = {name: planned(begin(name, *own)[0]) for name, own in seeds.items()}
    assert np.array_equal(plans["none"], plans["0"])  # the default seed is 0
    assert not np.array_equal(plans["none"], plans["6"])
    assert np.array_equal(plans["6"], plans["again"])
    assert run("next", "6", applied(tmp_path / "6", tmp_path / "r.csv"), "--no-figures")[0] == 0
    first, second = (one["plan"]["seed"] for one in read_run(tmp_path / "6")["campaign"]["rounds"])
    assert first != second


def test_samples_of_a_part_are_values_of_the_converter(begin):
    """2^6 values over 20 are 0.3125 apart; the offset lies between two of them."""
    overrides = ["signal.quantisation={bits: 6, range: 10}", "signal.offset=0.4"]
    directory, _, _ = begin("c", *overrides)
    steps = planned(directory)[:, 1] / (20.0 / 2**6)
    assert np.allclose(steps, np.rint(steps), atol=1e-9)
    (round_,) = read_run(directory)["campaign"]["rounds"]
    assert round_["plan"]["offset"] == [0.3125]  # 0.4 is nearer to it than to 0.625
    # Identification takes the same operating point.
    assert build_identification(parse_spec(SPEC, overrides=overrides)).operating_point == {"u1": 0.3125}


@pytest.mark.parametrize(
    ("asked", "code"), [(["signal.samples=50"], "not-supported"), (["signal.also=[mat]"], "not-supported")]
)
def test_signal_options_that_campaigns_do_not_support_are_refused(begin, asked, code):
    directory, exit_code, err = begin("c", *asked)
    assert (exit_code, code in err, asked[0].split("=")[0] in err) == (2, True, True)
    assert not directory.exists()


@pytest.mark.first(1)
@pytest.mark.parametrize(("hold", "least"), [(7, 0.3), (1, 0.4), (4, None), ("auto", 0.2)])
def test_moves_within_and_between_parts_keep_least_move_and_hold(begin, run, tmp_path, hold, least):
    """The first move starts from the offset of 3."""
    shortest = {"auto": 1}.get(hold, hold)
    own = [f"signal.hold={hold}"] + ([] if least is None else [f"signal.least_move={least}"])
    directory, code, err = begin("c", "campaign.block=30", "campaign.pilot=30", "signal.offset=3", *own)
    assert code == 0, err
    assert run("next", "c", applied(directory, tmp_path / "r.csv"), "--no-figures")[0] == 0
    moves = np.diff(planned(directory)[:, 1], prepend=3.0)
    assert np.abs(moves[moves != 0.0]).min() >= (least or 0.0) * (1 - 1e-9)
    assert np.all(np.flatnonzero(moves) % shortest == 0)
    plans = [entry["plan"] for entry in read_run(directory)["campaign"]["rounds"]]
    assert [plan["samples"] % shortest for plan in plans] == [0, 0]


@pytest.mark.parametrize("least", [0.1, 1.0, 2.5])
def test_enlarging_moves_to_the_least_move_keeps_the_power(least):
    """The planned moves are smaller; only the amplitude limit may reduce the power."""
    record = np.random.default_rng(1).standard_normal((80, 2)) * [1.0, 0.5]
    start, reach = np.array([0.0, 2.0]), np.array([6.0, 3.0])
    moved = usefully_moved(record, start, np.array([least, 0.5 * least]), reach)
    moves = np.abs(np.diff(moved, axis=0, prepend=start[None]))
    assert np.all((moves == 0.0) | (moves >= [least, 0.5 * least]))
    assert np.mean(moved**2) >= 0.95 * np.mean(record**2)
    assert np.all(np.abs(moved).max(axis=0) <= reach)
    low = usefully_moved(
        0.1 * record, 0.0 * start, np.array([least, least]), 0.15 * np.abs(record).max(axis=0)
    )
    assert np.abs(low).max() <= 0.15 * np.abs(record).max()
