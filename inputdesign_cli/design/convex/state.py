"""The state of the exchange method, and how the solution of a finite program updates it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Cut, Violation
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.certificate import Certificate, certify
from inputdesign_cli.design.convex.demands import FEW
from inputdesign_cli.design.convex.limits import DensityBreach, DensityPlace
from inputdesign_cli.design.convex.master import PlacedCut, Proof, Row, solve_master
from inputdesign_cli.design.convex.problem import Candidate, Problem
from inputdesign_cli.design.convex.repair import Place, least_scale, mixed, scaled_up
from inputdesign_cli.spectrum import Face, first_directions

# An iterate with a larger ratio is not worth repairing: its upper bound would be useless.
_WORTH_REPAIRING = 1.5
_FIRST_CUTS = 0.3
_MORE_CUTS = 6
_HALVINGS = 6
_BINDS = 1e-5
_IDLE = 3
_SHARE_OF_GAP, _FAR_OFF = 1e-2, 1e-2
_PROGRESS = 1e-5
_MOST_ROWS = 12


@dataclass
class State:
    """Holds the state of the method: the finite program, and the best design and proof so far.

    The finite program has a face of the cone of spectra, cuts of the requirements, and rows of the limits.
    """

    problem: Problem
    face: Face
    best: Candidate
    interior: Candidate | None
    keys: list[Place]
    idle: list[int]  # rounds since each cut last bound
    cuts: list[Cut]
    rows: list[Row]
    certificate: Certificate
    active: tuple[Place, ...] = ()
    proof: Proof | None = None
    solved: tuple[Face, Array] | None = None  # the face and y of the latest finite program
    dense: bool = False  # see `finite.solve_program`

    @property
    def gap(self) -> float:
        """Return the relative distance of the best design from the proved bound."""
        return (self.best.objective - self.certificate.bound) / self.best.objective

    @property
    def placed(self) -> list[PlacedCut]:
        """Return the cuts with their scenarios."""
        asked = [self.problem.demands.asked[index] for index, _ in self.keys]
        return [PlacedCut(cut, a.scenario, a.side) for cut, a in zip(self.cuts, asked, strict=True)]

    def improve(self, tolerance: float) -> bool:
        """Solve, prove, repair and enlarge once; return False when another round cannot improve anything."""
        problem, face, best, cuts = self.problem, self.face, self.best, len(self.cuts)
        answer = solve_master(
            problem,
            self.face,
            self.placed,
            self.rows,
            self.best,
            tolerance=tolerance,
            rough=_SHARE_OF_GAP * min(self.gap, 1.0) if self.gap > _FAR_OFF else 0.0,
            keep=self.interior is not None,
            dense=self.dense,
        )
        if answer is None:
            return False
        before = (self.best.objective, self.certificate.bound)
        self.solved, self.proof = (self.face, answer.y), answer.proof
        proved = certify(problem, answer.proof, self.rows)
        moves = proved.bound > (1.0 + _PROGRESS) * self.certificate.bound
        if proved.bound > self.certificate.bound:
            self.certificate = proved
            self.active = _active(self.keys, answer.proof)
        if moves:  # else cuts with multiplier zero (a degenerate optimum) would come and go for ever
            self._prune(answer.proof)
        tried = self._informative(answer.z, answer.s)
        z, s = tried.z, tried.s
        found, breaches = self._misses(tried)
        worst = max([v.ratio for _, v in found] + [b.ratio for b in breaches], default=1.0)
        if self.interior is not None:
            self.best = min(self.best, mixed(problem, z, s, self.interior), key=lambda c: c.objective)
        elif worst <= _WORTH_REPAIRING:
            places = [(i, v.frequency) for i, v in found]
            with suppress(np.linalg.LinAlgError):  # singular on the way up: the best so far stays
                self.best = min(self.best, scaled_up(problem, z, s, places), key=lambda c: c.objective)
        self._add(_most_violated(problem, found, self.keys))
        self._add_rows(breaches)
        if problem.polytope is not None:
            facet = problem.amplitude_facet(z)[1]
            if facet.share > problem.bound_factor(True, s):
                problem.polytope.forms.append(facet.form)
                self.rows.append(form_row(problem, facet.form))
        basis, self.face = problem.basis.enlarge(self.face, answer.y, proved.directions, problem.price)
        if basis is not problem.basis:
            self._grow(problem.grown(basis))
        same = self.face is face and self.best is best and len(self.cuts) == cuts
        if same and not (moves or breaches or problem.polytope):
            return False  # the next round would solve the same program
        better = self.best.objective < 0.9 * before[0] or self.certificate.bound > 1.1 * before[1]
        return answer.converged or better

    def _misses(self, tried: Candidate) -> tuple[list[tuple[int, Violation]], list[DensityBreach]]:
        problem, s, informations = self.problem, tried.s, tried.informations
        found = problem.demands.violations(informations, above=1.0, few=FEW)
        if problem.side:
            root = np.sqrt(s)
            sides = problem.demands.violations(informations, above=1.0 / root, side=True, few=FEW)
            found += [(i, replace(v, ratio=root * v.ratio)) for i, v in sides]
        return found, problem.density_breaches(tried.z, s, above=1.0)

    def _prune(self, proof: Proof) -> None:
        """Drop the cuts that have not bound for some rounds; each costs the solver a k x k cone.

        A cut that does not bind in one round often does in the next.
        """
        weights = np.array([np.trace(cut.weight) for cut in proof.cuts])
        idle = np.where(weights > _BINDS * weights.sum(), 0, np.array(self.idle, dtype=int) + 1)
        kept = np.flatnonzero(idle < _IDLE)
        self.idle = idle[kept].tolist()
        self.keys = [self.keys[i] for i in kept]
        self.cuts = [self.cuts[i] for i in kept]
        self.proof = replace(proof, cuts=tuple(proof.cuts[i] for i in kept))

    def _informative(self, z: Array, s: float) -> Candidate:
        """Return (z, s), or halfway to the best design when z leaves some parameter without information."""
        tried = self.problem.candidate(z, s)
        if not self.problem.demands.definite:
            return tried
        for _ in range(_HALVINGS):
            with suppress(np.linalg.LinAlgError):
                np.linalg.cholesky(tried.informations)
                return tried
            tried = self.problem.candidate(0.5 * (tried.z + self.best.z), 0.5 * (tried.s + self.best.s))
        return self.best

    def _grow(self, problem: Problem) -> None:
        """Extend the state to a basis with more functions."""
        more = problem.basis.size - self.best.z.size
        self.problem = problem
        self.best = replace(self.best, z=np.pad(self.best.z, (0, more)))
        if self.interior is not None:
            self.interior = replace(self.interior, z=np.pad(self.interior.z, (0, more)))
        self.rows = [on_basis(problem, row) for row in self.rows]

    def on(self, problem: Problem) -> State:
        """Return the best design so far as a spectrum of `problem`, with the proof that holds there."""
        if self.problem.basis.size >= problem.basis.size:
            return self
        if self.solved:
            return self.moved_to(problem)
        z = np.pad(self.best.z, (0, problem.basis.size - self.best.z.size))
        return replace(self, problem=problem, best=problem.candidate(z, self.best.s))

    def least_multiple(self) -> State:
        """Return the state whose best design has the least s: an interior one exceeds its requirements."""
        if self.problem.goal != "factor":
            return self
        worst = self.problem.demands.largest(self.best.informations, default=1.0)
        best = self.problem.candidate(worst**2 * self.best.z, worst**2 * self.best.s)
        return replace(self, best=best)

    def moved_to(self, problem: Problem) -> State:
        """Return the state for a richer family of spectra: its first face comes from the prices so far."""
        assert self.solved is not None
        assert self.proof is not None
        z = np.pad(self.best.z, (0, problem.basis.size - self.best.z.size))
        rows = [on_basis(problem, row) for row in self.rows]
        proved = certify(problem, self.proof, rows[: self.proof.rows.size])
        _, face = problem.basis.enlarge(*self.solved, proved.directions, problem.price)
        best = problem.candidate(z, self.best.s)
        return replace(self, problem=problem, face=face, best=best, certificate=proved, rows=rows)

    def _add(self, keys: list[Place]) -> None:
        self.keys += keys
        self.idle += [0] * len(keys)
        self.cuts += [self.problem.demands.asked[i].requirement.cut(w) for i, w in keys]

    def _add_rows(self, breaches: list[DensityBreach]) -> None:
        most = _MOST_ROWS * self.problem.experiment.inputs
        for breach in sorted(breaches, key=lambda b: -b.ratio)[:most]:
            # Rows that nearly coincide spoil the solver's linear algebra: the new one replaces its like.
            self.rows = [row for row in self.rows if not alike(self.problem, row, breach.place)]
            self.rows.append(density_row(self.problem, breach.place))


def first_state(problem: Problem, start: Array, interior: Array | None, known: Sequence[Place]) -> State:
    """Return the state before the first round; the arguments are as in `exchange`."""
    size, inner = problem.basis.size, None
    if interior is not None:
        inner = _inner(problem, interior[:size])
        best = inner
    else:
        best = scaled_up(problem, start[:size], 0.0, [])
    state = State(
        problem=problem,
        face=problem.basis.first_face(problem.price),
        best=best,
        interior=inner,
        keys=[],
        idle=[],
        cuts=[],
        rows=power_rows(problem),
        certificate=Certificate(
            0.0,
            np.zeros_like(problem.baselines),
            np.zeros((problem.basis.size, 0)),
            np.zeros(len(problem.limits)),
        ),
    )
    state._add(list(known))
    nearly = problem.demands.violations(best.informations, above=_FIRST_CUTS, few=FEW)
    state._add(_most_violated(problem, nearly, state.keys))
    if problem.side:
        close = problem.demands.violations(best.informations / best.s, above=_FIRST_CUTS, side=True)
        state._add(_most_violated(problem, close, state.keys))
    if problem.densities:
        state.rows += first_density_rows(problem)
    if problem.polytope is not None:
        state.rows += [form_row(problem, form) for form in problem.polytope.forms]
    return state


def _inner(problem: Problem, x: Array) -> Candidate:
    """Return the interior design in (z, s), its requirements met with room where s allows that."""
    unit = problem.candidate(x, 1.0)
    if not problem.scaled:
        return unit
    ratio = problem.demands.largest(unit.informations, default=0.0)
    s = 1.2 * ratio**2 if problem.requirements else 1.2 * least_scale(problem, x)
    if problem.goal == "samples":
        s = 1.2 * scaled_up(problem, x, 1.0, []).s
    return problem.candidate(s * x, s)


def _most_violated(problem: Problem, found: list[tuple[int, Violation]], known: list[Place]) -> list[Place]:
    """Return the worst places that have no cut yet, to cut next (a flat ratio has hundreds of maxima).

    Of many scenarios only the worst few are cut: their cuts help most of the others.
    """
    most = 2 * problem.experiment.size + _MORE_CUTS
    ranked = [
        (i, v.frequency)
        for i, v in sorted(found, key=lambda item: -item[1].ratio)
        if (i, v.frequency) not in known
    ]
    worst = list(dict.fromkeys(problem.demands.asked[i].scenario for i, _ in ranked))[:FEW]
    return [place for place in ranked if problem.demands.asked[place[0]].scenario in worst][:most]


def _active(keys: list[Place], proof: Proof) -> tuple[Place, ...]:
    weights = np.array([np.trace(cut.weight) for cut in proof.cuts])
    largest_first = np.argsort(-weights, kind="stable")
    return tuple(keys[i] for i in largest_first if weights[i] > 1e-4 * weights.sum())


# Rows that nearly coincide, in frequency (of the band) and direction, spoil the solver's linear algebra.
_SAME_ROW = 3e-6
_SAME_DIRECTION = 1e-8
_MORE = 6


def power_rows(problem: Problem) -> list[Row]:
    """Return one row for each power limit."""
    pairs = zip(problem.limits, problem.limit_functionals, strict=True)
    return [
        Row(functional, limit.bound, limit.upper, limit=index)
        for index, (limit, functional) in enumerate(pairs)
    ]


def density_row(problem: Problem, place: DensityPlace) -> Row:
    """Return the row of a density limit at one frequency in one direction."""
    limit = problem.densities[place.limit]
    level = float(limit.level(np.array([place.frequency]))[0])
    return Row(problem.density_at(place), level, limit.upper, density=place)


def form_row(problem: Problem, form: NDArray[np.float64]) -> Row:
    """Return the row of a form of the lags that signals within the amplitude do not take beyond one."""
    return Row(problem.form(form), 1.0, True, form=form)


def first_density_rows(problem: Problem) -> list[Row]:
    """Return rows to begin with: spread over the band, along each channel and pair of channels."""
    w = np.linspace(*problem.experiment.band, 2 * (problem.basis.degree + 1) + _MORE)
    directions = first_directions(np.ones(problem.experiment.inputs))
    return [
        density_row(problem, DensityPlace(index, float(frequency), v))
        for index in range(len(problem.densities))
        for frequency in w
        for v in directions
    ]


def on_basis(problem: Problem, row: Row) -> Row:
    """Return the row for the basis of `problem`."""
    if row.limit is not None:
        return replace(row, functional=problem.limit_functionals[row.limit])
    if row.form is not None:
        return form_row(problem, row.form)
    assert row.density is not None
    return density_row(problem, row.density)


def alike(problem: Problem, row: Row, place: DensityPlace) -> bool:
    """Return whether the row is this limit at nearly the same frequency and direction."""
    if row.density is None or row.density.limit != place.limit:
        return False
    lo, hi = problem.experiment.band
    if abs(row.density.frequency - place.frequency) >= _SAME_ROW * (hi - lo):
        return False
    along = float(np.abs(np.vdot(row.density.direction, place.direction)))
    return along**2 > 1.0 - _SAME_DIRECTION
