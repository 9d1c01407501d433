"""What a spec says of its signal is what the parts of its campaign have, or it is refused."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.outcome.run_directory import read_run
from inputdesign_cli.questions.assessment.build import build_identification
from tests.support.campaigns import SPEC, applied, planned


def begin(run, tmp_path, name, *overrides):
    told = [part for one in overrides for part in ("--set", one)]
    code, _, err = run("campaign", "s.yaml", "-o", name, "--no-figures", *told)
    return tmp_path / name, code, err


def test_every_part_has_a_record_by_the_seed_of_the_spec(run, tmp_path):
    plans = {}
    for name, overrides in {"none": [], "0": ["signal.seed=0"], "1": ["signal.seed=1"]}.items():
        directory, code, _ = begin(run, tmp_path, name, *overrides)
        assert code == 0
        plans[name] = planned(directory)
    assert np.array_equal(plans["none"], plans["0"])  # as everywhere, none is 0
    assert not np.array_equal(plans["0"], plans["1"])


def test_parts_by_one_seed_are_the_same_again_and_differ_from_each_other(run, tmp_path):
    plans = []
    for name in ("a", "b"):
        directory, _, _ = begin(run, tmp_path, name, "signal.seed=6")
        assert run("next", name, applied(directory, tmp_path / "r.csv"), "--no-figures")[0] == 0
        plans.append(planned(directory))
        seeds = [entry["plan"]["seed"] for entry in read_run(directory)["campaign"]["rounds"]]
        assert len(set(seeds)) == len(seeds) == 2
    assert np.array_equal(*plans)


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
