"""The design for the closed-loop error: the spectrum, its proof, and its loss by the model structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import time_is_over
from inputdesign_cli.design.loop_error.closed_form import adjoint, error_of
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import InaccurateError, bad_spec
from inputdesign_cli.information.quadrature import Quadrature

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0
# Eigenvalue of the scaled information matrix below which parameters are not identifiable.
_SINGULAR = 1e-13
# Means over frequency that halving the panels moves by more than this are not trusted.
_UNSETTLED = 1e-8


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
        noise_part: J_o, which no input changes.
        information: (k, k) for one sample.
        powers: (p,) mean tr(M_i Phi) of the limits.
        multipliers: (p,) of the limits, which give the density at any frequency; None for lines.
        scale: that brings this density into the limits.
        rule: of means over the band.
        settled: relative change of the mean over frequency on halving the panels.
    """

    problem: LoopErrorProblem
    criterion: ParametricCriterion
    frequencies: Array
    spectrum: ComplexArray
    weights: Array
    value: float
    lower_bound: float
    noise_part: float
    information: Array
    powers: Array
    multipliers: Array | None
    scale: float
    white: WhiteInput
    rule: Quadrature
    steps: int
    settled: float

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
    """
    criterion = problem.parametric()
    _check_identifiable(problem, criterion)
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


def _check_identifiable(problem: LoopErrorProblem, criterion: ParametricCriterion) -> None:
    """Raise `SpecError` (`not-identifiable`) unless white input identifies all parameters.

    The matrix is judged in coordinates where each parameter alone has information one.
    """
    rule = problem.rule(1)
    white = flat(1.0, rule.nodes.size, problem.plant.inputs)
    M = criterion.information(rule.nodes, white, rule.weights)
    size = np.sqrt(np.diag(M))
    if np.any(size == 0) or np.linalg.eigvalsh(M / np.outer(size, size))[0] < _SINGULAR:
        raise bad_spec(
            "not-identifiable",
            "white input leaves some parameters of the model indistinguishable",
            hint="lower an order, or cancel the common factor of two polynomials",
            key="plant",
        )


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
    total = float(np.trace(design.spectrum, axis1=1, axis2=2).real @ rule.weights)
    level, white = _white(problem, total, rule)
    # The nodes carry the spectrum already scaled into its limits; the same factor serves elsewhere.
    bare = problem.spectrum_at(rule.nodes[:1], design.multipliers)
    return LoopErrorDesign(
        problem=problem,
        criterion=criterion,
        frequencies=rule.nodes,
        spectrum=design.spectrum,
        weights=rule.weights,
        value=design.value + part,
        lower_bound=min(design.lower_bound, design.value) + part,
        noise_part=part,
        information=criterion.information(rule.nodes, design.spectrum, rule.weights),
        powers=design.powers,
        multipliers=design.multipliers,
        scale=float(np.trace(design.spectrum[0]).real / np.trace(bare[0]).real),
        white=WhiteInput(
            level,
            float(error_of(problem.target(rule.nodes), white) @ rule.weights) + part,
            criterion.information(rule.nodes, white, rule.weights),
        ),
        rule=rule,
        steps=design.steps,
        settled=settled,
    )


def _parametric(
    problem: LoopErrorProblem, criterion: ParametricCriterion, tolerance: float
) -> LoopErrorDesign:
    lines = problem.best_lines(criterion, tolerance=tolerance)
    rule = problem.rule(1)
    level, white = _white(problem, float(np.einsum("kaa->", lines.spectrum).real), rule)
    information = criterion.information(rule.nodes, white, rule.weights)
    return LoopErrorDesign(
        problem=problem,
        criterion=criterion,
        frequencies=lines.frequencies,
        spectrum=lines.spectrum,
        weights=np.ones(lines.frequencies.size),
        value=lines.value,
        lower_bound=lines.lower_bound,
        noise_part=0.0,
        information=lines.information,
        powers=np.einsum("pkab,kba->p", problem.metrics(lines.frequencies), lines.spectrum).real,
        multipliers=None,
        scale=1.0,
        white=WhiteInput(level, criterion.value(information), information),
        rule=rule,
        steps=lines.rounds,
        settled=0.0,
    )


def _white(problem: LoopErrorProblem, power: float, rule: Quadrature) -> tuple[float, ComplexArray]:
    """Return the level, and the density (K, n, n) at the nodes, of white noise of this total power."""
    inputs = problem.plant.inputs
    level = power / (inputs * float(rule.weights.sum()))
    return level, flat(level, rule.nodes.size, inputs)
