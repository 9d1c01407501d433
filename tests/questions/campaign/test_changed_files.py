"""What was changed in the directory of a campaign since it was kept is told, and decides nothing."""

import json

import pytest

from tests.support.campaigns import applied

EDITS = {
    "record elsewhere": lambda c, r: c["records"][0].update(file="../../etc/passwd"),
    "record of no plan": lambda c, r: c["records"][0].update(plan="plan_99.csv"),
    "too many samples": lambda c, r: c["records"][0].update(samples=5000),
    "negative samples": lambda c, r: c["records"][0].update(samples=-7),
    "half a sample": lambda c, r: c["records"][0].update(samples=20.5),
    "energy in words": lambda c, r: c["records"][0].update(energy="nan"),
    "plan in words": lambda c, r: c["rounds"][-1]["plan"].update(samples="many"),
    "another state": lambda c, r: c.update(state="banana"),
    "no rounds": lambda c, r: c.update(rounds=[]),
    "a round that is none": lambda c, r: c["rounds"].append("x"),
    "other parameters": lambda c, r: c.update(last={"b1": 1.0}),
    "a parameter in words": lambda c, r: c["rounds"][-1]["estimate"].update(b1="x"),
    "no cost": lambda c, r: c.update(first_cost=0.0),
    "files that are left out": lambda c, r: r.update(files=["spec.yaml"]),
    "no files": lambda c, r: r.pop("files"),
    "no digest of the decisions": lambda c, r: c["digests"].pop("result.json"),
    "no digests": lambda c, r: c.pop("digests"),
}


@pytest.mark.first(9)
@pytest.mark.parametrize("name", EDITS)
def test_what_was_edited_by_hand_is_told(name, run, once, tmp_path):
    result = json.loads((once / "result.json").read_text())
    record = applied(once, tmp_path / "r2.csv")
    EDITS[name](result["campaign"], result)
    (once / "result.json").write_text(json.dumps(result))
    for command in (("status", "c"), ("next", "c", record, "--no-figures")):
        code, _, err = run(*command)
        assert code == 2
        assert "run-unreadable" in err or "campaign-changed" in err


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"time,u1\n0,x\n", b"time,u1\n0,nan\n"])
def test_plans_that_are_no_plans_any_more_are_told(content, run, begun):
    (begun / "plan_01.csv").write_bytes(content)
    code, _, err = run("status", "c")
    assert (code, "campaign-changed" in err) == (2, True)


def halved(text):
    lines = text.splitlines()
    return "\n".join(lines[: len(lines) // 2]) + "\n"


def tenfold(text):
    head, *rows = [row.split(",") for row in text.splitlines()]
    return "\n".join(",".join(row) for row in [head, *([*r[:2], f"{10 * float(r[2])}"] for r in rows)]) + "\n"


@pytest.mark.first(1)
@pytest.mark.parametrize("damage", [halved, lambda text: text[:40], tenfold, lambda text: text + "\n"])
def test_a_record_that_was_changed_decides_nothing(damage, run, once, tmp_path):
    kept, before = (once / "record_01.csv").read_text(), (once / "result.json").read_bytes()
    (once / "record_01.csv").write_text(damage(kept))
    for command in (
        ("next", "c"),
        ("next", "c", applied(once, tmp_path / "r2.csv")),
        ("next", "c", "--withdraw", 2),
        ("status", "c"),
    ):
        code, _, err = run(*command)
        assert code == 2
        assert "campaign-changed" in err
        assert "c/record_01.csv" in err
        assert "--withdraw 1" in err
    assert (once / "result.json").read_bytes() == before
    # Both ways that are told of mend it.
    code, out, _ = run("next", "c", "--withdraw", 1, "--json", "--no-figures")
    assert (code, json.loads(out)["campaign"]["rounds"][-1]["records"]) == (0, [])
    assert run("next", "c", applied(once, tmp_path / "r3.csv"), "--no-figures")[0] == 0
    kept = (once / "record_02.csv").read_text()
    (once / "record_02.csv").write_text(damage(kept))
    assert run("next", "c", "--no-figures")[0] == 2
    (once / "record_02.csv").write_text(kept)
    assert run("next", "c", "--no-figures")[0] == 0


def test_a_plan_that_was_changed_decides_nothing(run, once, tmp_path):
    record = applied(once, tmp_path / "r2.csv")
    for name in ("plan_01.csv", "plan_02.csv"):
        kept = (once / name).read_text()
        (once / name).write_text(kept[:-3] + "9\n")
        code, _, err = run("next", "c", record)
        assert (code, "campaign-changed" in err, f"c/{name}" in err) == (2, True, True)
        (once / name).write_text(kept)
    assert (once / "signal.csv").read_text() == kept  # which the message says of the plan that is due


def test_a_record_that_is_gone_is_to_be_put_back(run, once, tmp_path):
    (once / "record_01.csv").unlink()
    code, _, err = run("next", "c")
    assert (code, "run-incomplete" in err, "put it back" in err) == (2, True, True)
    assert "run the spec again" not in err


def appended(path):
    path.write_bytes(path.read_bytes() + b"\n")


def asked_less(path):
    path.write_text(path.read_text().replace("0.05", "0.5"))


def decided_otherwise(path):
    result = json.loads(path.read_text())
    result["campaign"]["rounds"][-1]["worst_ratio"] = 0.5
    path.write_text(json.dumps(result))


DECIDING = {
    "spec.yaml": asked_less,
    "signal.csv": lambda path: path.write_text(path.read_text() + "999,3\n"),
    "plan_01.csv": appended,
    "plan_02.csv": appended,
    "record_01.csv": appended,
    "result.json": decided_otherwise,
}


def test_every_file_that_decides_is_known_by_its_digest(run, once, tmp_path):
    """Each of the directory is changed in turn; the others are pictures, estimates and copies."""
    record = applied(once, tmp_path / "r2.csv")
    told = set()
    for path in sorted(once.iterdir()):
        kept = path.read_bytes()
        DECIDING.get(path.name, appended)(path)
        code, _, err = run("status", "c")
        if code:
            told.add(path.name)
            assert "campaign-changed" in err
            assert f"c/{path.name}" in err
            assert "put it back" in err
            changed = (once / "result.json").read_bytes()
            assert run("next", "c", record, "--no-figures")[0] == 2
            assert (once / "result.json").read_bytes() == changed
        path.write_bytes(kept)
    assert told == set(DECIDING)
    assert run("next", "c", record, "--no-figures")[0] == 0


def test_what_is_told_of_a_changed_signal_mends_it(run, begun, tmp_path):
    appended(begun / "signal.csv")
    assert "plan_01.csv in the same directory" in run("status", "c")[2]
    (begun / "signal.csv").write_bytes((begun / "plan_01.csv").read_bytes())
    assert run("status", "c")[0] == 0


def test_where_the_result_is_gone_the_records_are_not_given_up(run, once, tmp_path):
    record, kept = applied(once, tmp_path / "r2.csv"), (once / "result.json").read_bytes()
    (once / "result.json").unlink()
    for command in (("next", "c", record), ("next", "c"), ("status", "c")):
        code, _, err = run(*command)
        assert (code, "run-missing" in err) == (2, True)
        assert "put it back from a copy" in err
        assert "idesign identify" in err
        assert "solve SPEC" not in err
    (once / "result.json").write_bytes(kept)
    assert run("next", "c", record, "--no-figures")[0] == 0
    told = run("next", "nowhere", record)[2]
    assert "run-missing" in told
    assert "idesign campaign SPEC" in told
