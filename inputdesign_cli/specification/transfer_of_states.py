"""The transfer functions of a system in state space, by poles and zeros; the response verifies them."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.errors import bad_spec

Entry = tuple[list[float], list[float]]
"""Numerator and denominator, descending."""
States = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

# Largest relative change of the response by cancelling a pole and a zero, and by the whole conversion.
_CANCELS = 1e-9
_DIFFERS = 1e-8
# Rounding of a sum relative to its terms, and of an eigenvalue relative to the norm of the matrix.
_ROUNDING = 1e-12


def transfer_functions(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, *, discrete: bool
) -> list[list[Entry]]:
    """Return rows of columns of numerators and denominators without common factors.

    Raises `SpecError`: `not-finite`; `inaccurate-conversion` if polynomials in floating point do not have
    the response of the states.
    """
    A, B, C, D = (np.asarray(part, dtype=float) for part in (A, B, C, D))
    if not all(np.isfinite(part).all() for part in (A, B, C, D)):
        raise bad_spec("not-finite", "the matrices of the system must be finite", key="plant")
    import scipy.linalg  # slow, and needed here alone

    if len(A):
        A, _, _, scale, _ = scipy.linalg.lapack.dgebal(A, scale=1, permute=0)
        B, C = B / scale[:, None], C * scale
    return [
        [_entry((A, B[:, [j]], C[[i]], D[[i]][:, [j]]), discrete=discrete) for j in range(D.shape[1])]
        for i in range(D.shape[0])
    ]


def _entry(states: States, *, discrete: bool) -> Entry:
    """Return the transfer function of one input and output with the fewest poles that has its response."""
    with np.errstate(all="ignore"):
        gain, excess = _leading(states)
        if gain == 0.0:
            return [0.0], [1.0]
        poles, zeros = np.linalg.eigvals(states[0]), _zeros(states, len(states[0]) - excess)
        poles[np.abs(poles) <= _ROUNDING * np.linalg.norm(states[0])] = 0.0
        for above, below in (_without_near_pairs(zeros, poles, discrete=discrete), (zeros, poles)):
            entry = tuple(np.atleast_1d(np.poly(roots)).real for roots in (above, below))
            for part in entry if discrete else ():  # a delay is a pole at zero, whatever the rounding
                part[np.abs(part) <= _ROUNDING * np.abs(part).max()] = 0.0
            found = (gain * entry[0]).tolist(), entry[1].tolist()
            if np.isfinite([*found[0], *found[1]]).all() and _agree(found, states, discrete=discrete):
                return found
    message = "the transfer functions of this system in state space cannot be represented in floating point"
    hint = "name the entries of the states that are estimated, or use a longer unit of time"
    raise bad_spec("inaccurate-conversion", message, hint=hint, key="plant")


def _leading(states: States) -> tuple[float, int]:
    """Return the first of d, c b, c A b, .. that is not rounding, and its index: poles less zeros."""
    A, column, c, d = states
    terms, value, size = np.abs(column), d.item(), abs(d.item())
    for excess in range(len(A) + 1):
        if abs(value) > _ROUNDING * size:
            return value, excess
        value, size = (c @ column).item(), (np.abs(c) @ terms).item()
        column, terms = A @ column, np.abs(A) @ terms
    return 0.0, 0


def _zeros(states: States, number: int) -> np.ndarray:
    """Return the zeros: the smallest generalised eigenvalues of [A, b; c, d], scaled to similar entries."""
    import scipy.linalg

    A, b, c, d = states
    if not number:
        return np.zeros(0)
    unit, of_b, of_c = (np.linalg.norm(part) or 1.0 for part in (A, b, c))
    system = np.block([[A / unit, b / of_b], [c / of_c, d * unit / of_b / of_c]])
    if not np.isfinite(system).all():
        return np.full(number, np.nan)
    found = scipy.linalg.eigvals(system, np.diag([*np.ones(len(A)), 0.0])) * unit
    return found[np.argsort(np.where(np.isfinite(found), np.abs(found), np.inf))[:number]]


def _without_near_pairs(
    zeros: np.ndarray, poles: np.ndarray, *, discrete: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Cancel poles with zeros that equal them but for rounding: (s - z)/(s - p) is 1 at every frequency."""
    kept, largest = [], np.abs(poles).max(initial=0.0)
    for zero in zeros:
        # The largest deviation from 1 is |z - p| over the distance of the pole from the stability boundary.
        away = np.abs(np.abs(poles) - 1.0) if discrete else np.abs(poles.real)
        effect = np.abs(poles - zero)
        near = np.flatnonzero(effect <= np.maximum(_CANCELS * away, _ROUNDING * largest))
        if near.size:
            poles = np.delete(poles, near[np.argmin(effect[near])])
        else:
            kept.append(zero)
    return np.array(kept), poles


def _agree(entry: Entry, states: States, *, discrete: bool) -> bool:
    """Return whether polynomials and states have the same response around their corner frequencies."""
    A, b, c, d = states
    top, bottom = entry
    roots = np.concatenate([np.roots(top), np.roots(bottom), np.linalg.eigvals(A) if len(A) else []])
    other = np.abs(np.angle(roots)) if discrete else np.abs(roots.imag)
    bends = np.concatenate([np.abs(np.abs(roots) - 1.0) if discrete else np.abs(roots), other])
    bends = bends[bends > 0]
    low, high = (bends.min() / 100, bends.max() * 100) if bends.size else (0.01, 100.0)
    grid = np.geomspace(max(low, 1e-12 * high), high, 200)
    # The factor keeps clear of the roots: at an undamped one the response is infinite.
    w = np.concatenate([grid, bends * 0.7]) * 1.0012345
    points = np.exp(1j * w[w <= np.pi]) if discrete else 1j * w
    inverse = np.linalg.inv(points[:, None, None] * np.eye(len(A)) - A)
    exact = (c @ inverse @ b + d)[:, 0, 0]
    size = (np.abs(c) @ np.abs(inverse) @ np.abs(b) + np.abs(d))[:, 0, 0]
    found = np.polyval(top, points) / np.polyval(bottom, points)
    return bool(np.all(np.abs(found - exact) <= _DIFFERS * np.abs(exact) + _ROUNDING * size))
