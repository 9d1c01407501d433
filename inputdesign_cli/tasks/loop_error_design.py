"""The design for the closed-loop error: the spectrum, its proof, and what the model structure makes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.design.loop_error import ClosedLoopProblem, LineDesign, ParametricCriterion
from inputdesign_cli.design.loop_error.closed_form import error_of
from inputdesign_cli.errors import Diagnostic, InaccurateError, bad_spec
from inputdesign_cli.information.quadrature import Quadrature
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.tabulated_multisine import lines_of, masses_of_density, masses_on_record
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.loop_error_problem import build_problem

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0
# Eigenvalue of the scaled information matrix below which parameters cannot be told apart.
_SINGULAR = 1e-13
# Means over frequency that halving the panels moves by more than this are not trusted.
_UNSETTLED = 1e-8


@dataclass(frozen=True)
class ClosedLoopDesign:
    """A spectrum as a density on the nodes of a rule (asymptotic) or as lines (parametric).

    Attributes:
        value, lower_bound: N E||y - y0||^2 of the covariance that was asked for, J_o included.
        noise_part: J_o, which no input changes.
        powers: mean tr(M_i Phi) of the limits.
        settled: relative change of the mean over frequency on halving the panels.
        white_level: the flat spectrum of the same total input power.
    """

    problem: ClosedLoopProblem
    criterion: ParametricCriterion
    rule: Quadrature
    multipliers: Array | None
    scale: float
    spectrum: ComplexArray
    lines: LineDesign | None
    value: float
    lower_bound: float
    noise_part: float
    powers: Array
    white_level: float
    white_value: float
    steps: int
    settled: float

    @property
    def gap(self) -> float:
        """(value - lower_bound) / value."""
        return abs(self.value - self.lower_bound) / self.value

    def density(self, w: Array) -> ComplexArray:
        """Phi (K, n, n) of the asymptotic design at any normalised frequencies."""
        assert self.multipliers is not None
        return self.problem.spectrum_at(w, self.multipliers, self.scale)

    def masses(self, samples: int) -> ComplexArray:
        """The design on the lines of a record."""
        if self.lines is not None:
            return masses_on_record(self.lines.frequencies, self.lines.spectrum, samples)
        return masses_of_density(self.density(lines_of(samples)), samples)

    def white_masses(self, samples: int) -> ComplexArray:
        """White noise of the same total power on the lines of a record, in the band of the design."""
        w = lines_of(samples)
        lo, hi = self.problem.band
        flat = np.eye(self.problem.plant.inputs, dtype=complex) * self.white_level
        inside = (w >= lo) & (w <= hi)
        return masses_of_density(np.where(inside[:, None, None], flat, 0.0), samples)

    @property
    def information(self) -> Array:
        """M (k, k) for one sample."""
        if self.lines is not None:
            return self.lines.information
        return self.criterion.information(self.rule.nodes, self.spectrum, self.rule.weights)

    @property
    def white_information(self) -> Array:
        """M (k, k) for one sample of the white input."""
        return self.criterion.information(self.rule.nodes, self._white(), self.rule.weights)

    def covariance(self, kind: str) -> Array:
        """Covariance matrix of the signal at the input or at the output (what the input causes there)."""
        nodes, Phi, weights = self.rule.nodes, self.spectrum, self.rule.weights
        if self.lines is not None:
            nodes, Phi = self.lines.frequencies, self.lines.spectrum
            weights = np.ones(nodes.size)
        if kind == "output":
            G = self.problem.plant.plant_at(nodes)
            Phi = G @ Phi @ np.conj(np.swapaxes(G, 1, 2))
        return np.asarray(np.einsum("kab,k->ab", Phi, weights).real)

    def _white(self) -> ComplexArray:
        n = self.problem.plant.inputs
        flat = np.broadcast_to(self.white_level * np.eye(n), (self.rule.nodes.size, n, n))
        return np.asarray(flat, dtype=complex)


def design_closed_loop(spec: Spec) -> ClosedLoopDesign:
    """The best input for the closed-loop error.

    Raises:
        SpecError: see `build_problem`.
        InaccurateError: `gap-not-closed` or `integral-inaccurate`.
    """
    problem = build_problem(spec)
    criterion = problem.parametric()
    _check_identifiable(problem, criterion)
    error = spec.accuracy.closed_loop_error
    assert error is not None
    if error.covariance == "parametric":
        found = _parametric(problem, criterion, spec.solver.tolerance)
    else:
        found = _asymptotic(problem, criterion)
    if found.gap > _ALMOST * spec.solver.tolerance:
        raise InaccurateError(
            Diagnostic(
                "gap-not-closed",
                f"the design is proved only to within {found.gap:.1e} of the optimum; solver.tolerance asks "
                f"for {spec.solver.tolerance:.1e}",
                hint="loosen solver.tolerance, or leave out limits that hardly matter",
                key="solver.tolerance",
            )
        )
    return found


def _check_identifiable(problem: ClosedLoopProblem, criterion: ParametricCriterion) -> None:
    """White input tells all parameters apart, judged in coordinates where each alone has information one."""
    rule = problem.rule(1)
    n = problem.plant.inputs
    flat = np.asarray(np.broadcast_to(np.eye(n), (rule.nodes.size, n, n)), dtype=complex)
    M = criterion.information(rule.nodes, flat, rule.weights)
    size = np.sqrt(np.diag(M))
    if np.any(size == 0) or np.linalg.eigvalsh(M / np.outer(size, size))[0] < _SINGULAR:
        raise bad_spec(
            "not-identifiable",
            "white input leaves some parameters of the model indistinguishable",
            hint="lower an order, or cancel the common factor of two polynomials",
            key="plant",
        )


def _asymptotic(problem: ClosedLoopProblem, criterion: ParametricCriterion) -> ClosedLoopDesign:
    design, rule, settled = problem.asymptotic()
    if settled > _UNSETTLED:
        raise InaccurateError(
            Diagnostic(
                "integral-inaccurate",
                f"the mean over frequency moves by {settled:.1e} when its grid is halved",
                hint="look for poles or zeros next to the unit circle",
                key="plant",
            )
        )
    part = problem.model_of_noise_part()
    total = float(np.trace(design.spectrum, axis1=1, axis2=2).real @ rule.weights)
    level = total / (problem.plant.inputs * float(rule.weights.sum()))
    flat = np.asarray(np.broadcast_to(level * np.eye(problem.plant.inputs), design.spectrum.shape), complex)
    white = float(error_of(problem.target(rule.nodes), flat) @ rule.weights)
    # The nodes carry the spectrum already scaled into its limits; the same factor serves elsewhere.
    bare = problem.spectrum_at(rule.nodes[:1], design.multipliers)
    scale = float(np.trace(design.spectrum[0]).real / np.trace(bare[0]).real)
    return ClosedLoopDesign(
        problem=problem,
        criterion=criterion,
        rule=rule,
        multipliers=design.multipliers,
        scale=scale,
        spectrum=design.spectrum,
        lines=None,
        value=design.value + part,
        lower_bound=min(design.lower_bound, design.value) + part,
        noise_part=part,
        powers=design.powers,
        white_level=level,
        white_value=white + part,
        steps=design.steps,
        settled=settled,
    )


def _parametric(
    problem: ClosedLoopProblem, criterion: ParametricCriterion, tolerance: float
) -> ClosedLoopDesign:
    lines = problem.best_lines(criterion, tolerance=tolerance)
    rule = problem.rule(1)
    total = float(np.einsum("kaa->", lines.spectrum).real)
    n = problem.plant.inputs
    level = total / (n * float(rule.weights.sum()))
    flat = np.asarray(np.broadcast_to(level * np.eye(n), (rule.nodes.size, n, n)), complex)
    white = criterion.value(criterion.information(rule.nodes, flat, rule.weights))
    return ClosedLoopDesign(
        problem=problem,
        criterion=criterion,
        rule=rule,
        multipliers=None,
        scale=1.0,
        spectrum=np.zeros((0, n, n), dtype=complex),
        lines=lines,
        value=lines.value,
        lower_bound=lines.lower_bound,
        noise_part=0.0,
        powers=lines.powers,
        white_level=level,
        white_value=white,
        steps=lines.rounds,
        settled=0.0,
    )
