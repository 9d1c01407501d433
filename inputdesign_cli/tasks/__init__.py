"""Spec -> problem -> outcome: the only room that knows the words of the YAML and the mathematics."""

from __future__ import annotations

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import RegressionPlant, Spec
from inputdesign_cli.tasks.analysis import analyse_given
from inputdesign_cli.tasks.assessment import assess as assess
from inputdesign_cli.tasks.build.channel_task import build_channel_task
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.loop_error import build_loop_error_task
from inputdesign_cli.tasks.build.regression import build_regression_task
from inputdesign_cli.tasks.build.task import build_analysis, build_task
from inputdesign_cli.tasks.channel_analysis import analyse_channels, build_channel_analysis
from inputdesign_cli.tasks.channel_design import solve_channels
from inputdesign_cli.tasks.design import solve_convex
from inputdesign_cli.tasks.identification import identify as identify


def solve(spec: Spec) -> Results:
    """Design the experiment that the spec asks for; a given excitation is analysed.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: no excitation meets what is asked.
        InaccurateError: the proof did not close to the accuracy that is asked.
    """
    if not spec.designs:
        return analyse(spec)
    try:
        if isinstance(spec.plant, RegressionPlant):
            return build_regression_task(spec).solve()
        if spec.accuracy.closed_loop_error is not None:
            return build_loop_error_task(spec).solve()
        return solve_channels(spec) if has_channels(spec) else solve_convex(spec)
    except IdesignError as error:
        raise spec.place(error) from error


def analyse(spec: Spec) -> Results:
    """What a given excitation buys, without designing anything.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    try:
        several = has_channels(spec) and not spec.designs
        return analyse_channels(spec) if several else analyse_given(spec)
    except IdesignError as error:
        raise spec.place(error) from error


def validate(spec: Spec) -> None:
    """Read, check and set up, but compute nothing."""
    try:
        if not spec.designs:
            build_channel_analysis(spec) if has_channels(spec) else build_analysis(spec)
        elif isinstance(spec.plant, RegressionPlant):
            build_regression_task(spec).check()
        elif spec.accuracy.closed_loop_error is not None:
            build_loop_error_task(spec).check()
        elif has_channels(spec):
            build_channel_task(spec)
        else:
            build_task(spec)
    except IdesignError as error:
        raise spec.place(error) from error
