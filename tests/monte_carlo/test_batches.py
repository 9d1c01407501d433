"""Batches of simulated runs: the same numbers on one process, on two, and on a cluster."""

import os
from functools import partial

import numpy as np
import pytest

from inputdesign_cli.compute.executor import InProcess
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.monte_carlo.batches import run_batches


def draw(job, runs, rng):
    return job * rng.standard_normal(runs)


def complain(job, runs, rng):
    raise ValueError(f"{job}: {runs}")


def end(runs, rng):
    os._exit(1)


@pytest.mark.parametrize(("runs", "size", "lengths"), [(7, 3, [3, 3, 1]), (6, 3, [3, 3]), (2, 9, [2])])
def test_runs_are_split_into_batches_with_streams_of_their_own(runs, size, lengths):
    parts = run_batches(partial(draw, 2.0), runs=runs, size=size, seed=1)
    assert [part.size for part in parts] == lengths
    for index, part in enumerate(parts):
        rng = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(index,)))
        np.testing.assert_array_equal(part, 2.0 * rng.standard_normal(part.size))


def test_children_of_a_seed_give_other_streams():
    first, second = np.random.SeedSequence(1).spawn(2)
    one, two, again = (
        run_batches(partial(draw, 1.0), runs=2, size=1, seed=s) for s in (first, second, first)
    )
    np.testing.assert_array_equal(one, again)
    assert len(np.unique(np.concatenate([*one, *two]))) == 4


def test_two_processes_give_the_numbers_of_one():
    one, two = (
        np.concatenate(run_batches(partial(draw, 1.0), runs=50, size=4, seed=3, executor=executor))
        for executor in (InProcess(), Processes(2))
    )
    np.testing.assert_array_equal(one, two)


def test_errors_of_a_batch_are_raised():
    with pytest.raises(ValueError, match="job: 4"):
        run_batches(partial(complain, "job"), runs=4, size=4, seed=0)


def test_a_batch_whose_processes_are_killed_is_said():
    with pytest.raises(IdesignError, match="a batch of 2 simulated runs has no result") as caught:
        run_batches(end, runs=2, size=2, seed=0, executor=Processes(1))
    assert caught.value.diagnostics[0].code == "worker-lost"
