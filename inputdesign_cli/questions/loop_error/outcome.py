"""Write the outcome, tables and curves of a design for the closed-loop error, and of its study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.design.loop_error import LoopErrorDesign, LoopErrorProblem
from inputdesign_cli.design.loop_error.closed_form import adjoint, power_of
from inputdesign_cli.design.loop_error.parametric import LossTheory, ParametricCriterion, loss_theory
from inputdesign_cli.information import PowerKind
from inputdesign_cli.monte_carlo.loop_error import LossStudy
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues
from inputdesign_cli.outcome import (
    Baseline,
    ClosedLoopError,
    Information,
    Objective,
    Outcome,
    Powers,
    Signal,
    Solver,
    Spectrum,
    White,
)
from inputdesign_cli.outcome.curves import Curves, DirectionCurves, LossCurves, SpectrumCurves
from inputdesign_cli.outcome.design import ActivePower, LossMoments, TheoreticalLoss
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.simulation import ExactLoss, Improvement, TriedInput
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant.frequencies import graded_grid, local_maxima
from inputdesign_cli.questions.common.delivery import proof_status
from inputdesign_cli.questions.common.spectrum import hermitian_columns
from inputdesign_cli.signal.lines import Lines

# Frequencies of the plots, and what share of the band they reach down to.
_POINTS = 800
_LOWEST = 1e-3


@dataclass(frozen=True)
class LoopErrorTerms:
    """The parts of the question that its results state.

    Attributes:
        law: the control law as the spec calls it.
        covariance: of the estimate, in the limit of a high model order or exact for the model structure.
        grid: number of frequencies of spectrum.csv.
    """

    header: Header
    law: str
    covariance: Literal["asymptotic", "parametric"]
    samples: int
    tolerance: float
    cost: Mapping[PowerKind, Weight]
    grid: int


def design_outcome(
    terms: LoopErrorTerms, design: LoopErrorDesign, signal: Signal, timing: dict[str, float]
) -> Outcome:
    """Return what result.json says of a design."""
    criterion, samples, white = design.criterion, terms.samples, design.white
    inputs, outputs = (np.diag(part).tolist() for part in (design.input_covariance, design.output_covariance))
    lo, hi = (edge / terms.header.units.sample_time for edge in design.problem.band)
    cost = weighted_sum(terms.cost, {"input": inputs, "output": outputs, "excitation": inputs})
    informations = {"design": design.information, "white": white.information}
    return Outcome(
        title=terms.header.title,
        status=proof_status(design.gap, terms.tolerance),
        objective=Objective(
            "closed_loop_error",
            design.value,
            lower_bound=design.lower_bound,
            relative_gap=design.gap,
            any_spectrum_bound=design.lower_bound,
        ),
        cost=cost,
        samples=samples,
        power=_powers(inputs, outputs),
        closed_loop_error=ClosedLoopError(
            law=terms.law,
            covariance=terms.covariance,
            expected=design.value / samples,
            band=(lo, hi),
            noise_model_part=design.noise_part,
            parametric={name: theory_of(loss_theory(criterion, M)) for name, M in informations.items()},
            limits=_limits(design),
        ),
        information=Information(
            design.problem.structure.names,
            samples * design.information,
            np.linalg.inv(design.information) / samples,
        ),
        spectrum=_spectrum(terms, design),
        baseline=Baseline(
            White(value=white.value, ratio=white.value / design.value, power=_white_power(design))
        ),
        signal=signal,
        solver=Solver(
            "exchange" if design.of_lines else "dual",
            terms.tolerance,
            details={"steps": design.steps, "nodes": int(design.rule.nodes.size), "settled": design.settled},
        ),
        timing_s=timing,
    )


def spectrum_results(
    terms: LoopErrorTerms, design: LoopErrorDesign
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """Return spectrum.csv on the grid that the spec asks for, and the figures."""
    units, (lo, hi) = terms.header.units, design.problem.band
    if design.of_lines:
        w, Phi, white = design.frequencies, design.spectrum, None
        shown, drawn = w, Phi
    else:
        w, white = np.linspace(lo, hi, terms.grid), design.white.level
        Phi = design.density(w)
        shown = np.geomspace(max(lo, _LOWEST * hi), hi, _POINTS)
        drawn = design.density(shown)
    table = Table({units.frequency_header: w / units.frequency, **hermitian_columns(Phi, "phi")})
    _, gains, right = np.linalg.svd(design.problem.plant.plant_at(shown))
    directions = adjoint(right)
    power = np.einsum("kai,kab,kbi->ki", np.conj(directions), drawn, directions).real
    frequency, lines = shown / units.frequency, design.of_lines
    return {"spectrum": table}, {
        "spectrum": SpectrumCurves(frequency, drawn, white=white, lines=lines),
        "directions": DirectionCurves(frequency, gains, power, white=white, lines=lines),
    }


def theory_of(theory: LossTheory) -> TheoreticalLoss:
    """Return N E||y - y0||^2 of the model structure, and mean and deviation of its root."""
    return TheoreticalLoss(theory.value, LossMoments(theory.mean, theory.sd))


def _white_power(design: LoopErrorDesign) -> Powers:
    """Return the powers of white noise of the same total power."""
    weights, level = design.rule.weights, design.white.level
    G = design.problem.plant.plant_at(design.rule.nodes)
    output = level * np.einsum("kab,kab,k->a", G, np.conj(G), weights).real
    return _powers([level * float(weights.sum())] * design.problem.plant.inputs, output.tolist())


def _powers(inputs: list[float], outputs: list[float]) -> Powers:
    """Return powers by channel of an experiment in open loop, where the excitation is the input."""
    return Powers(tuple(inputs), tuple(outputs), tuple(inputs))


def _limits(design: LoopErrorDesign) -> tuple[ActivePower, ...]:
    return tuple(
        ActivePower(
            limit.kind,
            limit.bound,
            float(design.powers[index]),
            channel=None if limit.channel is None else limit.channel + 1,
            multiplier=None if design.multipliers is None else float(design.multipliers[index]),
        )
        for index, limit in enumerate(design.problem.limits)
    )


def _spectrum(terms: LoopErrorTerms, design: LoopErrorDesign) -> Spectrum:
    unit = terms.header.units.frequency
    if design.of_lines:
        lines = {"frequencies": design.frequencies / unit, "masses": design.spectrum}
        return Spectrum("multisine", lines)

    def trace(w: Array) -> Array:
        return np.asarray(np.trace(design.density(w), axis1=1, axis2=2).real)

    def at(w: float) -> dict[str, object]:
        matrix = design.density(np.array([w]))[0]
        return {
            "frequency": w / unit,
            "trace": float(np.trace(matrix).real),
            "matrix": _tidy(matrix),
            "eigenvalues": np.linalg.eigvalsh(matrix),
        }

    lo, hi = design.problem.band
    grid = graded_grid(design.problem.plant.singularities, lo, hi)
    peaks, heights = local_maxima(trace, grid, trace(grid))
    shown = {"peak": float(peaks[np.argmax(heights)]), "lowest": lo, "highest": hi}
    details = {"grid": terms.grid, **{name: at(w) for name, w in shown.items()}}
    return Spectrum("pointwise", {**details, "loop_input": _loop_input(design.problem)})


def _loop_input(problem: LoopErrorProblem) -> Mapping[str, object]:
    """Return C S Phi_r (C S)^* at the lowest frequency, the input of the loop there, and its matrix root."""
    w = np.array([problem.band[0]])
    applied = np.linalg.inv(problem.plant.plant_at(w)) @ problem.law.complementary(w)
    reference = problem.entering(w) - problem.plant.disturbance_at(w)
    matrix = applied @ reference @ adjoint(applied)
    eigenvalues = np.linalg.eigvalsh(matrix[0])
    return {
        "matrix": _tidy(matrix[0]),
        "root": _tidy(power_of(matrix, 0.5)[0]),
        "root_eigenvalues": np.sqrt(np.maximum(eigenvalues, 0.0)),
    }


def _tidy(matrix: ComplexArray) -> Array | ComplexArray:
    """Return a matrix that is real up to rounding as a real one."""
    return matrix.real if np.abs(matrix.imag).max() <= 1e-13 * np.abs(matrix).max() else matrix


def loss_results(
    criterion: ParametricCriterion,
    studies: Mapping[str, LossStudy],
    inputs: Mapping[str, Lines],
    samples: int,
) -> tuple[dict[str, TriedInput], Improvement | None, dict[str, Curves]]:
    """Return what each input gave, the improvement over white noise, and the histogram where runs count."""
    theory, entries = {}, {}
    for name, lines in inputs.items():
        information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
        theory[name] = loss_theory(criterion, information)
        entries[name] = _tried(theory[name], studies[name], samples * information)
    losses = {name: study.loss for name, study in studies.items() if study.loss.size > 1}
    improvement = None
    if {"design", "white"} <= losses.keys():
        measured = 1 - float(losses["design"].mean() / losses["white"].mean())
        improvement = Improvement(measured, 1 - theory["design"].mean / theory["white"].mean)
    means = {name: theory[name].mean for name in losses}
    return entries, improvement, {"loss": LossCurves(losses, means)} if losses else {}


def _tried(theory: LossTheory, study: LossStudy, information: Array) -> TriedInput:
    several, counted = len(study.estimates) > 1, study.loss.size > 1
    return TriedInput(
        theory=theory_of(theory),
        unstable=study.unstable,
        mean_estimate=study.estimates.mean(axis=0),
        power=tuple(np.ravel(study.power).tolist()),
        covariance_eigenvalues=whitened_eigenvalues(study.estimates, information) if several else None,
        loss=_moments(study.loss) if counted else None,
        squared=_moments(study.loss**2) if counted else None,
        exact=ExactLoss(_moments(study.exact), _moments(study.exact**2)) if counted else None,
    )


def _moments(values: Array) -> LossMoments:
    sd = float(values.std(ddof=1))
    return LossMoments(float(values.mean()), sd, sd / float(np.sqrt(values.size)))
