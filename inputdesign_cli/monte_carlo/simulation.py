"""What designs do when they are tried, over and over, on a simulated true system: one verb for all kinds."""

from __future__ import annotations

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import RegressionPlant, Spec
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.loop_error import build_loop_error_task


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
            return build_loop_error_task(spec).simulate(executor)
        if has_channels(spec):
            from inputdesign_cli.monte_carlo.channel_monte_carlo import simulate_channels

            return simulate_channels(spec, executor=executor)
        from inputdesign_cli.monte_carlo.polynomial_study import simulate_polynomial

        return simulate_polynomial(spec, executor=executor)
    except IdesignError as error:
        raise spec.place(error) from error
