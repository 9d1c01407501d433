"""What every kind of question answers: three verbs."""

from __future__ import annotations

from typing import Protocol

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.runs.results import Results


class Task(Protocol):
    """A question, built from a spec once (`tasks.build`); it holds objects only, never the spec.

    Errors of all verbs name the key of the spec that they concern (`errors.bad_spec` with `key`), not its
    place in a file: the dispatch adds that (`Spec.place`).
    """

    def check(self) -> None:
        """Whatever can be wrong before anything long is computed; building has checked the rest."""

    def solve(self) -> Results:
        """The answer: a design with its proof, or what a given excitation buys."""

    def simulate(self, executor: Executor | None = None) -> Results:
        """The answer, with the experiment tried many times on the true system.

        Args:
            executor: where batches of runs are computed (default: in this process).
        """
