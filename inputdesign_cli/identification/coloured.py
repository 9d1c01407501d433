"""Estimate models with additional coloured noise, or with drift: see `plant.coloured`.

Prediction errors of the plant, and all that depends on them, go through D (1 - q^-1) / C. Starting points of
the plant are made from differences if the noise drifts. C and D begin with the residuals of the plant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import Extension, Kind, Part, Starts
from inputdesign_cli.identification.polynomial_starts import noise_polynomials
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import Coloured
from inputdesign_cli.plant.filtering import filtered


@dataclass(frozen=True)
class ColouredKind(Kind):
    """The structure of `model`; that of its plant is `plant`; see `Kind`."""

    model: Coloured
    plant: Kind

    @property
    def recent(self) -> int:
        """Return the largest lag at which inputs act directly on the plant."""
        return self.plant.recent

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) `explaining` of the plant, with False for C and D."""
        return np.concatenate([self.plant.explaining, np.zeros(len(self.model.own_parameters), dtype=bool)])

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return the mask (k,) `whitening` of the plant, with True for C and D."""
        return np.concatenate([self.plant.whitening, np.ones(len(self.model.own_parameters), dtype=bool)])

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p)."""
        model = self.model.at(theta)
        raw, of_plant = self.plant.errors_and_gradient(theta[: self._first], u, y)
        errors, psi = np.empty(raw.shape), np.zeros((theta.size, *raw.shape))
        for i, (above, below) in enumerate(model.inverse_filters):
            errors[:, i] = filtered(above, below, raw[:, i])
            psi[: self._first, :, i] = filtered(above, below, of_plant[:, :, i])
        for index, parameter in enumerate(model.own_parameters, start=self._first):
            for i, _ in parameter.places:
                polynomial, sign = model.below(parameter.letter, i)
                if polynomial is not None and parameter.power < len(errors):
                    late = filtered([sign], polynomial, errors[:, i])
                    psi[index, parameter.power :, i] = late[: len(errors) - parameter.power]
        return errors, psi

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the filtered starts of the plant, and the effect of noise before the record through C/D."""
        raw = self.plant.starts(theta[: self._first], samples, late, free=free)
        filters = self.model.at(theta).inverse_filters
        return tuple(start.through(C, D) for start, (D, C) in zip(raw, filters, strict=True))

    def in_starts(self, late: int, *, free: bool) -> NDArray[np.int64]:
        """Return the parameters on which the starts depend: in the plant, and all of C and D."""
        own = np.arange(self._first, len(self.model.names))
        return np.concatenate([self.plant.in_starts(late, free=free), own])

    def start_step(self, theta: Array, index: int, samples: int) -> float:
        """Return the differentiation step of a parameter of the plant, or of a coefficient of C and D."""
        if index < self._first:
            return self.plant.start_step(theta[: self._first], index, samples)
        return super().start_step(theta, index, samples)

    def lateness(self, theta: Array) -> int:
        """Return the number of samples in which earlier inputs act on the plant; see `Kind`."""
        return self.plant.lateness(theta[: self._first])

    @property
    def instants(self) -> float | None:
        """Return the time between the sampling instants of the plant."""
        return self.plant.instants

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals (N, m) filtered by the inverse noise model of each output, as (p, N, m)."""
        raw = self.plant.whitened(theta[: self._first], signals)
        filters = self.model.at(theta).inverse_filters
        return np.array([filtered(*own, x, axis=0) for own, x in zip(filters, raw, strict=True)])

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta, changed where its predictor would be unstable."""
        out = theta.copy()
        out[: self._first] = self.plant.stabilised(theta[: self._first], samples)
        for columns in self._monic:
            monic = np.append(1.0, theta[columns])
            if not is_stable(monic[None])[0]:
                out[columns] = reflected(monic)[1:]
        return out

    def starting_points(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Return the starting points of the plant, with C and D from its residuals, and the `given` one."""
        known = reduce(np.convolve, {tuple(p): p for p in self.model.fixed}.values())
        clear = [(_clear(known, u), _clear(known, y)) for u, y in parts]
        found = self.plant.starting_points(clear, None if given is None else given[: self._first])
        points = [np.concatenate([theta, self._noise(*parts[0], theta)]) for theta in found.points]
        return Starts(np.array(points), found.tried).and_given(given)

    def _noise(self, u: Array, y: Array, theta: Array) -> Array:
        """Return C and D from the plant's residuals in one record; shared ones are means over outputs."""
        own = self.model.own_parameters
        errors, _ = self.plant.errors_and_gradient(theta, u, y)
        if not np.all(np.isfinite(errors)):
            return np.zeros(len(own))
        values: dict[tuple[str, int, int], float] = {}
        for i, fixed in enumerate(self.model.fixed):
            c, d = (
                max((p.power for p in own if p.letter == letter and (i, i) in p.places), default=0)
                for letter in "cd"
            )
            for letter, row in zip("cd", noise_polynomials(_clear(fixed, errors[:, i]), c, d), strict=True):
                values |= {(letter, lag, i): float(value) for lag, value in enumerate(row, start=1)}
        return np.array([np.mean([values[one.letter, one.power, i] for i, _ in one.places]) for one in own])

    def holding(self, known: NDArray[np.bool_]) -> ColouredKind:
        """Return the kind whose plant keeps the known parameters."""
        return replace(self, plant=self.plant.holding(known[: self._first]))

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions of the plant; the tests with many regressors cover C and D."""
        found, here = [], self.model.at(theta)
        for one in self.plant.extensions(theta[: self._first], feedback=feedback):
            larger = replace(here, plant=one.model)
            found.append(one._replace(model=larger, kind=ColouredKind(larger, one.kind)))
        return tuple(found)

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return which outputs of the plant can be simulated."""
        return self.plant.simulates(theta[: self._first])

    @property
    def _first(self) -> int:
        """Return the number of parameters of the plant, which come before C and D."""
        return len(self.model.plant.parameters)

    @cached_property
    def _monic(self) -> list[NDArray[np.int64]]:
        """Return the indices in theta of the coefficients of each C, and of each D that is estimated."""
        groups: dict[tuple[str, tuple[tuple[int, int], ...]], list[int]] = {}
        for index, parameter in enumerate(self.model.own_parameters, start=self._first):
            if self.model.below(parameter.letter, parameter.places[0][0])[0] is not None:
                groups.setdefault((parameter.letter, parameter.places), []).append(index)
        return [np.array(indices) for indices in groups.values()]


def _clear(known: Array, signals: Array) -> Array:
    """Return signals (N, ..) filtered by a polynomial, without its first samples, whose past is unknown."""
    return filtered(known, [1.0], signals, axis=0)[known.size - 1 :]
