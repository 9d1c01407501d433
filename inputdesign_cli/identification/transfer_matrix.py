"""Estimate transfer matrices in s from sampled records, with white noise of an unknown covariance.

A search begins at estimates that need no start themselves. Derivatives of inputs and outputs are had through
a state-variable filter 1 / (s + cutoff)^m, and a model with one denominator for the whole row of an output
follows by least squares ([young-jakeman-1980]; [garnier-wang-2008], Chapter 1). Entries of lower order have
its slowest poles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.kind import STEP, Extension, Kind, Mask, Parts, Starts, late_samples
from inputdesign_cli.identification.polynomials import with_entry
from inputdesign_cli.identification.records import RecordProblem, Records, shifted
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import ContinuousModel, Intersample, SampledModel
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.held import HeldEntry, integrators, polynomial_roots
from inputdesign_cli.plant.model import DELAY

# The likeliest _FOLLOWED starts after _QUICK steps are searched from. A quick search ends if ten steps lower
# -2 log likelihood by less than _IDLE. Starts within _APART squared standard deviations count as one.
_FOLLOWED, _QUICK, _IDLE, _APART = 4, 12, 0.1, 25.0
# A mode that loses less than this over the whole record is not distinguishable from an undamped one.
_LEAST_DECAY = 0.01
# A mode that decays or oscillates this many radians within a sample is a static gain to rounding.
_FASTEST = 1e4
# The least dead time, in samples: zero would make it no parameter.
_LEAST_DELAY = 1e-12
_CUTOFFS = 5  # state-variable filters that are tried
# Dead times are tried sample by sample up to _FINE samples, then in steps that grow by _GROWTH.
_FINE, _GROWTH = 20, 1.1
_SWEEPS, _MINIMA = 2, 8  # sweeps over several dead times; minima that are tried for a single one

Place = tuple[int, int]


@dataclass(frozen=True)
class TransferKind(Kind):
    """A transfer matrix in s, of inputs that are held or band-limited; see `Kind`."""

    model: ContinuousModel | SampledModel
    plant: ContinuousModel  # the model in s
    between: Intersample

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return prediction errors y - G(theta) u (N, p), and the gradient psi (k, N, p) of G(theta) u."""
        model = self.plant.at(theta)
        errors, psi = y.copy(), np.zeros((theta.size, *y.shape))
        for i, j in model.active:
            entry = model.held(i, j, self.between.sample_time)
            columns = self.between.responses(entry, u[:, j], hold=self.between.hold)
            errors[:, i] -= columns @ entry.gain
            for index, parameter in enumerate(model.parameters):
                if (i, j) in parameter.places:
                    psi[index, :, i] += columns @ entry.gradient(parameter.letter, parameter.power)
        return errors, psi

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the effect of the past of each output: a level, and the free response of its entries.

        Level and states make up for an unknown level of the input if poles are stable, but not for the ramp
        of an integrator, or nearly one. Earlier inputs that a dead time delays count as arbitrary impulses.
        """
        if not free:
            return (Start.white(np.zeros((0, samples))),) * self.model.outputs
        model = self.plant.at(theta)
        found = [[np.ones((1, samples))] for _ in range(self.model.outputs)]
        for i, j in model.active:
            a = tuple(model.denominator[i][j].tolist())
            found[i].append(_begun(a, self.between.sample_time, samples, late))
        return tuple(Start.white(np.concatenate(parts)) for parts in found)

    def in_starts(self, late: int, *, free: bool) -> Mask:
        """Return the mask of the coefficients of the denominators if the states are free."""
        return np.array([free and parameter.letter == "a" for parameter in self.model.parameters], dtype=bool)

    def start_steps(self, theta: Array, samples: int) -> Array:
        """Return small shares of the coefficients, or of their values for modes as slow as the record."""
        slowest, units = 1.0 / (samples * self.between.sample_time), []
        for parameter in self.model.parameters:
            i, j = parameter.places[0]
            units.append(slowest ** (self.plant.denominator[i][j].size - 1 - parameter.power))
        return STEP * np.maximum(np.abs(theta), units)

    def lateness(self, theta: Array) -> int:
        """Return the longest dead time in samples, rounded up."""
        return late_samples(self.plant.at(theta).memory, self.between.sample_time)

    @property
    def instants(self) -> float | None:
        """Return the time between the steps of held inputs; None for others, which make no kinks."""
        return self.between.sample_time if self.between.hold else None

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta with poles mirrored into the left half plane, off its edge and off infinity.

        Poles that are exactly zero belong to integrators, and stay. Dead times are kept positive and below
        the length of the record.
        """
        step = self.between.sample_time
        slowest, fastest = _LEAST_DECAY / (samples * step), _FASTEST / step
        out, late = theta.copy(), self.model.dead_times
        out[late] = np.clip(out[late], _LEAST_DELAY * step, (samples - 1) * step)
        groups: dict[tuple[Place, ...], list[int]] = {}
        for index, parameter in enumerate(self.model.parameters):
            if parameter.letter == "a":
                groups.setdefault(parameter.places, []).append(index)
        for every in map(np.array, groups.values()):
            columns = every[integrators(np.append(theta[every], 1.0)) :]
            poles = polynomial_roots(np.append(theta[columns], 1.0))
            if np.all(poles.real <= -slowest) and np.all(np.abs(poles) <= fastest):
                continue
            poles = poles * np.minimum(1.0, fastest / np.maximum(np.abs(poles), slowest))
            poles = -np.maximum(np.abs(poles.real), slowest) + 1j * poles.imag
            out[columns] = np.poly(poles).real[:0:-1]
        return out

    def starting_points(self, parts: Parts, given: Array | None, known: Mask | None = None) -> Starts:
        """Return the likeliest starts after a few steps from rest, and the `given` one."""
        about, parameters = Records(self, tuple(parts)), self.plant.parameters
        above = np.array([parameter.letter == "b" for parameter in parameters])
        kept = [] if known is None else [parameters[k] for k in np.flatnonzero(known)]
        held = {place: one.value for one in kept if one.letter == DELAY for place in one.places}
        made = []
        for u, y in parts:
            for theta in _starting_points(self.plant, self.between, held, u, y):
                begun = self.stabilised(theta, len(y))
                # The errors are linear in the numerators, which are zero so far.
                errors, psi = self.errors_and_gradient(begun, u, y)
                columns = psi[above].reshape(-1, y.size).T
                scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
                begun[above] = np.linalg.lstsq(columns / scale, errors.ravel(), rcond=1e-10)[0] / scale
                made.append(begun)
        begun = np.array(made)
        report_progress(Counted("starting points tried", 0, len(begun)))
        found = minimise(RecordProblem((about,) * len(begun)), begun, most=_QUICK, idle=_IDLE)
        chosen: list[Array] = []
        for run in np.argsort(found.cost, kind="stable"):
            unit = found.hessian[run] * about.y.size / max(found.cost[run], 1e-300)
            away = (found.theta[run] - theta for theta in chosen)
            if np.isfinite(found.cost[run]) and all(step @ unit @ step > _APART for step in away):
                chosen.append(found.theta[run])
        return Starts(np.array(chosen[:_FOLLOWED]).reshape(-1, begun.shape[1]), len(begun)).and_given(given)

    def extensions(self, theta: Array, *, feedback: bool) -> list[Extension]:
        """Return the extensions by a further zero in a proper entry, or by a dead time if it has none."""
        model = self.plant.at(theta)
        none = tuple((np.zeros(0),) * model.inputs for _ in range(model.outputs))
        model, larger = replace(model, delay=model.delay or none), []
        for i, j in model.active:
            above = model.numerator[i][j]
            if above.size + int(feedback) < model.denominator[i][j].size:
                more = with_entry(model.numerator, i, j, np.append(above, 0.0))
                larger.append((replace(model, numerator=more), "coefficient in the numerator"))
            shared = model.active if model.common_delay else [(i, j)]
            if not any(model.delay[o][n].size for o, n in shared):
                late = with_entry(model.delay, i, j, np.zeros(1))
                larger.append((replace(model, delay=late), "dead time or fast pole"))
        step = self.between.sample_time if self.between.hold else None
        shown = ((one if step is None else SampledModel(one, step), what) for one, what in larger)
        return [Extension.of(self.model, *one) for one in shown]


@lru_cache(maxsize=32)
def _begun(denominator: tuple[float, ...], step: float, samples: int, late: int) -> Array:
    """Return the effects (m, N) of an entry's states and of `late` unknown inputs on its output."""
    entry = HeldEntry.of(np.ones(1), np.array(denominator), step)
    impulses = np.eye(min(entry.order + late, samples), samples)
    entering = np.concatenate([impulses, np.ones((int(entry.order > 0), samples))])
    poles = np.poly(entry.transition[: entry.order, : entry.order]) if entry.order else np.ones(1)
    return filtered([1.0], poles, entering)


def _starting_points(
    model: ContinuousModel, between: Intersample, held: Mapping[Place, float], u: Array, y: Array
) -> Iterator[Array]:
    """Yield dead times and denominators (k,), numerators zero, for each cutoff, from u (N, r) and y (N, p).

    Cutoffs lie between the record's length and its step. Dead times that are not `held` are searched on a
    grid, one after the other, by the residuals of the regression of the row. A single one is also tried at
    its next best minima.
    """
    samples, step = len(y), between.sample_time
    for cutoff in np.geomspace(8.0 * np.pi / (samples * step), 0.5 * np.pi / step, _CUTOFFS):
        behind = _Filtered(model, between, u, y, float(cutoff))
        for delays in _delays(model, behind, held, _grid(samples) * step):
            theta = np.zeros(len(model.parameters))
            for index, parameter in enumerate(model.parameters):
                i, j = parameter.places[0]
                if parameter.letter == DELAY:
                    theta[index] = delays[i, j]
                elif parameter.letter == "a":
                    theta[index] = behind.denominator(i, j, delays)[parameter.power]
            yield theta


def _delays(
    model: ContinuousModel, filtered: _Filtered, held: Mapping[Place, float], grid: Array
) -> list[dict[Place, float]]:
    """Return dead times of all entries: the best on the grid, and for a single one its next best minima."""
    best = {place: held.get(place, model.dead_time(*place)) for place in model.active}
    groups = [
        p.places for p in model.parameters if p.letter == DELAY and not any(x in held for x in p.places)
    ]
    if not groups:
        return [best]
    ranked, alone = grid, len(groups) == 1
    for _ in range(1 if alone else _SWEEPS):
        for places in groups:
            outputs = {i for i, _ in places}
            tried = [best | dict.fromkeys(places, float(delay)) for delay in grid]
            left = np.array([sum(filtered.regression(i, delays)[1] for i in outputs) for delays in tried])
            padded = np.concatenate([[np.inf], left, [np.inf]])
            minima = np.flatnonzero((left <= padded[:-2]) & (left <= padded[2:]))
            ranked = grid[minima[np.argsort(left[minima])]]
            best |= dict.fromkeys(places, float(ranked[0]))
    beside = ranked[1:_MINIMA].tolist() if alone else []
    return [best, *(best | dict.fromkeys(groups[0], delay) for delay in beside)]


def _grid(samples: int) -> Array:
    """Return dead times in samples: one by one, then ever longer ones, up to a third of the record."""
    longest = max(samples // 3, 1)
    fine = np.arange(min(_FINE, longest))
    steps = 1 + int(np.log(max(longest / _FINE, 1.0)) / np.log(_GROWTH))
    far = np.rint(np.geomspace(_FINE, longest, steps)) if longest > _FINE else np.zeros(0)
    return np.concatenate([fine, far])


@dataclass
class _Filtered:
    """Derivatives of the signals of a record behind one state-variable filter, in units of its cutoff."""

    model: ContinuousModel
    between: Intersample
    u: Array
    y: Array
    cutoff: float
    _columns: dict[tuple[int, int, float], Array] = field(default_factory=dict)

    def denominator(self, output: int, input: int, delays: Mapping[Place, float]) -> Array:
        """Return the denominator of an entry, ascending in s: of the slowest poles that do not integrate."""
        own = self.model.denominator[output][input]
        zeros = integrators(own)
        below = np.append(self.regression(output, delays)[0], 1.0)
        poles = self.cutoff * np.array(sorted(polynomial_roots(below), key=abs))
        found = np.atleast_1d(np.poly(poles[zeros : own.size - 1])).real[::-1]
        return np.concatenate([np.zeros(zeros), found])

    def regression(self, output: int, delays: Mapping[Place, float]) -> tuple[Array, float]:
        """Return the denominator of a row, and the unexplained share of the power of its highest derivative.

        This derivative of the output is regressed on lower ones and on derivatives of the inputs.
        """
        places = [place for place in self.model.active if place[0] == output]
        m = max(self.model.denominator[i][j].size - 1 for i, j in places)
        y = self._derivatives(-1 - output, m, 0.0, hold=False)
        hold, above = self.between.hold, [self.model.numerator[i][j].size for i, j in places]
        parts = [
            self._derivatives(j, m, delays[i, j], hold=hold)[:, :most]
            for (i, j), most in zip(places, above, strict=True)
        ]
        matrix, target = np.column_stack([-y[:, :m], *parts]), y[:, m]
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        solution = np.linalg.lstsq(matrix / scale, target, rcond=1e-10)[0] / scale
        left = float(np.sum((target - matrix @ solution) ** 2))
        return solution[:m], left / max(float(np.sum(target**2)), 1e-300)

    def _derivatives(self, signal: int, m: int, delay: float, *, hold: bool) -> Array:
        """Return derivatives (N, m + 1) of input j >= 0 or output -1 - j, filtered by 1 / (s + 1)^m."""
        key = (signal, m, delay)
        if key not in self._columns:
            step = self.between.sample_time
            x = self.u[:, signal] if signal >= 0 else self.y[:, -1 - signal]
            chain = HeldEntry.of(np.ones(1), _power(self.cutoff, m), step, delay or None)
            low = self.between.responses(chain, x, hold=hold)[:, :m]
            late = shifted(x, int(np.rint(delay / step)), (x.size,))
            self._columns[key] = np.column_stack([low, late - low @ _power(1.0, m)[:-1]])
        return self._columns[key]


def _power(cutoff: float, order: int) -> Array:
    """Return the coefficients of (s + cutoff)^order, ascending."""
    return np.asarray(ascending.polypow([cutoff, 1.0], order), dtype=float)
