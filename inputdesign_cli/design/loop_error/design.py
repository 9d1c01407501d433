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
from inputdesign_cli.design.loop_error.closed_form import adjoint, error_of
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion, WeightedCovariance
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import InaccurateError, bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.spectrum import LinesBasis

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0
# Eigenvalue of the scaled information matrix below which parameters are not identifiable.
_SINGULAR = 1e-13
# Means over frequency that halving the panels moves by more than this are not trusted.
_UNSETTLED = 1e-8
# Beyond what is asked: the bound is compared with a value that is computed anew.
_MARGIN = 0.1


@dataclass(frozen=True)
class WhiteInput:
    """White noise of the same total power, in the band of the design.

    Attributes:
        level: of its flat spectrum.
        value: N E||y - y0||^2 of the requested covariance.
        information: (k, k) for one sample.
    """

    level: float
    value: float
    information: Array


@dataclass(frozen=True)
class LoopErrorDesign:
    """A spectrum: a density at the nodes of a rule (asymptotic covariance) or lines (parametric).

    Attributes:
        frequencies: (K,) nodes of the rule, or lines, in rad/sample.
        spectrum: (K, n, n) density there, or power matrices of the lines.
        weights: (K,) with which a sum over them is a mean over frequency; one for lines.
        value, lower_bound: N E||y - y0||^2 of the requested covariance, J_o included.
        rule: of means over the band.
        steps: of the dual, or rounds of the exchange.
        noise_part: J_o, which no input changes.
        multipliers: (p,) of the limits, which give the density at any frequency; None for lines.
        scale: that brings this density into the limits.
        settled: relative change of the mean over frequency on halving the panels.
    """

    problem: LoopErrorProblem
    criterion: ParametricCriterion
    frequencies: Array
    spectrum: ComplexArray
    weights: Array
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

    def white_density(self, w: Array) -> ComplexArray:
        """Return the spectrum (K, n, n) of `white`, zero outside the band."""
        lo, hi = self.problem.band
        inside = ((w >= lo) & (w <= hi))[:, None, None]
        return np.where(inside, flat(self.white.level, w.size, self.problem.plant.inputs), 0.0)

    @cached_property
    def information(self) -> Array:
        """Return the information matrix (k, k) for one sample."""
        return self.criterion.information(self.frequencies, self.spectrum, self.weights)

    @cached_property
    def powers(self) -> Array:
        """Return the mean tr(M_i Phi) (p,) of the limits."""
        metrics = self.problem.metrics(self.frequencies)
        return np.asarray(np.einsum("pkab,kba,k->p", metrics, self.spectrum, self.weights).real)

    @cached_property
    def white(self) -> WhiteInput:
        """Return white noise of the same total power."""
        rule, inputs = self.rule, self.problem.plant.inputs
        level = float(np.trace(self.input_covariance)) / (inputs * float(rule.weights.sum()))
        density = flat(level, rule.nodes.size, inputs)
        information = self.criterion.information(rule.nodes, density, rule.weights)
        if self.of_lines:
            return WhiteInput(level, self.criterion.value(information), information)
        error = float(error_of(self.problem.target(rule.nodes), density) @ rule.weights)
        return WhiteInput(level, error + self.noise_part, information)

    @property
    def input_covariance(self) -> Array:
        """Return the covariance (n, n) of the input."""
        return np.asarray(np.einsum("kab,k->ab", self.spectrum, self.weights).real)

    @property
    def output_covariance(self) -> Array:
        """Return the covariance (n, n) of the output due to the input."""
        G = self.problem.plant.plant_at(self.frequencies)
        return np.asarray(np.einsum("kab,k->ab", G @ self.spectrum @ adjoint(G), self.weights).real)


def design_loop_error(
    problem: LoopErrorProblem, covariance: Literal["asymptotic", "parametric"], *, tolerance: float
) -> LoopErrorDesign:
    """Design the best input for the closed-loop error, [rojas-asymptotic] Section VI.

    Args:
        covariance: of the estimate, in the limit of a high model order or exact for the model structure.
        tolerance: relative gap to be proved.

    Raises:
        SpecError: `not-identifiable`.
        InaccurateError: `gap-not-closed` or `integral-inaccurate`.
        OutOfTimeError: not even a first design was found in time.
    """
    criterion, rule = problem.parametric(), problem.rule(1)
    # White input must identify all parameters, in coordinates where each alone has information one.
    M = criterion.information(rule.nodes, flat(1.0, rule.nodes.size, problem.plant.inputs), rule.weights)
    size = np.sqrt(np.diag(M))
    if np.any(size == 0) or np.linalg.eigvalsh(M / np.outer(size, size))[0] < _SINGULAR:
        message = "white input leaves some parameters of the model indistinguishable"
        hint = "lower an order, or cancel the common factor of two polynomials"
        raise bad_spec("not-identifiable", message, hint=hint, key="plant")
    if covariance == "parametric":
        found = _parametric(problem, criterion, tolerance)
    else:
        found = _asymptotic(problem, criterion)
    if found.gap > _ALMOST * tolerance and not time_is_over():
        raise InaccurateError.because(
            "gap-not-closed",
            f"the design is proved only to within {found.gap:.1e} of the optimum; solver.tolerance asks "
            f"for {tolerance:.1e}",
            hint="loosen solver.tolerance, or leave out limits that hardly matter",
            key="solver.tolerance",
        )
    return found


def flat(level: float, frequencies: int, inputs: int) -> ComplexArray:
    """Return the spectrum level I at K = `frequencies` frequencies, (K, n, n)."""
    return np.broadcast_to(level * np.eye(inputs, dtype=complex), (frequencies, inputs, inputs))


def _asymptotic(problem: LoopErrorProblem, criterion: ParametricCriterion) -> LoopErrorDesign:
    design, rule, settled = problem.asymptotic()
    if settled > _UNSETTLED:
        raise InaccurateError.because(
            "integral-inaccurate",
            f"the mean over frequency moves by {settled:.1e} when its grid is halved",
            hint="look for poles or zeros next to the unit circle",
            key="plant",
        )
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
        noise_part=part,
        multipliers=design.multipliers,
        scale=float(np.trace(design.spectrum[0]).real / np.trace(bare[0]).real),
        settled=settled,
    )


def _parametric(
    problem: LoopErrorProblem, criterion: ParametricCriterion, tolerance: float
) -> LoopErrorDesign:
    """Return the sinusoids of the least tr(W P), with a bound for every spectrum within the limits."""
    experiment, root = Experiment(problem.structure, 1, problem.band), criterion.root
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
    weights = np.ones(frequencies.size)
    value = criterion.value(criterion.information(frequencies, Phi, weights))
    bound, rule = min(found.certificate.bound, value), problem.rule(1)
    return LoopErrorDesign(problem, criterion, frequencies, Phi, weights, value, bound, rule, found.rounds)
