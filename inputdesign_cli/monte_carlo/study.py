"""A Monte Carlo study: excitations tried on the true system and, where that differs, on the design model."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.monte_carlo.simulated_runs import TrialJob, run_job
from inputdesign_cli.monte_carlo.trials import Trials

# Records of outputs that are simulated and identified in one pass.
_OUTPUTS_AT_ONCE = 100


@dataclass(frozen=True)
class Study:
    """What is tried, and on what.

    Attributes:
        nominal, true: the experiment on the design model and on the true system; the same object where
            they do not differ.
        step: time between samples in the unit of the experiment's frequencies.
    """

    nominal: Experiment
    true: Experiment
    runs: int
    seed: int
    step: float


@dataclass(frozen=True)
class Tried:
    """The runs of one excitation on one system.

    Attributes:
        information: (k, k) in theory, or None if the true system has other parameters than the model.
    """

    name: str
    trials: Trials
    information: Array | None


def tried_on_truth(study: Study, excitation: Excitation, executor: Executor | None = None) -> Tried:
    """Try an excitation on the true system.

    Args:
        executor: where the batches of runs are computed (default: in this process); the result does not
            depend on it.
    """
    return _tried(study, study.true, excitation, executor)


def tried_on_model(study: Study, excitation: Excitation, executor: Executor | None = None) -> Tried | None:
    """Try the excitation on the design model; return None if that is the true system."""
    return None if study.true is study.nominal else _tried(study, study.nominal, excitation, executor)


def _tried(study: Study, experiment: Experiment, excitation: Excitation, executor: Executor | None) -> Tried:
    model = study.nominal.model
    job = TrialJob(experiment, model, excitation, study.step)
    # The same seed for every excitation: they meet the same noise.
    size = max(1, _OUTPUTS_AT_ONCE // model.outputs)
    parts = run_batches(run_job, job, runs=study.runs, size=size, seed=study.seed, executor=executor)
    same = experiment.model.names == model.names
    return Tried(excitation.name, Trials.joined(parts), excitation.information(experiment) if same else None)
