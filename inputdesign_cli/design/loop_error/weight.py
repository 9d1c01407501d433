"""Z: how much a unit of variance of the plant estimate at a frequency hurts the loop.

[rojas-asymptotic] (13), (17) and (19), without the factor n/(2 pi N), so that
N E||y - y0||^2 = mean over frequency of tr(Z Phi^-T) for n = 1.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import ComplexArray
from inputdesign_cli.design.loop_error.laws import kronecker


def adjoint(matrix: ComplexArray) -> ComplexArray:
    """The conjugate transpose for each frequency."""
    return np.conj(np.swapaxes(matrix, -1, -2))


def weight(propagation: ComplexArray, entering: ComplexArray, noise: ComplexArray) -> ComplexArray:
    """Z (K, n, n) from d vec(S G Delta C S) / d vec G (K, n^2, n^2), see `laws.propagation`.

    The middle factor of (13) is split as (S^T (x) S G)^* (Phi^* (x) I) (S^T (x) S G), which squares no
    condition numbers.

    Args:
        entering: Phi_r + Phi_v, what drives the error of the loop.
        noise: Phi_v.
    """
    n = entering.shape[1]
    middle = kronecker(np.conj(entering), np.broadcast_to(np.eye(n, dtype=complex), entering.shape))
    F = adjoint(propagation) @ middle @ propagation
    # (17): Z_kl = tr(F_kl Phi_v), F_kl the blocks of F.
    return np.asarray(np.einsum("kaibj,kji->kab", F.reshape(-1, n, n, n, n), noise))
