"""One entry of a transfer matrix behind a zero-order hold, with the gradients of its parameters in s.

Both come from one matrix exponential ([van-loan-1978]). The same states serve samples that are not held but
interpolated within their band.

A dead time is d whole samples and a fraction nu of one. During a sample the plant sees the older input for
the time nu and then the newer one, so that with Gamma(t) the integral of e^(A s) b over [0, t]

    x(k + 1) = e^(A h) x(k) + Gamma(h - nu) u(k - d) + (Gamma(h) - Gamma(h - nu)) u(k - d - 1) ,

which is exact for any fraction (the modified z-transform of [jury-1964]). The derivative with respect to the
dead time is driven by e^(A (h - nu)) b (u(k - d - 1) - u(k - d)). At a boundary between samples it is that
towards longer dead times: G has a kink there if its relative degree is one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.model import DELAY

# A transition matrix with smaller entries has decayed, far below rounding.
_DECAYED = 1e-20
# A dead time this near a boundary between samples, in samples, lies on it.
_ON_BOUNDARY = 1e-9


@dataclass(frozen=True)
class HeldEntry:
    """A transfer function e^(-delay s) b / a behind a hold, as rows that read states driven by samples.

    The columns are the states (1, s, .., s^{n-1}) / a, these over a^2, and the delayed input, where b has the
    degree of a. Where there is a `delay` (which may be zero), the derivatives with respect to it follow: of
    the first n states, and of the input.

    The unit of time is the geometric mean of the time constants, which keeps the companion form tame. `unit`
    is its length in the time of the spec, so that s = s' unit.
    """

    numerator: Array  # ascending in s, padded to the length of the denominator
    denominator: Array
    unit: float
    sample_time: float
    system: Array  # [A b; 0 0] in its own unit of time
    delay: float | None
    lag: int  # d, the whole samples of the dead time
    fraction: float  # the rest of it, in the time of the spec
    biproper: bool  # whether the delayed input itself is among the columns

    @classmethod
    def of(
        cls, numerator: Array, denominator: Array, sample_time: float, delay: float | None = None
    ) -> HeldEntry:
        """Return b / a, ascending in s, held over `sample_time` after a dead time."""
        n = denominator.size - 1
        padded = np.zeros(n + 1)
        padded[: numerator.size] = numerator
        moving = np.abs(polynomial_roots(denominator[integrators(denominator) :]))
        unit = float(np.exp(np.mean(np.log(moving)))) if moving.size else 1.0 / sample_time
        below = denominator * unit ** (np.arange(n + 1.0) - n)
        companion = np.eye(n, k=1)
        if n:
            companion[-1] = -below[:-1]
        system = np.zeros((2 * n + 1, 2 * n + 1))
        system[:n, :n] = system[n : 2 * n, n : 2 * n] = companion
        if n:
            system[2 * n - 1, 0] = 1.0  # the second copy is driven by 1 / a
            system[n - 1, 2 * n] = 1.0
        split, biproper = whole_samples(delay or 0.0, sample_time), numerator.size == n + 1
        return cls(padded, denominator, unit, sample_time, system, delay, *split, biproper)

    @property
    def order(self) -> int:
        """Return n, the degree of the denominator."""
        return self.denominator.size - 1

    @property
    def direct(self) -> float:
        """Return b / a at infinite frequency, the gain that acts without delay except the dead time."""
        return float(self.numerator[-1])

    @cached_property
    def transition(self) -> Array:
        """Return the transition matrix (2 order, 2 order) of the states over one sample."""
        return self._held[: 2 * self.order, : 2 * self.order]

    @cached_property
    def entries(self) -> Array:
        """Return the columns by which u(k - lag) and u(k - lag - 1) enter the states, (2 order, 2)."""
        n = 2 * self.order
        whole, early = self._held[:n, n], self._after_fraction[:n, n]
        return np.stack([early, whole - early], axis=1)

    @property
    def direct_lag(self) -> int:
        """Return the samples after which the direct gain acts: a fraction counts as a whole sample."""
        return self.lag + (self.fraction > 0.0)

    def _exponential(self, time: float) -> Array:
        return np.asarray(scipy.linalg.expm(self.system * (self.unit * time)))

    @cached_property
    def _held(self) -> Array:
        return self._exponential(self.sample_time)

    @cached_property
    def _after_fraction(self) -> Array:
        """Return the matrix exponential over the rest of a sample after the fraction."""
        return self._exponential(self.sample_time - self.fraction) if self.fraction else self._held

    @cached_property
    def gain(self) -> Array:
        """Return the row of the output."""
        row = self.row(self.numerator - self.direct * self.denominator, 1)
        if self.biproper:
            row[2 * self.order] = self.direct
        return row

    def responses(self, z: ComplexArray) -> ComplexArray:
        """Return the responses to held samples at points z of the unit circle, (m, columns)."""
        late = z ** -float(self.lag)
        entries = self.entries if self.fraction else self.entries[:, :1]
        driven = entries.T[:1] + entries.T[1:] / z[:, None] if self.fraction else entries.T
        parts: list[ComplexArray | Array] = [late[:, None] * self._through(driven, z)]
        if self.biproper:
            parts.append(z[:, None] ** -float(self.direct_lag))
        if self.delay is not None:
            # The gains by which u(k - d - 1) - u(k - d) enters the derivatives of the states.
            n = self.order
            pulse = np.concatenate([self.unit * self._after_fraction[:n, n - 1], np.zeros(n)])[None]
            parts.append((late * (1.0 / z - 1.0))[:, None] * self._through(pulse, z)[:, :n])
            if self.biproper:
                parts.append(np.zeros((z.size, 1)))
        return np.concatenate(parts, axis=1).astype(complex)

    def _through(self, driven: ComplexArray | Array, z: ComplexArray) -> ComplexArray:
        """Return the states (m, 2 order) that inputs (m or 1, 2 order) drive at points z, by substitution."""
        if not self.order:
            return np.zeros((z.size, 0), dtype=complex)
        triangle, basis = self._triangular
        into = basis.conj().T @ driven.T
        modes = np.zeros((len(into), z.size), dtype=complex)
        for row in reversed(range(len(into))):
            above = into[row] + triangle[row, row + 1 :] @ modes[row + 1 :]
            modes[row] = above / (z - triangle[row, row])
        return np.asarray((basis @ modes).T, dtype=complex)

    @cached_property
    def _triangular(self) -> tuple[ComplexArray, ComplexArray]:
        """Return the transition in triangular form, and its basis.

        The second copy of the states depends on the first, and integrators on the other states of their copy.
        Only the other states are brought to Schur's form, so that eigenvalues of integrators stay exactly
        one. A state in which integrators cancel then has no rounding of them near frequency zero.
        """
        n, m = self.order, integrators(self.denominator)
        turn = np.eye(n, dtype=complex)
        turn[m:, m:] = scipy.linalg.schur(self.transition[m:n, m:n], output="complex")[1]
        basis = np.zeros((2 * n, 2 * n), dtype=complex)
        basis[n:, :n] = basis[:n, n:] = turn
        return np.triu(basis.conj().T @ self.transition @ basis), basis

    def interpolated(self, w: Array | ComplexArray) -> ComplexArray:
        """Return the responses to interpolated samples, without a hold, at frequencies w, (m, columns).

        At w - j sigma the samples are weighted with e^(-sigma t).
        """
        s = 1j * w[:, None] / self.unit
        scaled = self.denominator * self.unit ** (np.arange(self.order + 1.0) - self.order)
        below = ascending.polyval(s, scaled)
        chain = s ** np.arange(self.order) / below
        late = np.exp(-1j * w * (self.delay or 0.0))[:, None]
        parts = [late * chain, late * chain / below, *([late] if self.biproper else [])]
        if self.delay is not None:
            slope = -1j * w[:, None] * late
            parts += [slope * chain, *([slope] if self.biproper else [])]
        return np.concatenate(parts, axis=1)

    def forgetting(self, responses: ComplexArray, z: ComplexArray, samples: int) -> ComplexArray:
        """Return responses (m, columns) at points z whose memory ends after this number of samples.

        They are exact in a record that is no longer, whatever the poles, since it begins from rest.
        """
        n = self.order
        left = samples - (0 if self.delay is None else self.lag + 1)
        if left <= 0:  # nothing arrives before the record ends
            return np.zeros_like(responses)
        lost = np.linalg.matrix_power(self.transition, left)
        if np.all(np.abs(lost) < _DECAYED):
            return responses
        kept, fade = responses.copy(), z[:, None] ** -float(left)
        blocks = [(slice(0, 2 * n), lost)]
        if self.delay is not None:
            start = 2 * n + self.biproper
            blocks.append((slice(start, start + n), lost[:n, :n]))
        for block, matrix in blocks:
            kept[:, block] -= fade * (responses[:, block] @ matrix.T)
        return kept

    def gradient(self, letter: str, power: int) -> Array:
        """Return the row of the gradient with respect to one coefficient, or to the dead time."""
        if letter == DELAY:
            n, row = self.order, np.zeros(self.columns)
            row[2 * n + self.biproper :][:n] = self.gain[:n]
            if self.biproper:
                row[-1] = self.direct
            return row
        above = np.zeros(power + 1)
        above[power] = 1.0
        if letter == "b":
            if power < self.order:
                return self.row(above, 1)
            row = self.row(above - self.denominator, 1)
            row[2 * self.order] = 1.0
            return row
        whole, rest = ascending.polydiv(ascending.polymul(above, self.numerator), self.denominator)
        return -self.row(np.asarray(whole), 1) - self.row(np.asarray(rest), 2)

    @property
    def columns(self) -> int:
        """Return the number of columns of the responses."""
        once = self.order + self.biproper
        return self.order + once + (0 if self.delay is None else once)

    def row(self, coefficients: Array, copy: int) -> Array:
        """Return the row that reads coefficients(s) / a^copy off the states; powers of s carry their unit."""
        row = np.zeros(self.columns)
        trimmed = np.asarray(coefficients, dtype=float)[: self.order]
        powers = np.arange(trimmed.size) - copy * self.order
        start = (copy - 1) * self.order
        row[start : start + trimmed.size] = trimmed * self.unit ** powers.astype(float)
        return row

    @cached_property
    def sampled(self) -> tuple[Array, Array]:
        """Return numerator and denominator of the entry behind the hold, in q^-1, ascending."""
        n = self.order
        below = np.asarray(np.poly(self.transition[:n, :n]) if n else np.ones(1), dtype=float)
        above = np.zeros(self.lag + n + 2)
        for late, entry in enumerate(self.entries[:n].T):
            markov, state = np.zeros(n + 1), entry
            for k in range(1, n + 1):
                markov[k], state = self.gain[:n] @ state, self.transition[:n, :n] @ state
            above[self.lag + late : self.lag + late + n + 1] += np.convolve(below, markov)[: n + 1]
        above[self.direct_lag : self.direct_lag + n + 1] += self.direct * below
        return (np.trim_zeros(above, "b") if np.any(above) else above[:1]), below

    @cached_property
    def roots(self) -> ComplexArray:
        """Return the poles and zeros in z, those at the origin left out."""
        if not self.order:
            return np.zeros(0, dtype=complex)
        above, below = self.sampled
        above = above[int(np.argmax(np.abs(above) > 1e-12 * np.abs(above).max())) :]
        return np.concatenate([np.roots(below), np.roots(above)]).astype(complex)


def whole_samples(delay: float, sample_time: float) -> tuple[int, float]:
    """Return the whole samples of a dead time, and the remaining fraction in the unit of time."""
    samples = delay / sample_time
    whole = int(np.floor(samples + _ON_BOUNDARY))
    left = samples - whole
    return whole, left * sample_time if left > _ON_BOUNDARY else 0.0


def integrators(denominator: Array) -> int:
    """Return the number of poles at s = 0 of a denominator with ascending coefficients."""
    return int(np.flatnonzero(denominator)[0])


def polynomial_roots(coefficients: Array) -> ComplexArray:
    """Return the roots of a polynomial with ascending coefficients, those at zero exact."""
    trimmed = np.trim_zeros(coefficients)
    zeros = np.trim_zeros(coefficients, "b").size - trimmed.size
    others = ascending.polyroots(trimmed) if trimmed.size else trimmed
    return np.concatenate([np.zeros(zeros), others]).astype(complex)


# Weights fall by e to this power over a record, and rounding grows as much.
_DECAY = 4.0


@dataclass(frozen=True)
class Intersample:
    """The intersample behaviour: signals are held (`hold`) over `sample_time`, or band-limited."""

    sample_time: float
    hold: bool

    def responses(self, entry: HeldEntry, signal: Array, *, hold: bool) -> Array:
        """Return the columns (.., N, columns) of an entry that samples (.., N) drive from rest.

        Measured outputs are never held, whatever the input is.
        """
        samples = signal.shape[-1]
        length = 2 * scipy.fft.next_fast_len(samples, real=True)
        angles = 2.0 * np.pi * np.arange(length // 2 + 1) / length
        if not integrators(entry.denominator):
            weights, w = np.ones(samples), angles.astype(complex)
        else:  # integrators are infinite at frequency zero: signals are weighted with e^(-rho t)
            decay = _DECAY / samples
            weights, w = np.exp(-decay * np.arange(samples)), angles - 1j * decay
        z = np.exp(1j * w)
        columns = entry.responses(z) if hold else entry.interpolated(w / self.sample_time)
        columns = entry.forgetting(columns, z, samples)
        transform = scipy.fft.rfft(signal * weights, length, axis=-1)
        driven = scipy.fft.irfft(transform[..., None] * columns, length, axis=-2)
        return np.asarray(driven[..., :samples, :] / weights[:, None])

    def caused(self, entry: HeldEntry, u: Array) -> Array:
        """Return the output (.., N) of an entry that samples u (.., N) drive."""
        return np.asarray(self.responses(entry, u, hold=self.hold) @ entry.gain)
