"""A sweep from Python: a table that a notebook can plot."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.figures.sweep_table import read_sweep
from inputdesign_cli.questions import Verb
from inputdesign_cli.specification import Spec
from inputdesign_cli.sweeps.grid import Settings
from inputdesign_cli.sweeps.plan import build_plan
from inputdesign_cli.sweeps.running import SweepRun

if TYPE_CHECKING:
    from pandas import DataFrame


def sweep(
    spec: Spec | str | os.PathLike[str],
    settings: Settings | str = (),
    *,
    directory: str | os.PathLike[str] | None = None,
    zipped: bool = False,
    verb: Verb = "solve",
    executor: Executor | None = None,
    overwrite: bool = False,
) -> DataFrame:
    """Run a verb at every point of a grid and return a table: one row a point, failures included.

    The columns are as in sweep.csv: the keys that are varied, `status`, and the numbers of the results
    under their paths in `result.json`.

    Args:
        spec: the name of its file, or a spec.
        settings: `{"experiment.samples": [250, 500]}` in place of the spec's `sweep` block, or texts as
            `--set` takes them: `["experiment.samples=250,500"]`.
        directory: where the runs, the table and the figures are kept, so that a later call goes on with them
            (default: nowhere).
        zipped: whether values are taken side by side, not in every combination.
        verb: solve, analyse or simulate.
        executor: where the points are computed (default: in this process).
        overwrite: whether to replace the table of another sweep.

    Raises:
        SpecError, OutputError: before anything is computed; later OutputError only.
    """
    import pandas

    text = spec.to_yaml() if isinstance(spec, Spec) else None
    file = spec.resolve_path("<spec>") if isinstance(spec, Spec) else Path(spec)
    with TemporaryDirectory(prefix="idesign-") if directory is None else nullcontext(directory) as kept:
        varied = [settings] if isinstance(settings, str) else settings
        plan = build_plan(file, varied, zipped=zipped, verb=verb, text=text)
        SweepRun(plan, Path(kept), executor, overwrite=overwrite).run()
        table = read_sweep(Path(kept))
    # A folder that is gone holds no runs.
    kept_names = (name for name in table.columns if directory is not None or name != "run")
    return pandas.DataFrame({name: table[name] for name in kept_names})
