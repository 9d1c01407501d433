"""Spec -> problem -> outcome: the only room that knows the words of the YAML and the mathematics."""

from __future__ import annotations

from pathlib import Path

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import RegressionPlant, Spec
from inputdesign_cli.tasks.analysis import analyse_given
from inputdesign_cli.tasks.assessment import Assessment
from inputdesign_cli.tasks.assessment import assess as assess_record
from inputdesign_cli.tasks.build.channel_task import build_channel_task
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.identification import build_identification
from inputdesign_cli.tasks.build.loop_error_problem import build_problem
from inputdesign_cli.tasks.build.regression_task import build_regression
from inputdesign_cli.tasks.build.simulation import build_simulation
from inputdesign_cli.tasks.build.task import build_analysis, build_task
from inputdesign_cli.tasks.channel_analysis import analyse_channels, build_channel_analysis
from inputdesign_cli.tasks.channel_design import designed_channels, solve_channels
from inputdesign_cli.tasks.design import solve_convex
from inputdesign_cli.tasks.identification import identify as identify_record
from inputdesign_cli.tasks.loop_error import solve_closed_loop_error
from inputdesign_cli.tasks.regression import solve_regression
from inputdesign_cli.tasks.result.signal_files import deviations
from inputdesign_cli.tasks.simulation import Delivered
from inputdesign_cli.tasks.simulation import simulate as simulate_experiment


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
            return solve_regression(spec)
        if spec.accuracy.closed_loop_error is not None:
            return solve_closed_loop_error(spec)
        return _designed(spec)
    except IdesignError as error:
        raise spec.place(error) from error


def _designed(spec: Spec) -> Results:
    return solve_channels(spec) if has_channels(spec) else solve_convex(spec)


def simulate(spec: Spec, *, executor: Executor | None = None) -> Results:
    """Design the experiment and try it on the true system: the outcome of `solve` with `simulation`.

    Args:
        executor: where the runs are computed, batch by batch (default: in this process); the result does
            not depend on it.

    Raises:
        SpecError: what this version does not simulate, and all that `solve` raises.
    """
    try:
        if isinstance(spec.plant, RegressionPlant):
            from inputdesign_cli.monte_carlo.regression import simulate_regression

            return simulate_regression(spec, executor=executor)
        if spec.accuracy.closed_loop_error is not None and spec.designs:
            from inputdesign_cli.monte_carlo.loop_error_study import simulate_closed_loop_error

            return simulate_closed_loop_error(spec, executor=executor)
        plan = build_simulation(spec)
        results, generator = designed_channels(spec) if spec.designs else (analyse(spec), None)
        table = results.tables.get("signal")
        record = None if table is None else deviations(spec, table)
        return simulate_experiment(plan, Delivered(results, record, generator), executor)
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
            build_regression(spec)
        elif spec.accuracy.closed_loop_error is not None:
            build_problem(spec)
        elif has_channels(spec):
            build_channel_task(spec)
        else:
            build_task(spec)
    except IdesignError as error:
        raise spec.place(error) from error


def identify(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Results:
    """Estimate the model whose structure `plant` and `noise` give from a recorded experiment.

    Raises:
        SpecError: the plant is not supported.
        DataError: the file cannot be used, or the data do not determine the parameters.
    """
    try:
        task = build_identification(spec, _designed)
        return identify_record(task, Path(data), remove_means=remove_means)
    except IdesignError as error:
        raise spec.place(error) from error


def assess(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Assessment:
    """Identify the model from a real experiment, compare what the data buy with what is asked, and top up.

    Raises:
        SpecError: nothing is asked that data could meet; see `identify` and `solve`.
        DataError: the file cannot be used.
        InfeasibleError, InaccurateError: of the top-up.
    """
    try:
        task = build_identification(spec, _designed)
        return assess_record(task, Path(data), remove_means=remove_means)
    except IdesignError as error:
        raise spec.place(error) from error
