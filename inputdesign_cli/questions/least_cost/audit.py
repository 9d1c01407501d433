"""The last check of a design: the output, reread, is evaluated by other means before it is written.

The spectrum is that of `result.json` as text, not that of the solver. Its information comes from another
quadrature rule: four Gauss points on intervals of the grid on which peaks are sought.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev, legendre, polynomial
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement, criterion_of
from inputdesign_cli.accuracy.requirement import OverFrequency
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.demands import Scenario
from inputdesign_cli.design.convex.limits import paid_for, weights_of
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.outcome import Outcome, plain, read_plain
from inputdesign_cli.plant import graded_grid
from inputdesign_cli.questions.common.delivery import APART, check_claims, of_bounds, of_cost, of_limit
from inputdesign_cli.questions.common.robust import kept_by
from inputdesign_cli.questions.least_cost.outcome import Designed

# A plant whose largest ratio is below this is not evaluated again.
_DOUBTFUL = 0.9
_NODES_AT_ONCE = 4096
# Steps of the grid, each a fortieth of the distance to a pole, in one interval of the rule; fewer if the
# spectrum itself varies faster.
_STEPS = 4
_FAST = 200
# The highest peaks on the grid are refined, `_INSIDE` points at a time. Where r_adm meets its floor, a peak
# has a kink, so that its error is proportional to the last step.
_PEAKS, _ZOOMS, _INSIDE = 8, 4, 129
_KNOWN = ("white", "fir", "polynomial")
_TABLES = {"chebyshev": chebyshev.chebvander, "monomial": polynomial.polyvander}


@dataclass(frozen=True)
class _WrittenSpectrum:
    """Holds the spectrum of `result.json`: lines with powers, or a density by its type."""

    type: str
    frequencies: Array | None = None
    powers: ComplexArray | None = None
    power: float | None = None
    coefficients: ComplexArray | None = None
    order: int = 0
    basis: str = ""
    band: tuple[float, float] | None = None


def audit(done: Designed, outcome: Outcome, *, on_grid: bool, loose: float = 0.0) -> None:
    """Raise `InaccurateError` (`internal-disagreement`) if the written spectrum does not bear out the claims.

    Requirements that hold `on_grid` only are not checked. The value and the bounds of a `loose` proof may
    differ by this share.
    """
    remedy = "rescale the signals, restrict the band, or look for poles near the unit circle"
    check_claims(_disagreements(done, outcome, max(APART, loose), on_grid=on_grid), remedy)


def _disagreements(done: Designed, outcome: Outcome, apart: float, *, on_grid: bool) -> Iterator[str]:
    """Yield a sentence for each claim that the spectrum does not bear out."""
    claimed, problem, goal = outcome.objective, done.problem, done.question.goal
    assert claimed is not None
    assert outcome.cost is not None
    value, size = claimed.value, float(done.experiment.size) if claimed.kind == "D" else 0.0
    yield from of_bounds(claimed, apart, size)
    if outcome.status == "nothing_needed":
        return
    spectrum = read_plain(_WrittenSpectrum, plain(outcome.spectrum))
    plants = [_Reread(done, spectrum, scenario) for scenario in problem.scenarios]
    # The nominal plant, and others whose error is near the admitted one.
    kept = kept_by(problem, done.design, done.experiment.samples) if problem.others else []
    doubtful = [one for n, one in enumerate(plants) if n == 0 or kept[n].share > _DOUBTFUL]
    for reread in doubtful if not on_grid else ():
        for promised in reread.scenario.side if goal == "factor" else reread.scenario.requirements:
            ratio = reread.worst(promised)
            if not ratio <= 1.0 + APART:
                yield f"the design leaves {ratio:.6g} times the error that {promised.name} admits"
    if goal == "factor":  # the value is that of the plant at which it is worst
        if problem.demands.criterion is None:
            found, size = max(one.worst(r) for one in doubtful for r in one.scenario.requirements), value
        else:
            found, size = min(one.criterion for one in doubtful), size or abs(value)
        if not abs(found - value) <= apart * size:
            yield f"the spectrum reaches {found:.10g}, not {value:.10g}"
    weights = weights_of(done.cost)
    costs = [
        sum(w * plants[number].power(kind, channel) for kind, channel, w in weights)
        for number in problem.paying
    ]
    yield from of_cost(paid_for(problem.paid, costs), outcome.cost)
    for limit in done.question.limits:
        for number in (problem.limits[index].scenario for index in limit.everywhere(problem.limits)):
            yield from of_limit(limit, plants[number].power(limit.kind, limit.channel))


@dataclass(frozen=True)
class _Reread:
    """Evaluates the written spectrum at one plant."""

    done: Designed
    written: _WrittenSpectrum
    scenario: Scenario

    @property
    def criterion(self) -> float:
        """Return the value of the criterion that is the goal."""
        first = criterion_of(self.scenario.requirements)
        assert first is not None
        return first.value(first.level(self._information))

    def worst(self, requirement: Requirement) -> float:
        """Return the largest ratio over the band and its ends, also between the points of its grid."""
        try:
            np.linalg.cholesky(self._information)
        except np.linalg.LinAlgError:
            return np.inf
        if not isinstance(requirement, OverFrequency):
            return requirement.worst(self._information).ratio
        grid, poles = requirement.grid, requirement.poles_on_the_circle[:, None]
        beside = np.any((grid[:-1] < poles) & (poles < grid[1:]), axis=0)
        between = (0.5 * (grid[1:] + grid[:-1]))[~beside]
        w = np.sort(np.concatenate([grid, between]))
        ratios = requirement.ratios(self._information, w)
        # A resonance may be higher between two points than at both, by more than two evaluations may differ.
        padded = np.concatenate([[-np.inf], ratios, [-np.inf]])
        peaks = np.flatnonzero((ratios >= padded[:-2]) & (ratios >= padded[2:]))
        highest, found = peaks[np.argsort(-ratios[peaks])][:_PEAKS], float(np.max(ratios))
        left, right = w[np.maximum(highest - 1, 0)], w[np.minimum(highest + 1, w.size - 1)]
        for _ in range(_ZOOMS):
            inside = np.linspace(left, right, _INSIDE)
            ratios = requirement.ratios(self._information, inside.ravel()).reshape(inside.shape)
            top, rows = np.argmax(ratios, axis=0), np.arange(highest.size)
            found = max(found, float(np.max(ratios)))
            left = inside[np.maximum(top - 1, 0), rows]
            right = inside[np.minimum(top + 1, _INSIDE - 1), rows]
        return found

    @cached_property
    def _experiment(self) -> Experiment:
        """Return the experiment of the delivered length, in the coordinates of the requirements."""
        return self.scenario.experiment.with_samples(self.done.experiment.samples)

    @cached_property
    def _information(self) -> Array:
        """Return the information (k, k) of the written spectrum, of the noise, and known before."""
        experiment = self._experiment
        total = experiment.prior_information.copy()
        for w, root in self._excitation:
            total += experiment.samples * _outer(experiment.excitation_gradient(w) @ root[:, None])
        if not experiment.model.continuous:
            for w, weight in _rule(graded_grid(experiment.singularities, 0.0, np.pi), _STEPS):
                rows = experiment.noise_gradient(w) * np.sqrt(weight)[:, None, None, None]
                total += experiment.samples * _outer(rows)
        return total

    def power(self, kind: PowerKind, channel: int | None) -> float:
        """Return the power of u, y or x: of all channels, or of one."""
        rows = slice(None) if channel is None else slice(channel, channel + 1)
        return sum(
            float(np.sum(np.abs(self._experiment.response(kind, w)[:, rows] @ root) ** 2))
            for w, root in self._excitation
        )

    @cached_property
    def _excitation(self) -> list[tuple[Array, ComplexArray]]:
        """Return frequencies (n,) and roots (n, r, r) of the power at each; their powers add up."""
        entry, unit = self.written, self.done.header.units.frequency
        r = self._experiment.inputs
        if entry.frequencies is not None and entry.powers is not None:
            return [(entry.frequencies * unit, _root(entry.powers.reshape(-1, r, r)))]
        lo, hi = self._experiment.band
        if entry.band is not None:
            lo, hi = (edge * unit for edge in entry.band)
        found, known = self.done.design.result, entry.type in _KNOWN
        grid = graded_grid(self._experiment.singularities, lo, hi, knots=found.basis.knots)
        steps = min(max(_FAST // max(entry.order, 1), 1), _STEPS) if known else 1

        def density(w: Array) -> ComplexArray:
            if known:
                return _density(entry, w, (lo, hi), r)
            # A family that another package adds.
            return found.basis.density(found.x, w).reshape(-1, r, r).astype(complex)

        return [(w, _root(density(w) * weight[:, None, None])) for w, weight in _rule(grid, steps)]


def _density(entry: _WrittenSpectrum, w: Array, band: tuple[float, float], r: int) -> ComplexArray:
    """Return the density (n, r, r) that an entry of `result.json` describes, by its definition."""
    lo, hi = band
    if entry.type == "white":
        level = (entry.power or 0.0) * np.pi / ((hi - lo) * r)
        return np.broadcast_to(level * np.eye(r, dtype=complex), (w.size, r, r))
    c = np.zeros((1, r, r), dtype=complex) if entry.coefficients is None else entry.coefficients
    if entry.type == "fir":
        lags = np.exp(-1j * np.outer(w, np.arange(1, len(c))))
        later = np.tensordot(lags, c.reshape(-1, r, r)[1:], axes=1)
        return np.asarray(c.reshape(-1, r, r)[0] + later + later.conj().swapaxes(1, 2))
    m, x = entry.order, 2.0 * (w - lo) / (hi - lo) - 1.0
    norms = np.sqrt((2.0 * np.arange(m + 1) + 1.0) * np.pi / (hi - lo))
    p = legendre.legvander(x, m) * norms if entry.basis == "legendre" else _TABLES[entry.basis](x, m)
    S = c.reshape(m + 1, r, m + 1, r)
    return np.asarray(0.5 * np.einsum("na,aibj,nb->nij", p, S, p, optimize=True), dtype=complex)


def _rule(grid: Array, steps: int) -> Iterator[tuple[Array, Array]]:
    """Yield nodes and weights of (1 / pi) integral over intervals of some steps of a grid."""
    grid = np.append(grid[:-1:steps], grid[-1])
    points, weights = legendre.leggauss(4)
    half = 0.5 * np.diff(grid)
    nodes = (0.5 * (grid[1:] + grid[:-1])[:, None] + half[:, None] * points).ravel()
    scaled = (half[:, None] * weights / np.pi).ravel()
    for start in range(0, nodes.size, _NODES_AT_ONCE):
        part = slice(start, start + _NODES_AT_ONCE)
        yield nodes[part], scaled[part]


def _root(powers: ComplexArray) -> ComplexArray:
    """Return the root R (n, r, r) of powers R R^*, with their rounding below zero cut off."""
    if powers.shape[1] == 1:
        return np.sqrt(np.maximum(powers.real, 0.0)).astype(complex)
    values, vectors = np.linalg.eigh(powers)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])


def _outer(F: ComplexArray) -> NDArray[np.float64]:
    """Return the real part of the sum of F_l F_m^* over frequencies and channels: (n, k, p, r) -> (k, k)."""
    flat = np.moveaxis(F, 1, 0).reshape(F.shape[1], -1)
    return np.asarray((flat @ flat.conj().T).real)
