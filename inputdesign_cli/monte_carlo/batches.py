"""Many runs of one simulated experiment, in batches that any executor may compute.

The batches and their random streams depend on the number of runs and the seed alone, not on the place or
order of computation. One process, several processes and a cluster give the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from inputdesign_cli.compute.executor import Executor, InProcess, WorkerLostError
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.errors import IdesignError

Answer = TypeVar("Answer")
Seed = int | np.random.SeedSequence


def run_batches(
    function: Callable[[int, np.random.Generator], Answer],
    *,
    runs: int,
    size: int,
    seed: Seed,
    executor: Executor | None = None,
) -> list[Answer]:
    """Return the answers of `function(count, rng)` for batches of `size` runs (the last shorter), in order.

    Args:
        function: draws its random numbers from `rng` alone; it can be pickled, with its shared data.
        seed: the seed of the streams of all batches.
        executor: where the batches are computed (default: in this process).

    Raises:
        IdesignError: `worker-lost`; otherwise the errors of `function` and the executor.
    """
    root = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
    batches = (
        (min(size, runs - start), np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, index)))
        for index, start in enumerate(range(0, runs, size))
    )
    answers: dict[int, Answer] = {}
    counted = 0
    for done in (executor or InProcess()).run(partial(_compute, function), batches):
        count, stream = done.job
        if isinstance(done.error, WorkerLostError):
            message = f"a batch of {count} simulated runs has no result: {done.error}"
            hint = "the system may have run out of memory; try fewer processes"
            raise IdesignError.because("worker-lost", message, hint) from done.error
        if done.error is not None:
            raise done.error
        assert done.answer is not None  # there is an answer or an error
        answers[stream.spawn_key[-1]] = done.answer
        counted += count
        report_progress(Counted("simulated runs", counted, runs))
    return [answers[index] for index in range(len(answers))]


def _compute(
    function: Callable[[int, np.random.Generator], Answer], batch: tuple[int, np.random.SeedSequence]
) -> Answer:
    count, stream = batch
    return function(count, np.random.default_rng(stream))
