"""Spec -> Monte Carlo study of a polynomial model: does the experiment keep its promise on the true system?

Every run draws a new realisation of the spectrum (scaled to its power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.identification import Structure
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.comparison import Comparison, compared
from inputdesign_cli.monte_carlo.disturbance import Response
from inputdesign_cli.monte_carlo.evaluation import PredictedError
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.monte_carlo.trials import PolynomialTrials, TrialJob, joined, run_job
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal import SignalSettings
from inputdesign_cli.signal.settings import Method
from inputdesign_cli.signal.single import input_and_output
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.spectrum import FirBasis, LinesBasis
from inputdesign_cli.tasks import solve
from inputdesign_cli.tasks.build.experiment import build_cost, build_experiment
from inputdesign_cli.tasks.build.signal_settings import build_signal_settings, deviations
from inputdesign_cli.tasks.build.true_system import true_experiment

# Inputs to compare with have a flat spectrum; white noise is Gaussian.
_METHODS: dict[str, Method] = {
    "white": "filtered_noise",
    "prbs": "prbs",
    "multisine": "multisine",
    "binary": "binary",
}
# Runs that are simulated and identified in one pass.
_BATCH = 100


def simulate_polynomial(spec: Spec, *, executor: Executor | None = None) -> Results:
    """The outcome of `solve` with the study of the designed (or given) excitation added.

    Args:
        executor: where the batches of runs are computed (default: in this process).

    Raises:
        SpecError: what cannot be simulated, and all that `solve` raises.
    """
    nominal = build_experiment(spec)
    study = spec.simulation or Simulation()
    outcome = solve(spec)
    started = time.perf_counter()
    result = outcome.result
    nominal = replace(nominal, samples=int(result["samples"]))
    excitations = _excitations(spec, study, outcome)
    nominal = replace(nominal, samples=_length(excitations[0], nominal, result))
    true = true_experiment(spec, nominal, result)
    structure = Structure.of(nominal.model)

    def tried(experiment: Experiment, excitation: Excitation) -> PolynomialTrials:
        job = TrialJob(experiment, structure, nominal.model.theta, excitation)
        # The same seed for every input: they meet the same noise.
        parts = run_batches(run_job, job, runs=study.runs, size=_BATCH, seed=study.seed, executor=executor)
        return joined(parts)

    comparison = Comparison(
        spec=spec,
        study=study,
        outcome=outcome,
        nominal=nominal,
        true=true,
        excitations=excitations,
        promise=_promise(spec, outcome),
        tried=tried,
        cost=build_cost(spec),
        variance=true.model.variance,
        loop=_loop(true) if spec.closed_loop else None,
    )
    return compared(comparison, started)


def _loop(true: Experiment) -> Response:
    def caused(r: Array) -> tuple[Array, Array]:
        u, y = input_and_output(true, r[:, 0])
        return u[:, None], y[:, None]

    return Response(caused, true.loop.poles)


def _length(excitation: Excitation, nominal: Experiment, result: Mapping[str, Any]) -> int:
    if excitation.record is not None:
        return excitation.record.size
    return int(result.get("signal", {}).get("samples", nominal.samples))


def _excitations(spec: Spec, study: Simulation, outcome: Results) -> list[Excitation]:
    """The design, what `compare` names at equal power, and white noise of the power that it would need."""
    result = outcome.result
    spectrum = result["spectrum"]
    table = outcome.tables.get("signal")
    if table is None:
        raise spec.complain(
            "nothing-to-simulate",
            "no excitation is needed, so that there is no experiment to simulate",
            hint="ask for more accuracy, or give an excitation under spectrum.given",
            key="accuracy",
        )
    if study.excitation == "record" or ("coefficients" not in spectrum and "frequencies" not in spectrum):
        design = Excitation("design", record=deviations(spec, table)[:, 0])
    elif "coefficients" in spectrum:
        x = np.asarray(spectrum["coefficients"], dtype=float)
        design = Excitation("design", FirBasis(x.size - 1), x, build_signal_settings(spec))
    else:
        basis = LinesBasis(np.asarray(spectrum["frequencies"]) * spec.sample_time)
        recipe = replace(build_signal_settings(spec), method="multisine")
        design = Excitation("design", basis, np.asarray(spectrum["powers"], dtype=float), recipe)
    listed = [design]
    power = np.array([float(np.sum(result["power"]["excitation"]))])
    listed += [Excitation(name, x=power, recipe=SignalSettings(_METHODS[name])) for name in study.compare]
    needed = result.get("baseline", {}).get("white", {}).get("power", {}).get("excitation")
    if needed and result.get("objective", {}).get("kind") == "least_cost" and "white" in study.compare:
        listed.append(Excitation("white_that_suffices", x=np.array([float(needed[0])])))
    return listed


def _promise(spec: Spec, outcome: Results) -> PredictedError:
    columns = list(outcome.tables["bound"].columns.items())
    table = dict(columns)
    return PredictedError(
        w=np.asarray(columns[0][1]) * spec.sample_time,
        r_u=np.asarray(table["r_u"]),
        r_adm=None if "r_adm" not in table else np.asarray(table["r_adm"]),
        alpha=float(outcome.result["model_error"]["alpha"]),
    )
