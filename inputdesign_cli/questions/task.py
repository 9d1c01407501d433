"""Dispatch a spec to the kind of question that it asks; every kind solves and simulates.

A kind is imported when it is asked for, so that a command waits for no other.
"""

from __future__ import annotations

from typing import Protocol

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.specification import Spec


class Task(Protocol):
    """Holds a question that was built and checked.

    Errors of all verbs name the key of the spec that they concern (`errors.bad_spec` with `key`). The verbs
    add its place in a file (`Spec.place`).
    """

    def solve(self) -> Results:
        """Return a design with its proof, or the accuracy that a given excitation gives."""

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the answer of `solve`, with the experiment tried many times on the true system.

        Args:
            executor: where batches of runs are computed (default: in this process).
        """


def build_analysis(spec: Spec) -> Task:
    """Return the task of a given excitation, whatever is asked of it.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    if spec.accuracy.frequency_response is not None and not spec.designs:
        return _response(spec)
    from inputdesign_cli.questions.given.build import build_given

    return build_given(spec)


def build_task(spec: Spec) -> Task:
    """Return the task of a spec; everything that can be wrong with the spec is reported here.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    if spec.campaign is not None:
        from inputdesign_cli.questions.campaign.build import build_campaign

        return build_campaign(spec)
    if not spec.designs:
        return build_analysis(spec)
    if spec.accuracy.frequency_response is not None:
        return _response(spec)
    if spec.plant.kind == "regression":
        from inputdesign_cli.questions.regression.build import build_regression_task

        return build_regression_task(spec)
    if spec.accuracy.closed_loop_error is not None:
        from inputdesign_cli.questions.loop_error.build import build_loop_error_task

        return build_loop_error_task(spec)
    from inputdesign_cli.questions.least_cost.build import build_convex

    return build_convex(spec)


def _response(spec: Spec) -> Task:
    from inputdesign_cli.questions.frequency_response.build import build_response_task

    return build_response_task(spec)
