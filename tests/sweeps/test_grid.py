"""Which points a sweep has: values, ranges, combinations, and what cannot be swept."""

import itertools

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import Sweep, parse_spec
from inputdesign_cli.sweeps.plan import Axis, Grid, build_grid, parse_settings


def texts(*settings):
    fixed, axes = parse_settings(settings)
    return fixed, {axis.key: axis.texts for axis in axes}


@pytest.mark.parametrize(
    ("setting", "values"),
    [
        ("a=1,2,3", ("1", "2", "3")),
        ("a= 1 , 2", ("1", "2")),
        ("a=0:40:5", ("0", "5", "10", "15", "20", "25", "30", "35", "40")),
        ("a=0:0.3:0.1", ("0", "0.1", "0.2", "0.3")),
        ("a=0:1:0.4", ("0", "0.4", "0.8")),
        ("a=3:1:-1", ("3", "2", "1")),
        ("a=1e-3:2e-3:1e-3", ("0.001", "0.002")),
        ("a=100:300:100", ("100", "200", "300")),
        ("a={type: white},{type: fir, order: 3}", ("{type: white}", "{type: fir, order: 3}")),
        ("a=[1, -0.5],[1, -0.6]", ("[1, -0.5]", "[1, -0.6]")),
        ("a='x, y',\"z\"", ("'x, y'", '"z"')),
        ("a=it's,b", ("it's", "b")),
    ],
)
def test_values_of_a_setting(setting, values):
    assert texts(setting) == ([], {"a": values})


def test_a_single_value_holds_for_all_points():
    assert texts("a=1", "b=[1, 2]", "c=1,2", "d=x = y") == (["a=1", "b=[1, 2]", "d=x = y"], {"c": ("1", "2")})


@pytest.mark.parametrize(
    ("setting", "code"),
    [("a=0:40", "bad-range"), ("a=0:40:0", "bad-range"), ("a=0:40:-1", "bad-range"),
     ("a=0:1:1e-9", "bad-range"), ("a=nan:4:1", "bad-range"), ("a=0:.inf:1", "bad-range"),
     ("a=0:4:-Infinity", "bad-range"), ("a=1,,2", "bad-override")],
)  # fmt: skip
def test_bad_settings(setting, code):
    with pytest.raises(SpecError) as caught:
        parse_settings([setting])
    assert caught.value.diagnostics[0].code == code


def test_a_key_is_swept_once():
    with pytest.raises(SpecError) as caught:
        parse_settings(["a=1,2", "a=3,4"])
    assert caught.value.diagnostics[0].code == "sweep-twice"


@pytest.mark.parametrize("lengths", [(1,), (3, 1), (2, 4, 3), (1, 2, 1, 2)])
def test_a_grid_is_the_product_of_its_axes(lengths):
    axes = [Axis(f"k{i}", tuple(map(str, range(n)))) for i, n in enumerate(lengths)]
    assert list(Grid(tuple(axes))) == list(itertools.product(*(axis.texts for axis in axes)))


def test_a_zipped_grid_goes_side_by_side():
    grid = build_grid(None, [Axis("a", ("1", "2")), Axis("b", ("3", "4"))], zipped=True)
    assert list(grid) == [("1", "3"), ("2", "4")]
    assert grid.overrides(grid[1]) == ["a=2", "b=4"]


@pytest.mark.parametrize(
    ("axes", "zipped", "code"),
    [
        ([], False, "sweep-empty"),
        ([Axis("a", ("1", "2")), Axis("b", ("3",) * 3)], True, "sweep-lengths"),
        ([Axis("a", ("1",) * 1001), Axis("b", ("1",) * 1000)], False, "sweep-too-large"),
    ],
)
def test_grids_that_are_refused(axes, zipped, code):
    with pytest.raises(SpecError) as caught:
        build_grid(None, axes, zipped=zipped)
    assert caught.value.diagnostics[0].code == code


BLOCK = {"set": {"a": [1, "white", {"type": "fir"}], "b": "0:0.2:0.1"}}


def test_the_block_of_a_spec_and_the_command_line():
    block = Sweep.model_validate(BLOCK)
    grid = build_grid(block, [], zipped=False)
    assert [axis.texts for axis in grid.axes] == [("1", "white", '{"type": "fir"}'), ("0", "0.1", "0.2")]
    replaced = build_grid(block, [Axis("a", ("7", "8")), Axis("c", ("x", "y"))], zipped=False)
    assert {axis.key: axis.texts for axis in replaced.axes} == {
        "a": ("7", "8"), "b": ("0", "0.1", "0.2"), "c": ("x", "y")
    }  # fmt: skip
    assert build_grid(Sweep.model_validate(grid.block()), [], zipped=False) == grid


GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


@pytest.mark.parametrize(
    ("block", "code", "key"),
    [
        ("sweep: {set: {a.b: 3}}\n", "wrong-shape", "sweep.set.a.b"),
        ("sweep: {set: {a.b: []}}\n", "wrong-shape", "sweep.set.a.b"),
        ("sweep: {set: {a.b: 0:4}}\n", "bad-range", "sweep.set.a.b"),
        ("sweep: {set: [1, 2]}\n", "wrong-shape", "sweep.set"),
        ("sweep: {zip: true}\n", "missing-key", "sweep.set"),
        ("sweep: {sett: {a: [1]}}\n", "unknown-key", "sweep.sett"),
    ],
)
def test_a_bad_block_is_a_complaint_of_the_spec(block, code, key):
    with pytest.raises(SpecError) as caught:
        parse_spec(GOOD + block, "x.yaml")
    diagnostic = caught.value.diagnostics[0]
    assert diagnostic.code == code
    assert diagnostic.key == key
    assert diagnostic.location.line == 4
