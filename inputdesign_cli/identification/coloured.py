"""Estimate models with additional coloured noise, or with drift: see `plant.coloured`.

The records belong to the plant. Their prediction errors, and all that depends on them, go through
D (1 - q^-1) / C. Starts of the plant are made from differences if the noise drifts. Starts of C and D are
made from the residuals of the plant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.extensions import Extension
from inputdesign_cli.identification.kind import Kind, Part, Starts
from inputdesign_cli.identification.noise_first import late_echo
from inputdesign_cli.identification.of_model import OfModel, OverRecord
from inputdesign_cli.identification.records import Record, Records
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.identification.start import Start, density, differences, noise_before
from inputdesign_cli.identification.starts import noise_polynomials
from inputdesign_cli.identification.white import Echoes
from inputdesign_cli.plant import Coloured
from inputdesign_cli.plant.filtering import filtered

_STEP = 1e-6


@dataclass(frozen=True)
class ColouredRecord(OverRecord):
    """A record of the plant against parameters (k,) of plant, C and D; see `Record`."""

    structure: Coloured

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.structure.parameters)

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p)."""
        model = self.structure.at(theta)
        raw, of_plant = self.record.errors_and_gradient(self._of_plant(theta))
        errors, psi = np.empty(raw.shape), np.zeros((self.size, *raw.shape))
        for i, (above, below) in enumerate(model.inverse_filters):
            errors[:, i] = filtered(above, below, raw[:, i])
            psi[: len(of_plant), :, i] = filtered(above, below, of_plant[:, :, i])
        for index, parameter in enumerate(model.own_parameters, start=len(of_plant)):
            for i, _ in parameter.places:
                polynomial, sign = model.below(parameter.letter, i)
                if polynomial is not None and parameter.power < len(errors):
                    late = filtered([sign], polynomial, errors[:, i])
                    psi[index, parameter.power :, i] = late[: len(errors) - parameter.power]
        return errors, psi

    def starts(self, theta: Array, *, free: bool) -> tuple[Start, ...]:
        """Return the starts of the plant, filtered, and the effect of noise before the record through C/D."""
        return self._through(theta, self.record.starts(self._of_plant(theta), free=free))

    def _through(self, theta: Array, raw: Sequence[Start]) -> tuple[Start, ...]:
        """Return the starts of the plant filtered, with noise before the record."""
        found = []
        for start, (D, C) in zip(raw, self.structure.at(theta).inverse_filters, strict=True):
            through, noise = (filtered(D, C, x) for x in (start.free, start.noise))
            past = np.concatenate([noise, noise_before(C, D, len(self.y))])
            zeros = start.zeros + density(C) if C.size > 1 else start.zeros
            found.append(Start(through, start.disturbance, past, zeros))
        return tuple(found)

    def lateness(self, theta: Array) -> int:
        """Return the lateness of the plant's record."""
        return self.record.lateness(self._of_plant(theta))

    def in_starts(self, *, free: bool) -> NDArray[np.int64]:
        """Return the parameters on which the starts depend: in the plant, and all of C and D."""
        own = np.arange(len(self.structure.plant.parameters), self.size)
        return np.concatenate([self.record.in_starts(free=free), own])

    def start_slopes(self, theta: Array, indices: Sequence[int], *, free: bool) -> list[tuple[Start, ...]]:
        """Return the derivatives of the starts: of C and D by central differences."""
        plant, of_plant = self._of_plant(theta), len(self.structure.plant.parameters)
        filters = self.structure.at(theta).inverse_filters
        found: dict[int, tuple[Start, ...]] = {}
        moving = [index for index in indices if index < of_plant]
        slopes = self.record.start_slopes(plant, moving, free=free) if moving else []
        for index, starts in zip(moving, slopes, strict=True):
            own = []
            for start, (D, C) in zip(starts, filters, strict=True):
                through, noise = (filtered(D, C, x) for x in (start.free, start.noise))
                none = np.zeros((max(D.size, C.size) - 1, len(self.y)))
                own.append(Start(through, start.disturbance, np.concatenate([noise, none]), start.zeros))
            found[index] = tuple(own)
        raw = self.record.starts(plant, free=free) if len(moving) < len(indices) else ()
        for index in indices:
            if index >= of_plant:
                step = _STEP * np.eye(self.size)[index]
                above, below = (self._through(theta + sign * step, raw) for sign in (1.0, -1.0))
                found[index] = differences(above, below, 2.0 * _STEP)
        return [found[index] for index in indices]

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """Return zeros (k, N, p): no instruments are used."""
        return np.zeros((self.size, *errors.shape))

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals (N, m) through the inverse of each output's noise model (p, N, m)."""
        raw = self.record.whitened(self._of_plant(theta), signals)
        filters = self.structure.at(theta).inverse_filters
        return np.array([filtered(*own, x, axis=0) for own, x in zip(filters, raw, strict=True)])

    def stabilised(self, theta: Array) -> Array:
        """Return theta with a stable predictor."""
        first = len(self.structure.plant.parameters)
        out = theta.copy()
        out[:first] = self.record.stabilised(theta[:first])
        for columns in self._monic:
            monic = np.concatenate([[1.0], theta[columns]])
            if not is_stable(monic[None])[0]:
                out[columns] = reflected(monic)[1:]
        return out

    @cached_property
    def _monic(self) -> list[NDArray[np.int64]]:
        """Return where the coefficients of each C, and of each D that is estimated, stand in theta."""
        groups: dict[tuple[str, tuple[tuple[int, int], ...]], list[int]] = {}
        for index, parameter in enumerate(self.structure.parameters):
            own = index >= len(self.structure.plant.parameters)
            if own and self.structure.below(parameter.letter, parameter.places[0][0])[0] is not None:
                groups.setdefault((parameter.letter, parameter.places), []).append(index)
        return [np.array(indices) for indices in groups.values()]

    def _of_plant(self, theta: Array) -> Array:
        return theta[: len(self.structure.plant.parameters)]


@dataclass(frozen=True)
class ColouredKind(OfModel):
    """The structure of `model`; that of its plant is `plant`; see `Kind`."""

    model: Coloured
    plant: Kind

    @property
    def recent(self) -> int:
        """Return the lag up to which the structure looks at the inputs."""
        return self.plant.recent

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return `explaining` of the plant, with False for C and D (k,)."""
        return np.concatenate([self.plant.explaining, np.zeros(self._own, dtype=bool)])

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return `whitening` of the plant, with True for C and D (k,)."""
        return np.concatenate([self.plant.whitening, np.ones(self._own, dtype=bool)])

    @property
    def _own(self) -> int:
        return len(self.model.own_parameters)

    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""
        taken = self.plant.own()
        for parameter in self.model.own_parameters:
            rows = [i for i, _ in parameter.places]
            taken[rows] += 1.0 / len(rows)
        return taken

    def record(self, u: Array, y: Array) -> ColouredRecord:
        """Return the record of samples u (N, r), y (N, p) that the structure is to explain."""
        return ColouredRecord(self.plant.record(u, y), self.model)

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return the echoes of C and D, or None if the plant has its own: filtered, they are not known."""
        model, first = self.model.at(theta), len(self.model.plant.parameters)
        if self.plant.echoes(theta[:first], lengths) != ():
            return None
        found = []
        for index, one in enumerate(model.own_parameters, start=first):
            filters = {i: model.below(one.letter, i) for i, _ in one.places}
            known = {i: (below, sign) for i, (below, sign) in filters.items() if below is not None}
            found.append((index, late_echo(known, one.power, lengths)))
        return tuple(found)

    def starts(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Return the starts of the plant, each with C and D from its residuals, and the `given` one."""
        first = len(self.model.plant.parameters)
        known = reduce(np.convolve, {tuple(p): p for p in self.model.fixed}.values())
        found = self.plant.starts(
            [(_clear(known, u), _clear(known, y)) for u, y in parts], None if given is None else given[:first]
        )
        points = [np.concatenate([theta, self._noise(parts, theta)]) for theta in found.points]
        listed = [given] if given is not None else []
        return Starts(
            np.array([*listed, *points]),
            np.append(np.zeros(len(listed), dtype=np.int64), found.steps),
            found.tried + len(listed),
        )

    def _noise(self, parts: Sequence[Part], theta: Array) -> Array:
        """Return C and D from the plant's residuals in the first part; shared ones are means over outputs."""
        u, y = parts[0]
        errors, _ = self.plant.record(u, y).errors_and_gradient(theta)
        if not np.all(np.isfinite(errors)):
            return np.zeros(self._own)
        orders = {letter: [0] * self.outputs for letter in "cd"}
        for parameter in self.model.own_parameters:
            for i, _ in parameter.places:
                orders[parameter.letter][i] = max(orders[parameter.letter][i], parameter.power)
        values: dict[tuple[str, int, int], float] = {}
        for i, fixed in enumerate(self.model.fixed):
            c, d = (orders[letter][i] for letter in "cd")
            for letter, row in zip("cd", noise_polynomials(_clear(fixed, errors[:, i]), c, d), strict=True):
                values |= {(letter, lag, i): float(value) for lag, value in enumerate(row, start=1)}
        return np.array(
            [
                np.mean([values[one.letter, one.power, i] for i, _ in one.places])
                for one in self.model.own_parameters
            ]
        )

    def holding(self, known: NDArray[np.bool_]) -> ColouredKind:
        """Return the kind whose plant keeps the known parameters."""
        return replace(self, plant=self.plant.holding(known[: len(self.model.plant.parameters)]))

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions of the plant; the tests of many signals look at C and D."""
        here = self.model.at(theta)
        of_plant = theta[: len(self.model.plant.parameters)]
        return tuple(
            replace(extension, model=larger, record=partial(_coloured, extension.record, larger))
            for extension in self.plant.extensions(of_plant, feedback=feedback)
            for larger in [replace(here, plant=extension.model)]
        )

    def simulated(
        self, found: Search, y: Array, lengths: Sequence[int] | None
    ) -> tuple[Array, Sequence[bool]]:
        """Return the simulation of the plant, by the errors and starts before they were filtered."""
        theta = found.point.theta[: len(self.model.plant.parameters)]
        shaped = self.model.at(found.point.theta).shaped
        at = np.cumsum(found.records.lengths)[:-1]
        errors, begun = (
            np.concatenate([shaped(part) for part in np.split(whole, at)])
            for whole in (found.point.errors, found.point.near.begun)
        )
        records = replace(found.records, parts=_of_plant(found.records, self.plant), earlier=None)
        near = replace(found.point.near, errors=errors, begun=begun)
        point = replace(found.point, theta=theta, near=near)
        return self.plant.simulated(replace(found, records=records, point=point), y, lengths)


def _coloured(record: Callable[[Array, Array], Record], model: Coloured, u: Array, y: Array) -> Record:
    return ColouredRecord(record(u, y), model)


def _of_plant(records: Records, plant: Kind) -> tuple[Record, ...]:
    return tuple(plant.record(part.u, part.y) for part in records.parts)


def _clear(known: Array, signals: Array) -> Array:
    """Return signals (N, ..) through a polynomial, without the samples that it begins with."""
    return filtered(known, [1.0], signals, axis=0)[known.size - 1 :]
