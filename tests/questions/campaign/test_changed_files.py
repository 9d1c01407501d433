"""Files of a campaign that were changed after they were stored are named, and no decision uses them."""

import json

import pytest

from tests.support.campaigns import applied

EDITS = {
    "record elsewhere": lambda c, r: c["records"][0].update(file="../../etc/passwd"),
    "negative samples": lambda c, r: c["records"][0].update(samples=-7),
    "no rounds": lambda c, r: c.update(rounds=[]),
    "a round that is a string": lambda c, r: c["rounds"].append("x"),
    "a list of files that is too short": lambda c, r: r.update(files=["spec.yaml"]),
    "no files": lambda c, r: r.pop("files"),
    "no digest of result.json": lambda c, r: c["digests"].pop("result.json"),
    "no digests": lambda c, r: c.pop("digests"),
}


@pytest.mark.parametrize("name", EDITS)
def test_a_result_json_that_was_edited_by_hand_is_refused(name, run, once, tmp_path):
    result = json.loads((once / "result.json").read_text())
    record = applied(once, tmp_path / "r2.csv")
    EDITS[name](result["campaign"], result)
    (once / "result.json").write_text(json.dumps(result))
    for command in (("status", "c"), ("next", "c", record, "--no-figures")):
        code, _, err = run(*command)
        assert code == 2
        assert "run-unreadable" in err or "campaign-changed" in err


def halved(text):
    lines = text.splitlines()
    return "\n".join(lines[: len(lines) // 2]) + "\n"


def tenfold(text):
    head, *rows = [row.split(",") for row in text.splitlines()]
    return "\n".join(",".join(row) for row in [head, *([*r[:2], f"{10 * float(r[2])}"] for r in rows)]) + "\n"


@pytest.mark.first(1)
@pytest.mark.parametrize("damage", [halved, lambda text: text[:40], tenfold, lambda text: text + "\n"])
def test_a_changed_record_is_refused_until_it_is_withdrawn_or_restored(damage, run, once, tmp_path):
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
    # Both remedies of the message work.
    code, out, _ = run("next", "c", "--withdraw", 1, "--json", "--no-figures")
    assert (code, json.loads(out)["campaign"]["rounds"][-1]["records"]) == (0, [])
    assert run("next", "c", applied(once, tmp_path / "r3.csv"), "--no-figures")[0] == 0
    kept = (once / "record_02.csv").read_text()
    (once / "record_02.csv").write_text(damage(kept))
    assert run("next", "c", "--no-figures")[0] == 2
    (once / "record_02.csv").write_text(kept)
    assert run("next", "c", "--no-figures")[0] == 0


def test_a_campaign_with_missing_files_goes_on_once_they_are_restored(run, once, tmp_path):
    record = applied(once, tmp_path / "r2.csv")
    for name, error in (("result.json", "run-missing"), ("record_01.csv", "run-incomplete")):
        kept = (once / name).read_bytes()
        (once / name).unlink()
        for command in (("next", "c", record), ("next", "c"), ("status", "c")):
            code, _, err = run(*command)
            assert (code, error in err) == (2, True)
        (once / name).write_bytes(kept)
    assert run("next", "c", record, "--no-figures")[0] == 0


def written(content):
    return lambda path: path.write_bytes(content)


def appended(path, more=b"\n"):
    path.write_bytes(path.read_bytes() + more)


def another_digit(path):
    path.write_bytes(path.read_bytes()[:-3] + b"9\n")


def requirement_relaxed(path):
    path.write_text(path.read_text().replace("0.05", "0.5"))


def worst_ratio_changed(path):
    result = json.loads(path.read_text())
    result["campaign"]["rounds"][-1]["worst_ratio"] = 0.5
    path.write_text(json.dumps(result))


NO_PLANS = [written(x) for x in (b"", b"\xff\xfe\x00", b"time,u1\n0,x\n", b"time,u1\n0,nan\n")]
DECIDING = {
    "spec.yaml": [requirement_relaxed],
    "signal.csv": [appended, lambda path: appended(path, b"999,3\n")],
    "plan_01.csv": [appended, another_digit],
    "plan_02.csv": [appended, another_digit, *NO_PLANS],
    "record_01.csv": [appended],
    "result.json": [worst_ratio_changed],
}


def test_every_file_that_decisions_use_is_protected_by_its_digest(run, once, tmp_path):
    """Each file is changed in turn; pictures, estimates and copies may change."""
    record = applied(once, tmp_path / "r2.csv")
    told = set()
    for path in sorted(once.iterdir()):
        kept = path.read_bytes()
        for change in DECIDING.get(path.name, [appended]):
            change(path)
            code, _, err = run("status", "c")
            if code:
                told.add(path.name)
                assert ("campaign-changed" in err, f"c/{path.name}" in err) == (True, True)
                changed = (once / "result.json").read_bytes()
                assert run("next", "c", record, "--no-figures")[0] == 2
                assert (once / "result.json").read_bytes() == changed
            if path.name == "signal.csv":  # the message names a copy
                assert "plan_02.csv in the same directory" in err
                assert (once / "plan_02.csv").read_bytes() == kept
            path.write_bytes(kept)
    assert told == set(DECIDING)
    assert run("next", "c", record, "--no-figures")[0] == 0
