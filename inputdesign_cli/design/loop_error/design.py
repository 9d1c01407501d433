"""The design for the closed-loop error: the spectrum, its proof, and its loss by the model structure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import time_is_over
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import UnfinishedDesignError, solve_design
from inputdesign_cli.design.loop_error.closed_form import error_of
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion, WeightedCovariance
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.information import PowerKind
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.spectrum import LinesBasis

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0
# Means over frequency that halving the panels moves by more than this are not trusted.
_UNSETTLED = 1e-8
# The design is solved to this share of the tolerance: its bound is compared with a value computed anew.
_MARGIN = 0.1


@dataclass(frozen=True)
class LoopInput:
    """An input: a density at the nodes of a rule, or lines with their power matrices.

    Attributes:
        frequencies: (K,) in rad/sample.
        spectrum: (K, n, n) at these frequencies.
        weights: (K,) weights of the mean over frequency; one for lines.
    """

    problem: LoopErrorProblem
    criterion: ParametricCriterion
    frequencies: Array
    spectrum: ComplexArray
    weights: Array

    @cached_property
    def information(self) -> Array:
        """Return the information matrix (k, k) for one sample."""
        return self.criterion.information(self.frequencies, self.spectrum, self.weights)

    @cached_property
    def powers(self) -> Array:
        """Return the mean tr(M_i Phi) (p,) of the limits."""
        metrics = self.problem.metrics(self.frequencies)
        return np.asarray(np.einsum("pkab,kba,k->p", metrics, self.spectrum, self.weights).real)

    def power(self, kind: PowerKind) -> Array:
        """Return the powers (n,) of the channels of a kind, due to the input."""
        R = self.problem.experiment.response(kind, self.frequencies)
        return np.asarray(np.einsum("kab,kbc,kac,k->a", R, self.spectrum, np.conj(R), self.weights).real)


@dataclass(frozen=True)
class LoopErrorDesign(LoopInput):
    """The best input, a density (asymptotic covariance) or lines (parametric), with its proof.

    Attributes:
        value, lower_bound: N E||y - y0||^2 of the requested covariance, J_o included.
        rule: nodes and weights of means over the band.
        steps: steps on the dual, or rounds of the exchange.
        noise_part: J_o, which no input changes.
        multipliers: (p,) dual variables of the limits, which define the density; None for lines.
        scale: the factor that brings this density within the limits.
        settled: relative change of the mean over frequency on halving the panels.
    """

    value: float
    lower_bound: float
    rule: Quadrature
    steps: int
    noise_part: float = 0.0
    multipliers: Array | None = None
    scale: float = 1.0
    settled: float = 0.0

    @property
    def of_lines(self) -> bool:
        """Return whether the spectrum consists of sinusoids."""
        return self.multipliers is None

    @property
    def gap(self) -> float:
        """Return the relative gap (value - lower_bound) / value."""
        return abs(self.value - self.lower_bound) / self.value

    def density(self, w: Array) -> ComplexArray:
        """Return Phi (K, n, n) at any normalised frequencies, of a design that is not `of_lines`."""
        assert self.multipliers is not None
        return self.problem.spectrum_at(w, self.multipliers, self.scale)

    @cached_property
    def white_level(self) -> float:
        """Return the level of white noise of the same total power, in the band of the design."""
        return float(self.power("input").mean() / self.rule.weights.sum())

    @cached_property
    def white(self) -> LoopInput:
        """Return this white noise."""
        density = flat(self.white_level, self.rule.nodes.size, self.problem.plant.inputs)
        return LoopInput(self.problem, self.criterion, self.rule.nodes, density, self.rule.weights)

    @property
    def white_value(self) -> float:
        """Return N E||y - y0||^2 of the requested covariance for white noise."""
        if self.of_lines:
            return self.criterion.value(self.white.information)
        error = error_of(self.problem.target(self.rule.nodes), self.white.spectrum)
        return float(error @ self.rule.weights) + self.noise_part

    def white_density(self, w: Array) -> ComplexArray:
        """Return the spectrum (K, n, n) of `white`, zero outside the band."""
        lo, hi = self.problem.band
        inside = ((w >= lo) & (w <= hi))[:, None, None]
        return np.where(inside, flat(self.white_level, w.size, self.problem.plant.inputs), 0.0)


def design_loop_error(
    problem: LoopErrorProblem, covariance: Literal["asymptotic", "parametric"], *, tolerance: float
) -> LoopErrorDesign:
    """Design the best input for the closed-loop error, [rojas-asymptotic] Section VI.

    Args:
        covariance: the covariance of the estimate in the limit of a high model order, or for the structure.
        tolerance: relative gap to be proved.

    Raises:
        SpecError: `not-identifiable`.
        InaccurateError: `gap-not-closed` or `integral-inaccurate`.
        OutOfTimeError: not even a first design was found in time.
    """
    problem.experiment.whitened(1.0)  # raises an error that names unidentifiable parameters
    criterion = problem.parametric()
    if covariance == "parametric":
        found = _parametric(problem, criterion, tolerance)
    else:
        found = _asymptotic(problem, criterion)
    if found.gap > _ALMOST * tolerance and not time_is_over():
        key = "solver.tolerance"
        message = f"the design is proved only to within {found.gap:.1e} of the optimum; {key} asks for "
        hint = f"loosen {key}, or leave out limits that hardly matter"
        raise InaccurateError.because("gap-not-closed", f"{message}{tolerance:.1e}", hint=hint, key=key)
    return found


def flat(level: float, frequencies: int, inputs: int) -> ComplexArray:
    """Return the spectrum level I at K = `frequencies` frequencies, (K, n, n)."""
    return np.broadcast_to(level * np.eye(inputs, dtype=complex), (frequencies, inputs, inputs))


def _asymptotic(problem: LoopErrorProblem, criterion: ParametricCriterion) -> LoopErrorDesign:
    design, rule, settled = problem.asymptotic()
    if settled > _UNSETTLED:
        message = f"the mean over frequency moves by {settled:.1e} when its grid is halved"
        hint = "look for poles or zeros next to the unit circle"
        raise InaccurateError.because("integral-inaccurate", message, hint=hint, key="plant")
    part = problem.model_of_noise_part()
    # The nodes carry the spectrum already scaled into its limits; the same factor serves elsewhere.
    bare = problem.spectrum_at(rule.nodes[:1], design.multipliers)
    return LoopErrorDesign(
        problem,
        criterion,
        rule.nodes,
        design.spectrum,
        rule.weights,
        design.value + part,
        min(design.lower_bound, design.value) + part,
        rule,
        design.steps,
        part,
        design.multipliers,
        float(np.trace(design.spectrum[0]).real / np.trace(bare[0]).real),
        settled,
    )


def _parametric(
    problem: LoopErrorProblem, criterion: ParametricCriterion, tolerance: float
) -> LoopErrorDesign:
    """Return the sinusoids of the least tr(W P), with a bound for every spectrum within the limits."""
    experiment, root = problem.experiment, criterion.root
    question = Question(
        experiment=experiment,
        basis=LinesBasis.anywhere(*experiment.band, experiment.inputs),
        goal="factor",
        requirements=[lambda coordinates: WeightedCovariance(coordinates.whiten_rows(root).T)],
        limits=problem.limits,
    )
    try:
        found = solve_design(question, tolerance=_MARGIN * tolerance).result
    except UnfinishedDesignError as ended:
        found = ended.design.result
    frequencies, Phi = found.basis.lines(found.x)
    weights, rule = np.ones(frequencies.size), problem.rule(1)
    value = criterion.value(criterion.information(frequencies, Phi, weights))
    bound = min(found.certificate.bound, value)
    return LoopErrorDesign(problem, criterion, frequencies, Phi, weights, value, bound, rule, found.rounds)
