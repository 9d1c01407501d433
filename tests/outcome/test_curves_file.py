"""figures.json: what figures show comes back as it was, of every kind."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.record import FIGURES
from inputdesign_cli.outcome.run_directory import curves_json, read_curves
from tests.support.curves import CURVES


def same(one, other):
    """Whether two values are of one kind, and equal to the digits that a figure shows."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
        )
    if isinstance(one, np.ndarray):
        alike = np.iscomplexobj(one) == np.iscomplexobj(other) and one.shape == other.shape
        return alike and np.allclose(one, other, rtol=2e-7, atol=0.0, equal_nan=True)
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


def test_every_kind_is_tried():
    assert {type(one) for one in CURVES.values()} == set(Curves.__subclasses__())


def test_what_figures_show_comes_back_as_it_was(tmp_path):
    (tmp_path / FIGURES).write_bytes(curves_json(CURVES))
    found = read_curves(tmp_path)
    assert list(found) == list(CURVES)
    assert [name for name, made in CURVES.items() if not same(made, found[name])] == []


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b'{"a": 1}', b'{"a": {}}', b'{"a": {"kind": "Path"}}', b'{"a": {"kind": "LossCurves"}}',
     b'{"a": {"kind": "ErrorCurves", "energy": "x"}}', b'{"a": {"kind": "BoundCurves", "panels": [3]}}'],
)  # fmt: skip
def test_what_is_no_such_file_is_told_by_its_name(content, tmp_path):
    (tmp_path / FIGURES).write_bytes(content)
    with pytest.raises(DataError, match=r"figures\.json") as caught:
        read_curves(tmp_path)
    assert caught.value.diagnostics[0].code == "run-unreadable"


def test_a_run_of_an_older_version_has_none(tmp_path):
    assert read_curves(tmp_path) == {}
