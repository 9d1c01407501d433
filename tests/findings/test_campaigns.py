"""Findings about the parts of a campaign: when each holds, and the figures that it carries."""

import pytest

from inputdesign_cli.findings.campaigns import (
    campaign_refuted,
    estimate_not_used,
    hardly_followed,
    planned_otherwise,
    shorter,
)

AS_ASKED = {"why": "", "capped": False, "share": 1.0, "beyond": False, "part_cost": 2.0, "fragile": False}


@pytest.mark.parametrize(
    ("change", "code", "figures"),
    [
        ({"why": "no power is enough"}, "part-without-design", {"why": "no power is enough"}),
        ({"capped": True}, "plan-capped", {}),
        ({"share": 0.5}, "part-scaled", {"share": 0.5}),
        ({"beyond": True}, "earlier-parts-cost", {"cost": 2.0}),
        ({"fragile": True}, "part-not-robust", {}),
    ],
)
def test_a_plan_that_is_not_as_asked_has_one_finding(change, code, figures):
    assert planned_otherwise("plan_02.csv", **AS_ASKED) == []
    assert planned_otherwise("plan_02.csv", **(AS_ASKED | {"share": 0.95})) == []
    (only,) = planned_otherwise("plan_02.csv", **(AS_ASKED | change))
    assert (only.code, only.where, only.figures) == (code, "plan_02.csv", figures)


@pytest.mark.parametrize(
    ("likeness", "follows", "other", "expected"),
    [
        (0.95, True, None, []),
        (0.95, True, "plan_01.csv", [("part-repeated", "doubt")]),
        (0.7, True, None, [("record-unlike-plan", "note")]),
        (0.1, False, None, [("record-unlike-plan", "doubt")]),
    ],
)
def test_a_record_that_is_taken_may_follow_its_plan_or_not(likeness, follows, other, expected):
    given = {"likeness": likeness, "spliced": 0.96, "like": 0.9, "follows": follows, "other": other}
    found = hardly_followed("r.csv", "plan_02.csv", **given)
    assert [(one.code, one.severity) for one in found] == expected
    for one in found:
        assert one.figures["correlation"] == likeness
        assert one.figures.get("other") == other


def test_a_scale_is_named_where_the_plan_is_followed():
    given = {"spliced": 0.99, "like": 0.9, "follows": True, "other": None, "scale": 0.5}
    (scaled,) = hardly_followed("r.csv", "plan_02.csv", likeness=0.99, **given)
    assert (scaled.code, scaled.figures["scale"]) == ("record-scaled", 0.5)
    (turned,) = hardly_followed("r.csv", "plan_02.csv", likeness=-0.99, **given)
    assert turned.code == "record-scaled"


def test_a_complete_record_is_not_shorter():
    assert shorter("r.csv", "plan_01.csv", 60, 60) == []
    (one,) = shorter("r.csv", "plan_01.csv", 59, 60)
    assert (one.code, one.figures["samples"], one.figures["planned"]) == ("record-shorter", 59, 60)


def test_an_estimate_that_is_used_has_no_finding():
    assert estimate_not_used(1.0, "") == []
    (part,) = estimate_not_used(0.4, "")
    (nothing,) = estimate_not_used(None, "the loop is unstable")
    assert (part.code, part.figures["share"]) == ("estimate-not-used", 0.4)
    assert (nothing.code, nothing.figures) == ("estimate-not-used", {"why": "the loop is unstable"})


def test_the_end_names_the_records_that_count(tmp_path):
    (end,) = campaign_refuted(tmp_path, 80, 600, ["record_02.csv"], every=False)
    assert end.severity == "refuted"
    assert end.figures == {"samples": 80, "end": 600, "records": ["record_02.csv"]}
    assert str(tmp_path / "record_02.csv") in end.message
