"""Spec -> Monte Carlo study with several inputs and outputs: does the experiment keep its promise?

Every run draws new phases of the designed sinusoids (scaled to their power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.channel_excitations import ChannelExcitation
from inputdesign_cli.monte_carlo.channel_inputs import study_excitations
from inputdesign_cli.monte_carlo.channel_trials import ChannelTrialJob, ChannelTrials, run_channel_job
from inputdesign_cli.monte_carlo.comparison import Comparison, compared
from inputdesign_cli.monte_carlo.disturbance import Response
from inputdesign_cli.monte_carlo.evaluation import PredictedError
from inputdesign_cli.monte_carlo.trials import joined
from inputdesign_cli.plant import ChannelLoop
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import BoundCurves, Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.tasks.build.channel_requirements import build_entry_errors, unstated_errors
from inputdesign_cli.tasks.build.channel_task import with_prior
from inputdesign_cli.tasks.build.channels import build_cost, channel_experiment, frequency_unit, record_step
from inputdesign_cli.tasks.build.model_error import model_error_alpha
from inputdesign_cli.tasks.build.true_system import true_channel_experiment
from inputdesign_cli.tasks.channel_analysis import analyse_channels
from inputdesign_cli.tasks.channel_design import designed_channels
from inputdesign_cli.tasks.result.channel_curves import bound_curves_of, entry_bound_curves

# Runs that are simulated and identified in one pass.
_BATCH = 50


def simulate_channels(spec: Spec, *, executor: Executor | None = None) -> Results:
    """The outcome of `solve` with the study of the designed (or given) excitation added.

    Args:
        executor: where the batches of runs are computed (default: in this process).

    Raises:
        SpecError: what cannot be simulated, and all that `solve` raises.
    """
    study = spec.simulation or Simulation()
    outcome, drawer = designed_channels(spec) if spec.designs else (analyse_channels(spec), None)
    started = time.perf_counter()
    result = outcome.result
    nominal = replace(with_prior(spec, channel_experiment(spec)), samples=int(result["samples"]))
    excitations = study_excitations(spec, study, nominal, outcome, drawer)
    nominal = replace(nominal, samples=int(result["signal"]["samples"]))
    true = true_channel_experiment(spec, nominal, result)

    def tried(experiment: ChannelExperiment, excitation: ChannelExcitation) -> ChannelTrials:
        job = ChannelTrialJob(experiment, nominal.model, excitation, record_step(spec))
        # The same seed for every input: they meet the same noise.
        parts = run_batches(
            run_channel_job, job, runs=study.runs, size=_BATCH, seed=study.seed, executor=executor
        )
        return joined(parts)

    comparison = Comparison(
        spec=spec,
        study=study,
        outcome=outcome,
        nominal=nominal,
        true=true,
        excitations=excitations,
        promise=_promise(spec, nominal, outcome, excitations[0].information(nominal)),
        tried=tried,
        cost=build_cost(spec),
        variance=true.model.covariance,
        loop=None if true.loop is None else _response(true.loop),
    )
    return compared(comparison, started)


def _response(loop: ChannelLoop) -> Response:
    def caused(r: Array) -> tuple[Array, Array]:
        y, u = loop.signals(r, np.zeros((len(r), loop.model.outputs)))
        return u, y

    return Response(caused, loop.closed_poles)


def _promise(spec: Spec, nominal: ChannelExperiment, outcome: Results, information: Array) -> PredictedError:
    """What bound.csv says; where there is none, the r_u that the `information` gives."""
    experiment: Any = nominal
    bound = outcome.curves.get("bound")
    if bound is None:
        stated = build_entry_errors(spec, experiment)
        _, bound = bound_curves_of(spec, stated, information, None) or entry_bound_curves(
            spec, unstated_errors(spec, experiment), information, None, stated=False
        )
    unit, alpha = frequency_unit(spec), model_error_alpha(spec, experiment)
    assert isinstance(bound, BoundCurves)
    panels = bound.panels
    if len(panels) == 1 and panels[0].entry is None:  # of the norm of all entries
        (alone,) = panels
        return PredictedError(alone.frequency * unit, alone.r_u, alone.r_adm, alpha)
    admissible = [panel.r_adm for panel in panels if panel.r_adm is not None]
    return PredictedError(
        w=np.concatenate([panel.frequency for panel in panels]) * unit,
        r_u=np.concatenate([panel.r_u for panel in panels]),
        r_adm=np.concatenate(admissible) if admissible else None,
        alpha=alpha,
        entries=np.repeat([p.entry or (0, 0) for p in panels], [p.frequency.size for p in panels], axis=0),
    )
