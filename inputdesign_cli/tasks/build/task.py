"""The one dispatch: which kind of question a spec asks."""

from __future__ import annotations

from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.convex import build_convex
from inputdesign_cli.tasks.build.given import build_given
from inputdesign_cli.tasks.build.loop_error import build_loop_error_task
from inputdesign_cli.tasks.build.regression import build_regression_task
from inputdesign_cli.tasks.task import Task


def build_task(spec: Spec) -> Task:
    """The task of a spec; everything that can be wrong with the spec comes to light here.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    if not spec.designs:
        return build_given(spec)
    if spec.plant.kind == "regression":
        return build_regression_task(spec)
    if spec.accuracy.closed_loop_error is not None:
        return build_loop_error_task(spec)
    return build_convex(spec)
