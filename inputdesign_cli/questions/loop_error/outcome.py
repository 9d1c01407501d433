"""A design for the closed-loop error -> `result.json`, tables and curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error import LoopErrorDesign, LoopErrorProblem
from inputdesign_cli.design.loop_error.closed_form import power_of
from inputdesign_cli.design.loop_error.loss import LossTheory, loss_theory
from inputdesign_cli.design.loop_error.weight import adjoint
from inputdesign_cli.outcome.curves import Curves, DirectionCurves, SpectrumCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant.frequencies import graded_grid, local_maxima
from inputdesign_cli.questions.common.spectrum import hermitian_columns
from inputdesign_cli.questions.common.status import proof_status

# Frequencies of the plots, and what share of the band they reach down to.
_POINTS = 800
_LOWEST = 1e-3

Entry = dict[str, object]


@dataclass(frozen=True)
class LoopErrorTerms:
    """How the question was put, as far as its results repeat it.

    Attributes:
        law: the control law as the spec calls it.
        covariance: of the estimate, in the limit of a high model order or exact for the model structure.
        samples: of the experiment.
        tolerance: relative gap to be proved.
        cost: weights of the powers of "input", "output" and "excitation", one number or one a channel.
        grid: number of frequencies of spectrum.csv.
    """

    header: Header
    law: str
    covariance: Literal["asymptotic", "parametric"]
    samples: int
    tolerance: float
    cost: Mapping[str, Array]
    grid: int


def design_result(terms: LoopErrorTerms, design: LoopErrorDesign) -> Entry:
    """`result.json` but for the signal."""
    criterion, samples = design.criterion, terms.samples
    powers = {"input": np.diag(design.input_covariance), "output": np.diag(design.output_covariance)}
    powers["excitation"] = powers["input"]
    step = terms.header.units.sample_time
    return {
        "format": 1,
        "title": terms.header.title,
        "status": proof_status(design.gap, terms.tolerance),
        "objective": {
            "kind": "closed_loop_error",
            "value": design.value,
            "lower_bound": design.lower_bound,
            "relative_gap": design.gap,
            "any_spectrum_bound": design.lower_bound,
        },
        "cost": float(sum(np.sum(weight * powers[kind]) for kind, weight in terms.cost.items())),
        "samples": samples,
        "power": {kind: power.tolist() for kind, power in powers.items()},
        "closed_loop_error": {
            "law": terms.law,
            "covariance": terms.covariance,
            "expected": design.value / samples,
            "band": [edge / step for edge in design.problem.band],
            "noise_model_part": design.noise_part,
            "parametric": {
                "design": theory_entry(loss_theory(criterion, design.information)),
                "white": theory_entry(loss_theory(criterion, design.white.information)),
            },
            "limits": _limits(design),
        },
        "information": {
            "parameters": list(design.problem.structure.names),
            "matrix": samples * design.information,
            "covariance": np.linalg.inv(design.information) / samples,
        },
        "spectrum": _spectrum(terms, design),
        "baseline": {
            "white": {
                "value": design.white.value,
                "ratio": design.white.value / design.value,
                "power": _white_power(design),
            }
        },
        "solver": {
            "method": "exchange" if design.of_lines else "dual",
            "steps": design.steps,
            "nodes": int(design.rule.nodes.size),
            "settled": design.settled,
            "tolerance": terms.tolerance,
        },
    }


def spectrum_results(
    terms: LoopErrorTerms, design: LoopErrorDesign
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """spectrum.csv on the grid that the spec asks for, and the figures."""
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


def theory_entry(theory: LossTheory) -> Entry:
    """N E||y - y0||^2 of the model structure, and mean and sd of its root over experiments."""
    return {"value": theory.value, "loss": {"mean": theory.mean, "sd": theory.sd}}


def _white_power(design: LoopErrorDesign) -> dict[str, list[float]]:
    weights, level = design.rule.weights, design.white.level
    share = level * float(weights.sum())
    G = design.problem.plant.plant_at(design.rule.nodes)
    output = level * np.einsum("kab,kab,k->a", G, np.conj(G), weights).real
    inputs = [share] * design.problem.plant.inputs
    return {"input": inputs, "output": output.tolist(), "excitation": inputs}


def _limits(design: LoopErrorDesign) -> list[Entry]:
    rows = []
    for index, limit in enumerate(design.problem.limits):
        row: Entry = {"power": limit.kind, "max": limit.most, "attained": float(design.powers[index])}
        if limit.channel is not None:
            row["channel"] = limit.channel + 1
        if design.multipliers is not None:
            row["multiplier"] = float(design.multipliers[index])
        rows.append(row)
    return rows


def _spectrum(terms: LoopErrorTerms, design: LoopErrorDesign) -> Entry:
    unit = terms.header.units.frequency
    if design.of_lines:
        return {"type": "multisine", "frequencies": design.frequencies / unit, "masses": design.spectrum}

    def trace(w: Array) -> Array:
        return np.asarray(np.trace(design.density(w), axis1=1, axis2=2).real)

    lo, hi = design.problem.band
    grid = graded_grid(design.problem.plant.singularities, lo, hi)
    peaks, heights = local_maxima(trace, grid, trace(grid))
    entry: Entry = {"type": "pointwise", "grid": terms.grid}
    for name, w in {"peak": float(peaks[np.argmax(heights)]), "lowest": lo, "highest": hi}.items():
        matrix = design.density(np.array([w]))[0]
        entry[name] = {
            "frequency": w / unit,
            "trace": float(np.trace(matrix).real),
            "matrix": _tidy(matrix),
            "eigenvalues": np.linalg.eigvalsh(matrix),
        }
    return entry | {"loop_input": _loop_input(design.problem)}


def _loop_input(problem: LoopErrorProblem) -> Entry:
    """C S Phi_r (C S)^* at the lowest frequency: what the loop will apply there, and its matrix root."""
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
    """The real part of a matrix that is real up to rounding."""
    return matrix.real if np.abs(matrix.imag).max() <= 1e-13 * np.abs(matrix).max() else matrix
