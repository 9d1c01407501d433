"""Spec -> Monte Carlo of a design for the closed-loop error -> outcome."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error import ClosedLoopProblem, MatrixTransfer, ParametricCriterion
from inputdesign_cli.monte_carlo.arx import ArxStudy
from inputdesign_cli.monte_carlo.loop_error import LossStudy, closed_loop_study
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.runs.results import LossCurves, Results
from inputdesign_cli.signal.tabulated_multisine import lines_of
from inputdesign_cli.specification import Simulation, Spec
from inputdesign_cli.tasks.build.loop_error_problem import KEY, true_plant
from inputdesign_cli.tasks.loop_error import loss_entry, outcome_of
from inputdesign_cli.tasks.loop_error_design import ClosedLoopDesign, design_closed_loop


def simulate_closed_loop_error(spec: Spec, *, executor: Executor | None = None) -> Results:
    """The outcome of the design with the entry `simulation` and the histogram of the loss.

    Raises:
        SpecError: `not-supported` for true systems that are not ARX, or minimum-variance control.
    """
    started = time.perf_counter()
    simulation = spec.simulation or Simulation()
    design = design_closed_loop(spec)
    truth, target = _truth(spec, design)
    designed = time.perf_counter()
    outcome = outcome_of(spec, design, design_seconds=designed - started)
    begun = time.perf_counter()
    samples = spec.experiment.samples
    inputs = {"design": design.masses(samples)}
    if "white" in simulation.compare:
        inputs["white"] = design.white_masses(samples)
    studies = closed_loop_study(
        truth,
        target,
        inputs,
        samples=samples,
        runs=simulation.runs,
        seed=simulation.seed,
        executor=executor,
    )
    criterion = truth.parametric()
    entries = {name: _entry(criterion, studies[name], masses, samples) for name, masses in inputs.items()}
    result = dict(outcome.result)
    result["simulation"] = {
        "runs": simulation.runs,
        "seed": simulation.seed,
        "samples": samples,
        "parameters": list(truth.plant.names),
        "inputs": entries,
        **_improvement(entries),
    }
    result["timing_s"] = {**result["timing_s"], "simulation": time.perf_counter() - begun}
    losses = {name: study.loss for name, study in studies.items() if study.loss.size > 1}
    curves = dict(outcome.curves)
    if losses:
        theory = {name: entries[name]["theory"]["loss"]["mean"] for name in losses}
        curves["loss"] = LossCurves(losses, theory)
    return replace(outcome, result=result, curves=curves)


def _truth(spec: Spec, design: ClosedLoopDesign) -> tuple[ClosedLoopProblem, MatrixTransfer]:
    for name in spec.simulation.compare if spec.simulation else ():
        if name != "white":
            raise spec.complain(
                "not-supported",
                f"this version compares the design with white noise, not with {name}",
                hint="write compare: [white]",
                key="simulation.compare",
            )
    law = design.problem.law
    target = getattr(law, "target", None)
    if not isinstance(target, MatrixTransfer):
        raise spec.complain(
            "not-supported",
            "this version simulates model-reference and internal-model control only",
            hint="run idesign solve, which computes what theory expects",
            key=f"{KEY}.control.minimum_variance",
        )
    plant = true_plant(spec, design.problem.plant)
    if not ArxStudy.fits(plant):
        raise spec.complain(
            "not-supported",
            "this version identifies by least squares, so the true system must be of the form A y = B u + e",
            hint="write A and B only, and simulation.noise: {variance: ..}",
            key="simulation.noise" if spec.simulation and spec.simulation.noise else "plant",
        )
    return replace(design.problem, plant=plant), target


def _entry(
    criterion: ParametricCriterion, study: LossStudy, masses: ComplexArray, samples: int
) -> dict[str, Any]:
    information = criterion.information(lines_of(samples), masses, np.ones(samples // 2 + 1))
    covariance = np.linalg.inv(information) / samples
    # Deviations of the estimates in coordinates where theory says they have covariance I.
    deviations = study.estimates - study.estimates.mean(axis=0)
    white = np.linalg.solve(np.linalg.cholesky(covariance), deviations.T)
    runs = study.estimates.shape[0]
    entry: dict[str, Any] = {
        "theory": loss_entry(criterion, information),
        "unstable": study.unstable,
        "mean_estimate": study.estimates.mean(axis=0),
        "power": study.power,
    }
    if runs > 1:
        entry["covariance_eigenvalues"] = np.linalg.eigvalsh(white @ white.T / (runs - 1))
    if study.loss.size > 1:
        entry |= {
            "loss": _moments(study.loss),
            "squared": _moments(study.loss**2),
            "exact": {"loss": _moments(study.exact), "squared": _moments(study.exact**2)},
        }
    return entry


def _moments(values: Array) -> dict[str, float]:
    sd = float(values.std(ddof=1))
    return {"mean": float(values.mean()), "sd": sd, "standard_error": sd / float(np.sqrt(values.size))}


def _improvement(entries: dict[str, Any]) -> dict[str, Any]:
    """How much less the design loses than white noise, as the paper states it."""
    design, white = entries["design"], entries.get("white", {})
    if "loss" not in design or "loss" not in white:
        return {}

    def saved(kind: str) -> float:
        if kind == "theory":
            return 1 - design["theory"]["loss"]["mean"] / white["theory"]["loss"]["mean"]
        return 1 - design["loss"]["mean"] / white["loss"]["mean"]

    return {"improvement": {"measured": saved("measured"), "theory": saved("theory")}}
