"""Maximise quadratic forms of a few lags over all signals of given letters, by dynamic programming.

A signal takes its values, one a sample, from an alphabet of letters: vectors (r,) of the inputs.
The form sum_t u_t^T Q_0 u_t + 2 sum_k u_t^T Q_k u_(t-k), k < m, is a sum over windows of m letters. Walks on
the graph of windows are the signals, so that its largest mean is that of the best cycle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from inputdesign_cli.arrays import Array

_BLOCKS, _STEPS, _FINE = 100, 32, 1e-6  # blocks of value iterations, steps of each, relative gap at the end


@dataclass(frozen=True)
class Windows:
    """The windows of `length` m letters, two or more, of an alphabet (letters, r)."""

    letters: Array
    length: int

    @classmethod
    def within(cls, amplitude: Array, length: int) -> Windows:
        """Return the windows of the corners of |u_i| <= amplitude_i (r,), where convex forms are largest."""
        signs = np.array(list(product((-1.0, 1.0), repeat=amplitude.size)))
        return cls(signs * amplitude, length)

    @property
    def states(self) -> int:
        """Return the number of windows of m - 1 letters."""
        return len(self.letters) ** (self.length - 1)

    @cached_property
    def _past(self) -> Array:
        """Return the letters of every state, the latest first, (states, m - 1, r)."""
        number = np.arange(self.states)[:, None]
        digits = number // len(self.letters) ** np.arange(self.length - 1)[None, :] % len(self.letters)
        return self.letters[digits]

    def _rewards(self, form: Array) -> Array:
        """Return the part of each next letter in the form (m, r, r) at each state, (states, letters)."""
        pull = np.einsum("kab,skb->sa", form[1:], self._past)
        own = np.einsum("la,ab,lb->l", self.letters, form[0], self.letters)
        return own + 2.0 * pull @ self.letters.T

    def _next(self, values: Array) -> Array:
        """Return the values (states,) of the state that each letter leads to, (states, letters)."""
        size = len(self.letters)
        return np.tile(values.reshape(-1, size), (size, 1))

    def _best(self, rewards: Array, values: Array) -> Array:
        """Return the largest reward with the value behind it, (states,)."""
        size = len(self.letters)
        behind = values.reshape(-1, size)
        best = (rewards[0].reshape(size, -1) + behind[:, 0]).ravel()
        for letter in range(1, size):
            np.maximum(best, (rewards[letter].reshape(size, -1) + behind[:, letter]).ravel(), out=best)
        return best

    def largest_mean(
        self, form: Array, start: Array | None = None, enough: float = np.inf
    ) -> tuple[float, Array, Array]:
        """Return an upper bound of the largest mean of a form (m, r, r), a cycle of letters, and values.

        The bound holds for any values v (states,): no mean exceeds the largest T v - v, with T the step of
        dynamic programming.

        Args:
            start: the values to begin with, for example the result for another form.
            enough: ends the search when a cycle has a mean beyond this.
        """
        rewards = self._rewards(form)
        columns = np.ascontiguousarray(rewards.T)
        v = np.zeros(self.states) if start is None else start
        least = np.inf
        for _ in range(_BLOCKS):
            for _ in range(_STEPS):
                v = 0.5 * (self._best(columns, v) + v)
            v -= v.min()
            change = self._best(columns, v) - v
            least = min(least, float(change.max()))
            cycle = self._cycle(rewards, v)
            mean = float(np.sum(weighted(form) * self.lags(cycle)))
            if mean > enough or least - mean <= _FINE * abs(least):
                break
        return least, cycle, v

    def _cycle(self, rewards: Array, v: Array) -> Array:
        """Return the cycle (period, r) that the best next letters by the values (states,) lead into."""
        choice = (rewards + self._next(v)).argmax(axis=1)
        state, letters = 0, list[int]()
        seen = dict[int, int]()
        while state not in seen:
            seen[state] = len(letters)
            letter = int(choice[state])
            letters.append(letter)
            state = (state * len(self.letters) + letter) % self.states
        return self.letters[letters[seen[state] :]]

    def lags(self, cycle: Array) -> Array:
        """Return the autocovariances E u_t u_(t-k)^T, k < m, of a periodic signal (period, r), (m, r, r)."""
        return np.array([cycle.T @ np.roll(cycle, k, axis=0) for k in range(self.length)]) / len(cycle)

    def largest_sum(self, form: Array, samples: int) -> tuple[float, Array]:
        """Return the largest form (m, r, r) of records of this length from rest, and that record."""
        fewest = max(samples, 2)
        if self.length > fewest:  # lags beyond the record do not count
            return Windows(self.letters, fewest).largest_sum(form[:fewest], samples)
        size, m = len(self.letters), self.length
        rewards = self._rewards(form)
        values = np.zeros(self.states)
        choices = []
        for _ in range(samples - min(m - 1, samples)):
            every = rewards + self._next(values)
            choices.append(every.argmax(axis=1).astype(np.uint8))
            values = every.max(axis=1)
        for known in range(min(m - 1, samples) - 1, -1, -1):
            # The record begins from rest: after `known` letters, states consist of these only.
            past = Windows(self.letters, known + 1)
            every = past._rewards(form[: known + 1]) + values.reshape(-1, size)
            choices.append(every.argmax(axis=1).astype(np.uint8))
            values = every.max(axis=1)
        state, letters = 0, []
        for known, choice in enumerate(reversed(choices)):
            letter = int(choice[state])
            letters.append(letter)
            state = (state * size + letter) % size ** min(known + 1, m - 1)
        return float(values[0]), self.letters[letters]


def weighted(form: Array) -> Array:
    """Return the form (m, r, r) as weights of the lags: all but the first count twice."""
    weights = 2.0 * form
    weights[0] = form[0]
    return weights
