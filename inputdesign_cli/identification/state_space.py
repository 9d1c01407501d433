"""Estimate state-space models in their innovations form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import STEP, Kind, Mask, Parts, Starts, late_samples
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import StateSpaceModel
from inputdesign_cli.plant.model import DELAY

# Poles of the predictor may be on the unit circle, as integrators are, and beyond it by rounding.
_MARGIN = 1e-9
# A pole this near to one nearly integrates, so that states do not make up for an unknown input level.
_INTEGRATES = 1e-2


@dataclass(frozen=True)
class StateSpaceKind(Kind):
    """A state-space model in its innovations form; see `Kind`."""

    model: StateSpaceModel

    @cached_property
    def whitening(self) -> Mask:
        """Return the mask (k,) of the parameters of the noise model H."""
        coloured = bool(np.any(self.model.matrices.K))
        return np.array(
            [letter == "K" or (coloured and letter in "AC") for letter, _, _ in self.model.entries],
            dtype=bool,
        )

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p), one recursion for all."""
        model = self.model.at(theta)
        (_, early, late), m, n, p = model.held, model.matrices, model.order, y.shape[1]
        u0, u1, direct = (shifted(u, lag, (len(u),)) for lag in (model.lag, model.lag + 1, model.direct_lag))
        at_once, slopes, closed = direct @ m.D.T, model.slopes, self._closed(model)
        onward, read = (np.asarray(np.kron(np.eye(1 + len(slopes)), x), dtype=float) for x in (closed, m.C))
        driven, found = [u0 @ early.T + u1 @ late.T + (y - at_once) @ m.K.T], [at_once]
        for k, d in enumerate(slopes, start=1):
            onward[k * n : (k + 1) * n, :n] = d.A - m.K @ d.C - d.K @ m.C
            read[k * p : (k + 1) * p, :n] = d.C
            found.append(direct @ d.D.T)
            driven.append(u0 @ d.early.T + u1 @ d.late.T - found[k] @ m.K.T + (y - at_once) @ d.K.T)
        states = _recursion(onward, np.concatenate(driven, axis=1))
        every = (np.concatenate(found, axis=1) + states @ read.T).reshape(len(y), -1, p)
        return y - every[:, 0], np.moveaxis(every[:, 1:], 1, 0)

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the effect of the past: levels of the outputs, and the states at the start.

        Levels of inputs, which move integrating states for ever, are unknown as well. Earlier inputs that
        come late by the dead time move the states, sample by sample, along the directions of inputs. Their
        direct effect through D is not counted. From rest only noise has moved the states.
        """
        coloured, nothing = self._coloured, np.zeros((0, samples))
        if not (free or coloured):
            return (Start.white(nothing),) * self.model.outputs
        model = self.model.at(theta)
        m, n, p = model.matrices, model.order, model.outputs
        A, early, later = model.held
        pushes = np.eye(n) if n <= 2 * model.inputs else np.concatenate([early, later], axis=1).T
        if free:
            late = min(late, samples - 1)
            steady = n if np.any(np.abs(model.poles - 1.0) < _INTEGRATES) else 0
            size, levels = n + p + late * len(pushes) + steady, p
        else:
            late, steady, size, levels = 0, 0, n, 0
        x, level, driven = np.zeros((size, n)), np.zeros((size, p)), np.zeros((size, n))
        x[:n], driven[size - steady :] = np.eye(size, n)[:n], np.eye(steady, n)
        level[n : n + levels] = np.eye(levels, p)

        def responses(K: Array) -> Array:
            found, state, onward = np.empty((size, samples, p)), x.copy(), (A - K @ m.C).T
            for t in range(samples):
                if 0 < t <= late:
                    first = n + p + (t - 1) * len(pushes)
                    state[first : first + len(pushes)] += pushes
                found[:, t] = level - state @ m.C.T
                state = state @ onward + level @ K.T + driven
            return found

        through = responses(m.K)
        # The response of an unstable plant without its predictor would overflow.
        stable = bool(np.all(np.abs(model.poles) < 1.0 + _MARGIN))
        before = responses(np.zeros_like(m.K)) if coloured and stable else through
        return tuple(Start(through[:, :, i], before[:, :, i], nothing, np.zeros(())) for i in range(p))

    def in_starts(self, late: int, *, free: bool) -> Mask:
        """Return the mask of entries in A, C and K; of B and delays too if few inputs push many states."""
        pushed = free and late > 0 and self.model.order > 2 * self.model.inputs
        letters = ("A", "C", "K", *(("B", DELAY) if pushed else ()))
        wanted = np.array([letter in letters for letter, _, _ in self.model.entries], dtype=bool)
        return wanted & (free or self._coloured)

    def start_steps(self, theta: Array, samples: int) -> Array:
        """Return small shares of the entries as the differentiation steps."""
        return STEP * np.maximum(np.abs(theta), STEP)

    def lateness(self, theta: Array) -> int:
        """Return the dead time in samples, rounded up."""
        return late_samples(self.model.at(theta).matrices.delay, self.instants)

    @property
    def instants(self) -> float:
        """Return the time between the steps of the inputs."""
        return self.model.sample_time or 1.0

    @property
    def _coloured(self) -> bool:
        """Return whether noise moves the states."""
        estimated = any(letter == "K" for letter, _, _ in self.model.entries)
        return estimated or bool(np.any(self.model.matrices.K))

    def whitened(self, theta: Array, signals: Array) -> Array:
        """Return signals (N, m) filtered by the inverse noise model of each output, as (p, N, m)."""
        model = self.model.at(theta)
        C, K, closed = model.matrices.C, model.matrices.K, self._closed(model)
        driven = signals[:, :, None]
        each = (_recursion(closed, driven * K[:, i]) @ C[i] for i in range(model.outputs))
        return np.array([signals - own for own in each])

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta if its predictor is stable or integrates, otherwise infinite values."""
        out, late = theta.copy(), self.model.dead_times
        out[late] = np.clip(out[late], 0.0, (samples - 1) * self.instants)
        if np.max(np.abs(self.model.at(out).predictor_poles), initial=0.0) > 1.0 + _MARGIN:
            return np.full_like(theta, np.inf)
        return out

    def starting_points(self, parts: Parts, given: Array | None, known: Mask | None = None) -> Starts:
        """Return the nominal parameters, and the `given` ones."""
        return Starts(self.model.theta[None], 1).and_given(given)

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return for every output whether the plant is stable or integrates."""
        return (bool(np.all(np.abs(self.model.at(theta).poles) < 1.0 + _MARGIN)),) * self.model.outputs

    @staticmethod
    def _closed(model: StateSpaceModel) -> Array:
        """Return A - K C, the state matrix of the predictor."""
        return np.asarray(model.held[0] - model.matrices.K @ model.matrices.C)


def _recursion(onward: Array, driven: Array) -> Array:
    """Return states x (N, .., n) with x(t + 1) = onward x(t) + driven(t), from rest."""
    states, x, step = np.empty_like(driven), np.zeros_like(driven[0]), onward.T
    for t, own in enumerate(driven):
        states[t] = x
        x = x @ step + own
    return states
