"""Estimate transfer matrices in s from sampled records, with white noise of an unknown covariance.

From each start simplified refined instrumental variables (SRIVC) iterate first, for all entries at once, then
Gauss and Newton with damping on the same equations ([young-jakeman-1980]; [garnier-wang-2008], Chapter 4; for
entries with denominators of their own [garnier-2007]).

Multiplied by a_ij / a_ij(previous) the output error of an entry is linear in its new a_ij and b_ij: a
regression on outputs and inputs filtered by s^k / a_ij(previous). What the other entries cause is taken off
the output first (back-fitting), and the noise in the regressors is kept out by instruments, the same
regressors made of the auxiliary model's output. These instruments are the gradient psi of the model's
output. All entries are updated in one weighted regression,

    theta+ = theta + (sum psi S^-1 phi^T)^-1 sum psi S^-1 e,    S = (1/N) sum e e^T .

It stands still where sum psi S^-1 e = 0, and nowhere else: at the stationary points of det S, where the steps
of Gauss and Newton end, too. The regressors phi differ from psi by noise that is uncorrelated with psi, so
that a step is asymptotically one of Gauss and Newton. From poor starts it reaches further, because it solves
equations that are linear in theta instead of descending; as nothing makes it descend, the search that follows
has the last word.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.identification.kind import Extension, Kind, Part, Starts, late_samples, shares
from inputdesign_cli.identification.minima import spread_out
from inputdesign_cli.identification.polynomials import with_entry
from inputdesign_cli.identification.problem import Point, evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.start import Start
from inputdesign_cli.identification.transfer_starts import starting_points
from inputdesign_cli.plant import ContinuousModel, Intersample, SampledModel
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.held import HeldEntry, integrators, polynomial_roots
from inputdesign_cli.plant.model import DELAY

# Of the starts made from the data, as many are followed to the end: the likeliest after the instruments that
# are not beside each other.
_FOLLOWED = 3
# Of the instruments: steps without a better point. The search that follows settles what is left; squared, in
# standard deviations.
_MOST_ITERATIONS, _PATIENCE, _LEFT = 20, 4, 1e-2
# A mode that loses less than this over the whole record is not distinguishable from one on the limit.
_LEAST_DECAY = 0.01
# A mode that decays or oscillates this many radians within a sample is a static gain to rounding.
_FASTEST = 1e4
_STEP = 1e-6
# Of a sample: a dead time of zero would be none, and no parameter.
_LEAST_DELAY = 1e-12


@dataclass(frozen=True)
class TransferKind(Kind):
    """A transfer matrix in s, of inputs that are held or band-limited; see `Kind`.

    Attributes:
        held: known dead times of entries, which starting points keep.
    """

    model: ContinuousModel
    between: Intersample
    held: Mapping[tuple[int, int], float] = field(default_factory=dict)

    @property
    def continuous(self) -> bool:
        """Return whether frequencies of the model are in rad per time unit: not behind a hold."""
        return not self.between.hold

    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""
        return shares(self.model.parameters, self.outputs)

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return y - G(theta) u (N, p), and the gradient psi (k, N, p) of G(theta) u."""
        model = self.model.at(theta)
        errors, psi = y.copy(), np.zeros((theta.size, *y.shape))
        for i, j in model.active:
            entry = self._entry(model, i, j)
            columns = self.between.responses(entry, u[:, j], hold=self.between.hold)
            errors[:, i] -= columns @ entry.gain
            for index, parameter in enumerate(model.parameters):
                if (i, j) in parameter.places:
                    psi[index, :, i] += columns @ entry.gradient(parameter.letter, parameter.power)
        return errors, psi

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """What the past of each output adds: a level, and what the states of its entries do without an input.

        A level of the input is unknown as well: level and states make it up where poles are stable, not the
        ramp that an integrator makes of it, nor nearly. Inputs before the record that come late by a dead
        time move the states, sample by sample, as if from anywhere.
        """
        if not free:
            return (Start.white(np.zeros((0, samples))),) * self.outputs
        model = self.model.at(theta)
        found = [[np.ones((1, samples))] for _ in range(self.outputs)]
        for i, j in model.active:
            a = tuple(model.denominator[i][j].tolist())
            found[i].append(_begun(a, self.between.sample_time, samples, late))
        return tuple(Start.white(np.concatenate(parts)) for parts in found)

    def in_starts(self, late: int, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of the coefficients of the denominators if the states are free."""
        return np.flatnonzero([free and parameter.letter == "a" for parameter in self.model.parameters])

    def start_step(self, theta: Array, index: int, samples: int) -> float:
        """Return a small share of the coefficient, or of that of modes as slow as the record."""
        parameter = self.model.parameters[index]
        i, j = parameter.places[0]
        slowest = 1.0 / (samples * self.between.sample_time)
        order = self.model.denominator[i][j].size - 1
        return _STEP * max(abs(float(theta[index])), slowest ** (order - parameter.power))

    def lateness(self, theta: Array) -> int:
        """Return the longest dead time in samples, rounded up."""
        return late_samples(self.model.at(theta).memory, self.between.sample_time)

    @property
    def instants(self) -> float | None:
        """Return the time between the steps of held inputs; others make no kinks."""
        return self.between.sample_time if self.between.hold else None

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """Return s^k / a through the errors of the output, for the coefficient a_k of an entry, (k, N, p).

        That is what regressors made of measured outputs have beyond those made of the model's. The errors are
        interpolated within their band, and no dead time is between them. Entries of an output with a common
        denominator share it.
        """
        model = self.model.at(theta)
        found = np.zeros((theta.size, *errors.shape))
        through: dict[tuple[int, int], NDArray[np.float64]] = {}
        for index, parameter in enumerate(model.parameters):
            if parameter.letter != "a":
                continue
            for i, j in {place[0]: place for place in parameter.places}.values():
                entry = replace(self._entry(model, i, j), delay=None)
                if (i, j) not in through:
                    through[i, j] = self.between.responses(entry, errors[:, i], hold=False)
                power = np.eye(entry.order)[parameter.power]
                found[index, :, i] = through[i, j] @ entry.row(power, 1)
        return found

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta with poles in the right half plane mirrored, and kept off its edge and off infinity.

        Poles that are exactly zero belong to integrators, and stay. Dead times are kept
        positive and below the length of the record.
        """
        step = self.between.sample_time
        slowest, fastest = _LEAST_DECAY / (samples * step), _FASTEST / step
        out, late = theta.copy(), self.model.dead_times
        out[late] = np.clip(out[late], _LEAST_DELAY * step, (samples - 1) * step)
        for every in self._denominators:
            columns = every[integrators(np.append(theta[every], 1.0)) :]
            poles = polynomial_roots(np.append(theta[columns], 1.0))
            if np.all(poles.real <= -slowest) and np.all(np.abs(poles) <= fastest):
                continue
            poles = poles * np.minimum(1.0, fastest / np.maximum(np.abs(poles), slowest))
            poles = -np.maximum(np.abs(poles.real), slowest) + 1j * poles.imag
            out[columns] = np.poly(poles).real[:0:-1]
        return out

    def starting_points(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """The likeliest after refined instrumental variables, from rest, and those from the `given` one."""
        about = Records(self, tuple(parts))
        begun = [
            self.stabilised(theta, len(y))
            for u, y in parts
            for theta in starting_points(self.model, self.between, self.held, u, y)
        ]
        made = []
        for number, theta in enumerate(begun):
            tell(Counted("starting points tried", number, len(begun)))
            made.append(refine(about, self, evaluate(about, theta)))
        refined = [made[number] for number in spread_out([point for point, _ in made], _FOLLOWED)]
        if given is not None:
            refined.append(refine(about, self, evaluate(about, about.stabilised(np.array(given)))))
        return Starts(
            np.array([point.theta for point, _ in refined]),
            np.array([steps for _, steps in refined], dtype=np.int64),
            len(made) + (given is not None),
        )

    def holding(self, known: NDArray[np.bool_]) -> TransferKind:
        """Return the kind with starting points that keep known dead times."""
        held = {
            place: parameter.value
            for parameter, fixed in zip(self.model.parameters, known, strict=True)
            for place in parameter.places
            if fixed and parameter.letter == DELAY
        }
        return replace(self, held=held)

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions by a further zero or a dead time."""
        found = []
        for larger, what in _larger(self.model.at(theta), feedback=feedback):
            (name,) = set(larger.names) - set(self.names)
            shown = SampledModel(larger, self.between.sample_time) if self.between.hold else larger
            found.append(Extension(shown, TransferKind(larger, self.between), name, what))
        return tuple(found)

    def caused(self, theta: Array, u: Array, y: Array, errors: Array, begun: Array) -> Array:
        """Return the outputs less the prediction errors, since the noise is white."""
        return y - errors

    def _entry(self, model: ContinuousModel, i: int, j: int) -> HeldEntry:
        return model.held(i, j, self.between.sample_time)

    @cached_property
    def _denominators(self) -> list[NDArray[np.int64]]:
        """Return where the coefficients of each denominator stand in theta."""
        groups: dict[tuple[tuple[int, int], ...], list[int]] = {}
        for index, parameter in enumerate(self.model.parameters):
            if parameter.letter == "a":
                groups.setdefault(parameter.places, []).append(index)
        return [np.array(indices) for indices in groups.values()]


@lru_cache(maxsize=32)
def _begun(denominator: tuple[float, ...], step: float, samples: int, late: int) -> Array:
    """Return what states of an entry, and unknown inputs over `late` samples, do to its output, (m, N)."""
    entry = HeldEntry.of(np.ones(1), np.array(denominator), step)
    impulses = np.eye(min(entry.order + late, samples), samples)
    entering = np.concatenate([impulses, np.ones((int(entry.order > 0), samples))])
    poles = np.poly(entry.transition[: entry.order, : entry.order]) if entry.order else np.ones(1)
    return filtered([1.0], poles, entering)


def refine(records: Records, kind: TransferKind, start: Point) -> tuple[Point, int]:
    """Return the likeliest point of the iteration from `start`, and how many steps were made."""
    best, point, since, steps = start, start, 0, 0
    ends = np.cumsum(records.lengths)[:-1]
    while steps < _MOST_ITERATIONS and np.isfinite(point.cost):
        noise = [kind.noise_in_regressors(point.theta, errors) for errors in np.split(point.errors, ends)]
        regressors = point.psi - np.concatenate(noise, axis=1)
        scale = np.sqrt(np.maximum(np.diag(point.hessian), 1e-300))
        matrix = point.against(regressors) / np.outer(scale, scale)
        step = np.linalg.lstsq(matrix, point.slope / scale, rcond=1e-12)[0] / scale
        point = evaluate(records, records.stabilised(point.theta + step))
        best, since = (point, 0) if point.cost < best.cost else (best, since + 1)
        steps += 1
        if since == _PATIENCE or step @ point.hessian @ step * point.errors.size < _LEFT * point.cost:
            break
    return best, steps


def _larger(model: ContinuousModel, *, feedback: bool) -> Iterator[tuple[ContinuousModel, str]]:
    """Yield models with a zero more in a proper entry, or a dead time if it has none, and its name.

    Args:
        feedback: whether u(t) depends on y(t), so that it cannot act at once.
    """
    none = tuple((np.zeros(0),) * model.inputs for _ in range(model.outputs))
    model = replace(model, delay=model.delay or none)
    for i, j in model.active:
        above = model.numerator[i][j]
        if above.size + int(feedback) < model.denominator[i][j].size:
            more = with_entry(model.numerator, i, j, np.append(above, 0.0))
            yield replace(model, numerator=more), "coefficient in the numerator"
        shared = model.active if model.common_delay else [(i, j)]
        if not any(model.delay[o][n].size for o, n in shared):
            yield replace(model, delay=with_entry(model.delay, i, j, np.zeros(1))), "dead time or fast pole"
