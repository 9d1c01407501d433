"""Low-order rational filters from the taps of a causal factor, stable by construction.

The taps h_0 .. h_L are the impulse response of a filter of many states, a tapped delay line. Their Hankel
matrix, with h_{i+j+1} in block (i, j), takes past inputs to future outputs. Its singular values show how much
each state carries, and keeping the largest is a balanced truncation ([pernebo-silverman-1982]), whose poles
lie inside the unit circle. The model is read off the singular vectors as in [kung-1978].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
import scipy.sparse.linalg

from inputdesign_cli.arrays import Array, ComplexArray

_LONGEST = 1024


@dataclass(frozen=True)
class RationalFilter:
    """A filter x(t+1) = A x + B e, u = C x + D e with white e of covariance I."""

    A: Array
    B: Array
    C: Array
    D: Array

    @property
    def order(self) -> int:
        """Return the number of states."""
        return self.A.shape[0]

    @property
    def radius(self) -> float:
        """Return the largest modulus of a pole."""
        return float(np.abs(np.linalg.eigvals(self.A)).max(initial=0.0))

    def at(self, w: Array) -> ComplexArray:
        """Return the frequency response (K, n, n)."""
        z = 1 / np.exp(-1j * w)
        states = np.linalg.solve(
            z[:, None, None] * np.eye(self.order) - self.A, np.broadcast_to(self.B, (w.size, *self.B.shape))
        )
        return np.asarray(self.C @ states + self.D)

    def spectrum(self, w: Array) -> ComplexArray:
        """Return response times its conjugate transpose (K, n, n)."""
        response = self.at(w)
        return np.asarray(response @ np.conj(np.swapaxes(response, 1, 2)))

    def power(self) -> Array:
        """Return the exact mean squares of its outputs, (n,)."""
        covariance = scipy.linalg.solve_discrete_lyapunov(self.A, self.B @ self.B.T)
        return np.diag(self.C @ covariance @ self.C.T + self.D @ self.D.T)

    def scaled(self, factor: float) -> RationalFilter:
        """Return the filter with its output times `factor`."""
        return RationalFilter(self.A, self.B, factor * self.C, factor * self.D)

    def filtered(self, samples: int, rng: np.random.Generator) -> Array:
        """Return stationary noise, started from the stationary distribution of the state, (samples, n)."""
        import scipy.signal  # only now: see `plant.filtering`

        covariance = scipy.linalg.solve_discrete_lyapunov(self.A, self.B @ self.B.T)
        values, vectors = np.linalg.eigh(covariance)
        state = vectors @ (np.sqrt(np.maximum(values, 0)) * rng.standard_normal(self.order))
        drive = rng.standard_normal((samples, self.B.shape[1]))
        return np.asarray(scipy.signal.dlsim((self.A, self.B, self.C, self.D, 1.0), drive, x0=state)[1])


def rational_filter(taps: Array, order: int) -> RationalFilter:
    """Return the filter with `taps` (L, n, n), cut down to `order` states for each input.

    With the Hankel matrix H = U S V^T, cut to its largest singular values, U S^(1/2) stacks C, C A, C A^2, ..
    and S^(1/2) V^T is [B, A B, A^2 B, ..]. C and B are their first blocks, and A takes the first stack to
    itself moved up by one block. H is never formed. Its products with vectors are convolutions with the taps,
    made by FFT; the singular value decomposition needs no more.
    """
    taps = taps[: 2 * _LONGEST]
    n = taps.shape[1]
    half = (taps.shape[0] - 1) // 2
    blocks = np.zeros((2 * half, n, n))
    blocks[: taps.shape[0] - 1] = taps[1 : 2 * half + 1]

    def apply(flip: bool) -> Callable[[Array], Array]:
        kernel = np.fft.rfft(np.swapaxes(blocks, 1, 2) if flip else blocks, 4 * half, axis=0)

        def product(vector: Array) -> Array:
            columns = np.fft.rfft(vector.reshape(half, n)[::-1], 4 * half, axis=0)
            full = np.fft.irfft(np.einsum("kij,kj->ki", kernel, columns), 4 * half, axis=0)
            return full[half - 1 : 2 * half - 1].ravel()

        return product

    hankel = scipy.sparse.linalg.LinearOperator(
        (half * n, half * n), matvec=apply(False), rmatvec=apply(True), dtype=float
    )
    states = order * n
    start = np.random.default_rng(0).standard_normal(half * n)
    left, values, right = scipy.sparse.linalg.svds(hankel, k=states, v0=start)
    rank = np.argsort(values)[::-1]
    left, values, right = left[:, rank], values[rank], right[rank]
    held = values > 1e-12 * values[0]
    root = np.sqrt(values[held])
    observed, reached = left[:, held] * root, root[:, None] * right[held]
    # The taps end, so the rows that the shift brings in are zero and the truncation is a contraction.
    shifted = np.vstack([observed[n:], np.zeros((n, root.size))])
    A = (observed / root**2).T @ shifted
    return RationalFilter(A, reached[:, :n], observed[:n], taps[0])
