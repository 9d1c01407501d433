"""`idesign simulate`."""

from __future__ import annotations

from inputdesign_cli.cli.options import Figures, Json, Output, Overrides, Quiet, SpecFile
from inputdesign_cli.cli.run import produce
from inputdesign_cli.cli.workers import ClusterAddress, Jobs, executor


def simulate(
    spec: SpecFile,
    overrides: Overrides = None,
    output: Output = None,
    jobs: Jobs = 1,
    cluster: ClusterAddress = None,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Try the designed experiment on the true system, many times.

    Designs as `solve` does, runs the experiment as often as `simulation.runs` says, each time with new
    noise, and adds to the run directory of `solve` what the models did; prints a summary.
    The runs go in batches, each with a seed of its own: the result is the same wherever they are computed.
    """
    produce(
        "simulate",
        spec,
        overrides,
        output,
        figures=figures,
        json_output=json_output,
        quiet=quiet,
        executor=executor(jobs, cluster),
    )
