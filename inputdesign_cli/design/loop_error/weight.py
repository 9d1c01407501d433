"""Z: how much a unit of variance of the plant estimate at a frequency hurts the loop.

[rojas-asymptotic] (13), (17) and (19), without the factor n/(2 pi N), so that
N E||y - y0||^2 = mean over frequency of tr(Z Phi^-T) for n = 1.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.design.loop_error.laws import kronecker
from inputdesign_cli.plant.polynomial import ComplexArray


def adjoint(matrix: ComplexArray) -> ComplexArray:
    """The conjugate transpose for each frequency."""
    return np.conj(np.swapaxes(matrix, -1, -2))


def general_weight(
    S: ComplexArray, G: ComplexArray, jacobian: ComplexArray, entering: ComplexArray, noise: ComplexArray
) -> ComplexArray:
    """Z (K, n, n) by (13) and (17) for any law, from d vec C / d vec G (K, n^2, n^2).

    The middle factor of (13) is split as (S^T (x) S G)^* (Phi^* (x) I) (S^T (x) S G), which squares no
    condition numbers.

    Args:
        entering: Phi_r + Phi_v, what drives the error of the loop.
        noise: Phi_v.
    """
    return weight(kronecker(np.swapaxes(S, 1, 2), S @ G) @ jacobian, entering, noise)


def weight(propagation: ComplexArray, entering: ComplexArray, noise: ComplexArray) -> ComplexArray:
    """The same from d vec(S G Delta C S) / d vec G, which is finite also where C is not."""
    n = entering.shape[1]
    middle = kronecker(np.conj(entering), np.broadcast_to(np.eye(n, dtype=complex), entering.shape))
    return _blocks(adjoint(propagation) @ middle @ propagation, noise)


def reference_weight(
    S: ComplexArray, CS: ComplexArray, entering: ComplexArray, noise: ComplexArray
) -> ComplexArray:
    """Z by the formula before (19), for laws of the form C = G^-1 X."""
    power = np.trace(S @ noise @ adjoint(S), axis1=1, axis2=2).real
    return np.asarray(power[:, None, None] * np.conj(CS @ entering @ adjoint(CS)))


def _blocks(F: ComplexArray, noise: ComplexArray) -> ComplexArray:
    """(17): Z_kl = tr(F_kl Phi_v), F_kl the blocks of F."""
    n = noise.shape[1]
    return np.asarray(np.einsum("kaibj,kji->kab", F.reshape(-1, n, n, n, n), noise))
